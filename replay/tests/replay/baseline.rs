//! Tests `replay verify --baseline` on a directory of logs, in subdirectories, too.

use std::path::PathBuf;
use std::process::Command;

use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use serde_json::Value;
use tempfile::TempDir;

use crate::command_line::run;
use crate::flown::write_log;
use crate::from_apogee::LANDED;
use crate::simulated::{DISPERSED, MK2};
use crate::tampered::Held;

struct Logs {
    directory: TempDir,
}

impl Logs {
    /// Two landings of the first week, a rocket of the second.
    fn new() -> Self {
        let logs = Self { directory: tempfile::tempdir().unwrap() };
        for (from, to) in [
            (&MK2.log, "week-1/nominal.mcap"),
            (&DISPERSED.log, "week-1/dispersed.mcap"),
            (&LANDED.log, "week-2/mk2.mcap"),
        ] {
            let to = logs.at(to);
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(from, to).unwrap();
        }
        logs
    }

    fn at(&self, name: &str) -> PathBuf {
        self.directory.path().join("logs").join(name)
    }

    fn baseline(&self) -> PathBuf {
        self.directory.path().join("baseline.json")
    }

    fn verify(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_replay"));
        run(command.arg("verify").arg(self.at("")).arg("--baseline").arg(self.baseline()).args(arguments))
    }

    /// Changes the baseline of a flight.
    fn rewrite(&self, log: &str, change: impl Fn(&mut Value)) {
        let text = std::fs::read_to_string(self.baseline()).unwrap();
        let mut baseline: Value = serde_json::from_str(&text).unwrap();
        change(&mut baseline[log]);
        std::fs::write(self.baseline(), baseline.to_string()).unwrap();
    }
}

/// The rest of the row of a flight.
fn row<'a>(table: &'a str, log: &str) -> &'a str {
    table.lines().find_map(|line| line.strip_prefix(log)).unwrap_or_else(|| panic!("{log}: {table}"))
}

#[test]
fn accepted_logs_pass_until_a_flight_gets_worse() {
    let logs = Logs::new();
    assert_eq!(logs.verify(&[]).0, 1, "there is none");
    let (code, stdout, _) = logs.verify(&["--accept"]);
    assert!(code == 0 && stdout.matches(" new ").count() == 3 && logs.baseline().exists(), "{stdout}");
    let (code, stdout, _) = logs.verify(&[]);
    assert!(code == 0 && stdout.matches(" same ").count() == 3, "{stdout}");

    // The baseline had more margin in one flight, less in another, and another ending in the third.
    logs.rewrite("week-1/nominal.mcap", |flight| flight["margin"] = 0.99.into());
    logs.rewrite("week-1/dispersed.mcap", |flight| flight["margin"] = (-0.5).into());
    logs.rewrite("week-2/mk2.mcap", |flight| flight["stands"] = false.into());
    let (code, stdout, _) = logs.verify(&[]);
    assert_eq!(code, 3, "{stdout}");
    for (log, word) in [
        ("week-1/nominal.mcap", "WORSE"),
        ("week-1/dispersed.mcap", "better"),
        ("week-2/mk2.mcap", "FLIPPED: stands now"),
    ] {
        assert!(row(&stdout, log).contains(word), "{word}: {stdout}");
    }
    assert_eq!((logs.verify(&["--accept"]).0, logs.verify(&[]).0), (0, 0));
    logs.rewrite("week-2/mk2.mcap", |flight| flight["content"] = "another".into());
    std::fs::remove_file(logs.at("week-1/nominal.mcap")).unwrap();
    let (code, stdout, _) = logs.verify(&["--json"]);
    let judged: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &judged[0]["change"], &judged[1]["change"]), (3, &"lost".into(), &"lost".into()));
}

#[test]
fn a_file_that_is_no_baseline_is_kept() {
    let logs = Logs::new();
    for content in ["{\n  \"flights\": {}\n}\n", "notes"] {
        std::fs::write(logs.baseline(), content).unwrap();
        assert_eq!(logs.verify(&["--accept"]).0, 1);
        assert_eq!(std::fs::read_to_string(logs.baseline()).unwrap(), content);
    }
}

#[test]
fn a_log_that_diverges_or_breaks_fails_and_is_not_accepted() {
    let logs = Logs::new();
    logs.verify(&["--accept"]);
    let accepted = std::fs::read(logs.baseline()).unwrap();
    // A forged command: the recorded decisions are not those of this build.
    let mut held = Held::read(&MK2.log);
    let forged = held.messages.iter_mut().filter(|message| message.is_frame()).nth(150).unwrap();
    let mut frame = ComputerFrame::decode(forged.data.as_slice()).unwrap();
    frame.output.fins_rad[0] += 0.01;
    forged.data = frame.encode_to_vec();
    held.write(&logs.at("week-1/nominal.mcap"));
    std::fs::write(logs.at("week-1/dispersed.mcap"), "no log").unwrap();
    let mut bytes = std::fs::read(logs.at("week-2/mk2.mcap")).unwrap();
    bytes.truncate(bytes.len() * 2 / 3);
    std::fs::write(logs.at("week-2/mk2.mcap"), bytes).unwrap();
    let (code, stdout, _) = logs.verify(&[]);
    assert_eq!(code, 3, "{stdout}");
    for (log, words) in [
        ("week-1/nominal.mcap", ["DIVERGED", "first different at frame"]),
        ("week-1/dispersed.mcap", ["LOST", "another flight"]),
        ("week-2/mk2.mcap", ["LOST", "ends after"]),
    ] {
        assert!(words.iter().all(|word| row(&stdout, log).contains(word)), "{words:?}: {stdout}");
    }
    assert_eq!(logs.verify(&["--accept"]).0, 1);
    assert_eq!(std::fs::read(logs.baseline()).unwrap(), accepted);
}

/// A ground station's log has no flight; a pipe would be waited for without end; a link to its own
/// directory would count every flight again.
#[test]
fn only_flights_count_and_each_once() {
    let logs = Logs::new();
    let empty = write_log(&[], &crate::flown::Recipe { with_frames: false, ..Default::default() }).bytes;
    std::fs::write(logs.at("week-2/ground.mcap"), &empty).unwrap();
    assert!(Command::new("mkfifo").arg(logs.at("pipe.mcap")).status().unwrap().success());
    for (to, from) in [(".", "self"), ("nowhere.mcap", "gone.mcap"), ("week-1/nominal.mcap", "again.mcap")] {
        std::os::unix::fs::symlink(to, logs.at(from)).unwrap();
    }
    let (code, stdout, stderr) = logs.verify(&["--accept"]);
    assert!(code == 0 && stdout.ends_with("\n3 flights\n"), "{stdout}{stderr}");
    for left in ["pipe.mcap", "gone.mcap"] {
        assert!(stderr.lines().any(|line| line.contains("left out") && line.contains(left)), "{stderr}");
    }
    for log in ["week-1/nominal.mcap", "week-1/dispersed.mcap", "week-2/mk2.mcap"] {
        std::fs::write(logs.at(log), &empty).unwrap();
    }
    let (code, stdout, _) = logs.verify(&[]);
    assert!(code == 3 && stdout.matches(" LOST ").count() == 3, "{stdout}");
    std::fs::remove_file(logs.baseline()).unwrap();
    assert_eq!(logs.verify(&["--accept"]).0, 1, "none of its logs holds a flight");
}
