//! Tests `replay verify --baseline` on a suite: logs in subdirectories, and a campaign.

use std::path::{Path, PathBuf};
use std::process::Command;

use campaign::store::{Order, Shard, Store};
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use serde_json::Value;
use sim::recipe::Recipe;
use tempfile::TempDir;

use crate::command_line::run;
use crate::flown::write_log;
use crate::from_apogee::LANDED;
use crate::simulated::{DISPERSED, MK2};
use crate::tampered::Held;

struct Suite {
    directory: TempDir,
}

impl Suite {
    /// Two landings of the first week, a rocket of the second.
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let suite = Self { directory };
        for (from, to) in [
            (&MK2.log, "week-1/nominal.mcap"),
            (&DISPERSED.log, "week-1/dispersed.mcap"),
            (&LANDED.log, "week-2/mk2.mcap"),
        ] {
            let to = suite.logs().join(to);
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(from, to).unwrap();
        }
        suite
    }

    fn logs(&self) -> PathBuf {
        self.directory.path().join("suite")
    }

    fn beside(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn baseline(&self) -> PathBuf {
        self.beside("baseline.json")
    }

    fn gate(&self, arguments: &[&str]) -> (i32, String, String) {
        gate(&self.logs(), &self.baseline(), arguments)
    }

    /// Changes the baseline of a flight.
    fn rewrite(&self, name: &str, change: impl Fn(&mut Value)) {
        let mut baseline: Value =
            serde_json::from_str(&std::fs::read_to_string(self.baseline()).unwrap()).unwrap();
        change(&mut baseline["flights"][name]);
        std::fs::write(self.baseline(), baseline.to_string()).unwrap();
    }
}

fn gate(directory: &Path, baseline: &Path, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_replay"));
    run(command.arg("verify").arg(directory).arg("--baseline").arg(baseline).args(arguments))
}

/// The rest of the row of a flight.
fn row<'a>(table: &'a str, flight: &str) -> &'a str {
    table.lines().find_map(|line| line.strip_prefix(flight)).unwrap_or_else(|| panic!("{flight}: {table}"))
}

#[test]
fn an_accepted_suite_passes_until_a_flight_gets_worse() {
    let suite = Suite::new();
    let (code, _, stderr) = suite.gate(&[]);
    assert!(code == 2 && stderr.contains("--accept writes a first baseline"), "{stderr}");
    let (code, stdout, _) = suite.gate(&["--accept"]);
    assert!(code == 0 && stdout.contains("3 new") && suite.baseline().exists(), "{stdout}");
    let (code, stdout, _) = suite.gate(&[]);
    assert!(code == 0 && stdout.ends_with("PASSED: 3 flights: 3 same\n"), "{stdout}");
    assert!(row(&stdout, "week-2/mk2.mcap").contains("identical"), "{stdout}");

    // The baseline had more margin in one flight, less in another, and another ending in the third.
    suite.rewrite("week-1/nominal.mcap", |flight| flight["flown"]["margin"] = "0.99".into());
    suite.rewrite("week-1/dispersed.mcap", |flight| flight["flown"]["margin"] = "-0.5".into());
    suite.rewrite("week-2/mk2.mcap", |flight| flight["flown"]["landed"] = false.into());
    let junit = suite.beside("gate.xml");
    let (code, stdout, _) = suite.gate(&[&format!("--junit={}", junit.display())]);
    assert_eq!(code, 1, "{stdout}");
    for (flight, word) in [
        ("week-1/nominal.mcap", "WORSE"),
        ("week-1/dispersed.mcap", "better"),
        ("week-2/mk2.mcap", "FLIPPED: lands now"),
    ] {
        assert!(row(&stdout, flight).contains(word), "{word}: {stdout}");
    }
    assert!(stdout.ends_with("FAILED: 3 flights: 1 better, 1 FLIPPED: lands now, 1 WORSE\n"), "{stdout}");
    assert_eq!(elements(&std::fs::read_to_string(junit).unwrap()), [("testcase", 3), ("failure", 1)]);

    let (code, _, _) = suite.gate(&["--accept"]);
    assert_eq!((code, suite.gate(&[]).0), (0, 0));
    std::fs::remove_file(suite.logs().join("week-2/mk2.mcap")).unwrap();
    let (code, stdout, _) = suite.gate(&[]);
    assert!(code == 1 && row(&stdout, "week-2/mk2.mcap").contains("MISSING"), "{stdout}");
}

#[test]
fn a_gate_overwrites_nothing() {
    let suite = Suite::new();
    let log = suite.logs().join("week-2/mk2.mcap");
    let baseline = suite.beside("foreign.json");
    std::fs::write(&baseline, "{\n  \"flights\": {}\n}\n").unwrap();
    for (option, file) in
        [("--junit", &log), ("--junit", &baseline), ("--state", &log), ("--state", &baseline)]
    {
        let before = std::fs::read(file).unwrap();
        let (code, stdout, stderr) = suite.gate(&["--accept", &format!("{option}={}", file.display())]);
        assert!(code == 2 && stderr.contains(&file.display().to_string()), "{option}: {stdout}{stderr}");
        assert!(!suite.baseline().exists() && std::fs::read(file).unwrap() == before, "{option}");
    }
}

#[test]
fn a_renamed_flight_passes_and_a_copy_is_told() {
    let suite = Suite::new();
    assert_eq!(suite.gate(&["--accept"]).0, 0);
    let named = |name: &str| suite.logs().join(name);
    std::fs::rename(named("week-1/nominal.mcap"), named("week-2/z.mcap")).unwrap();
    std::fs::copy(named("week-2/mk2.mcap"), named("week-1/a.mcap")).unwrap();
    let (code, stdout, _) = suite.gate(&[]);
    assert!(code == 0 && stdout.ends_with("PASSED: 4 flights: 3 same, 1 copy\n"), "{stdout}");
    assert!(row(&stdout, "week-1/a.mcap").contains("copy"), "{stdout}");
}

#[test]
fn a_damaged_log_is_not_accepted_and_never_passes() {
    let suite = Suite::new();
    let log = suite.logs().join("week-1/nominal.mcap");
    let mut bytes = std::fs::read(&log).unwrap();
    bytes.truncate(bytes.len() * 2 / 3);
    std::fs::write(&log, bytes).unwrap();
    let (code, stdout, stderr) = suite.gate(&["--accept"]);
    assert!(code == 2 && stderr.contains("nothing is accepted: week-1/nominal.mcap"), "{stdout}{stderr}");
    assert!(!suite.baseline().exists());
    let nothing = r#"{"format": 1, "build": {}, "flights": {}}"#;
    std::fs::write(suite.baseline(), nothing).unwrap();
    assert_eq!(suite.gate(&[]).0, 1);
}

#[test]
fn an_option_of_the_gate_without_a_baseline_is_an_error() {
    let (code, _, stderr) = run(crate::command_line::replay("verify", &MK2.log).args(["--tolerance", "0.1"]));
    assert!(code == 2 && stderr.contains("--baseline"), "{stderr}");
}

/// Counts the cases and the failures of a JUnit file.
fn elements(xml: &str) -> [(&'static str, usize); 2] {
    let document = roxmltree::Document::parse(xml).unwrap();
    ["testcase", "failure"]
        .map(|name| (name, document.descendants().filter(|node| node.has_tag_name(name)).count()))
}

#[test]
fn a_log_that_diverges_or_breaks_fails() {
    let suite = Suite::new();
    suite.gate(&["--accept"]);
    // A forged command: the recorded decisions are not those of this build.
    let mut held = Held::read(&MK2.log);
    let forged = held.messages.iter_mut().filter(|message| message.is_frame()).nth(50).unwrap();
    let mut frame = ComputerFrame::decode(forged.data.as_slice()).unwrap();
    frame.output.fins_rad[0] += 0.01;
    forged.data = frame.encode_to_vec();
    held.write(&suite.logs().join("week-1/nominal.mcap"));
    std::fs::write(suite.logs().join("week-1/dispersed.mcap"), "no log").unwrap();
    let (code, stdout, _) = suite.gate(&[]);
    assert_eq!(code, 1, "{stdout}");
    assert!(row(&stdout, "week-1/nominal.mcap").contains("DIVERGED"), "{stdout}");
    assert!(row(&stdout, "week-1/dispersed.mcap").contains("LOST"), "{stdout}");
    assert!(row(&stdout, "week-1/dispersed.mcap").contains("is not a flight log"), "{stdout}");
}

#[test]
fn a_file_without_a_flight_is_no_flight_of_the_baseline() {
    let suite = Suite::new();
    let empty = write_log(&[], &crate::flown::Recipe { with_frames: false, ..Default::default() }).bytes;
    let beside = suite.logs().join("week-2/ground.mcap");
    std::fs::write(&beside, &empty).unwrap();
    let (code, stdout, _) = suite.gate(&["--accept"]);
    assert!(code == 0 && stdout.ends_with("PASSED: 3 flights: 3 new, 1 no flight\n"), "{stdout}");
    assert!(!std::fs::read_to_string(suite.baseline()).unwrap().contains("ground.mcap"));
    let (code, stdout, _) = suite.gate(&[]);
    assert!(code == 0 && row(&stdout, "week-2/ground.mcap").contains("no flight"), "{stdout}");

    // A flight of the baseline that became an empty file is lost; it did not land differently.
    std::fs::write(suite.logs().join("week-1/nominal.mcap"), &empty).unwrap();
    let (code, stdout, _) = suite.gate(&[]);
    assert_eq!(code, 1, "{stdout}");
    let nominal = row(&stdout, "week-1/nominal.mcap");
    assert!(nominal.contains("LOST") && nominal.contains("no frames of a flight computer"), "{stdout}");
}

#[test]
fn a_directory_without_a_flight_has_no_answer() {
    let directory = tempfile::tempdir().unwrap();
    let (logs, baseline) = (directory.path().join("logs"), directory.path().join("baseline.json"));
    std::fs::create_dir(&logs).unwrap();
    let empty = write_log(&[], &crate::flown::Recipe::default()).bytes;
    std::fs::write(logs.join("a.mcap"), empty).unwrap();
    let (code, _, stderr) = gate(&logs, &baseline, &["--accept"]);
    assert!(code == 2 && stderr.contains("none of its logs holds a flight; a.mcap"), "{stderr}");
    assert!(!baseline.exists());
    let nothing_accepted = r#"{"format": 1, "build": {}, "flights": {}}"#;
    std::fs::write(&baseline, nothing_accepted).unwrap();
    let (code, _, stderr) = gate(&logs, &baseline, &[]);
    assert!(code == 2 && stderr.contains("none of its logs holds a flight"), "{stderr}");
}

#[test]
fn the_answer_depends_neither_on_the_jobs_nor_on_an_interruption() {
    let suite = Suite::new();
    suite.gate(&["--accept"]);
    let one = suite.gate(&["--jobs", "1", "--json"]).1;
    assert_eq!(one, suite.gate(&["--jobs", "3", "--json"]).1);
    let state = suite.beside("state.jsonl");
    let with_state = ["--json", "--state", &state.display().to_string()].map(str::to_owned);
    let with_state: Vec<&str> = with_state.iter().map(String::as_str).collect();
    assert_eq!(one, suite.gate(&with_state).1);
    // Killed in the middle of a line: the other flights are not flown again, and the answer is the same.
    let kept = std::fs::read_to_string(&state).unwrap();
    assert_eq!(kept.lines().filter(|line| !line.is_empty()).count(), 3);
    std::fs::write(&state, &kept[..kept.len() - 9]).unwrap();
    assert_eq!(one, suite.gate(&with_state).1);
    let kept = std::fs::read_to_string(&state).unwrap();
    assert_eq!(kept.lines().filter(|line| !line.is_empty()).count(), 4, "one broken, one anew: {kept}");
}

#[test]
fn a_campaign_is_flown_again_from_its_order() {
    let directory = tempfile::tempdir().unwrap();
    let (campaign, baseline) = (directory.path().join("campaign"), directory.path().join("baseline.json"));
    let recipe = Recipe { seed: 5, ..Recipe::built_in("mk2", "field").unwrap() };
    let order = Order { recipe, flights: 3 };
    let manifest = order.manifest("test", Shard::WHOLE);
    let store = Store::open(&campaign, &order, &manifest).unwrap();
    campaign::run::run(&order, &store, &|_| {}).unwrap();
    campaign::run::publish(&order, &store).unwrap();
    drop(store);
    let (code, stdout, stderr) = gate(&campaign, &baseline, &["--accept"]);
    assert!(code == 0 && stdout.contains("3 new"), "{stdout}{stderr}");
    for number in 0..3 {
        assert!(row(&stdout, &format!("#{number} ")).contains("identical"), "{stdout}");
    }
    assert_eq!(gate(&campaign, &baseline, &[]).0, 0);
    // Another seed flies other flights: the rows are not reproduced.
    let path = campaign.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap().replacen("\"seed\": 5", "\"seed\": 6", 1);
    std::fs::write(&path, text).unwrap();
    let (code, stdout, _) = gate(&campaign, &baseline, &[]);
    assert!(code == 1 && stdout.contains("DIVERGED"), "{stdout}");
}

/// A pipe would be waited for without end, a link to its own directory would count every flight again, and a link to nothing
/// is no flight.
#[test]
fn every_regular_file_counts_once_and_what_is_left_out_is_told() {
    let suite = Suite::new();
    let logs = suite.logs();
    let pipe = logs.join("pipe.mcap");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    std::os::unix::fs::symlink(".", logs.join("self")).unwrap();
    std::os::unix::fs::symlink("nowhere.mcap", logs.join("dangling.mcap")).unwrap();
    std::os::unix::fs::symlink("week-1/nominal.mcap", logs.join("again.mcap")).unwrap();
    let (found, skipped) = replay::verify::suite::find(&logs).unwrap();
    let names: Vec<&str> = found.iter().map(|found| found.name.as_str()).collect();
    assert_eq!(names, ["week-1/dispersed.mcap", "week-1/nominal.mcap", "week-2/mk2.mcap"]);
    let skipped: Vec<(&str, &str)> = skipped.iter().map(|left| (left.name.as_str(), left.reason)).collect();
    assert_eq!(
        skipped,
        [
            ("again.mcap", "a log that is here already"),
            ("dangling.mcap", "a link to nothing"),
            ("pipe.mcap", "not a regular file"),
            ("self", "a directory that is here already"),
        ]
    );
    let (code, _, stderr) = suite.gate(&["--accept"]);
    assert!(code == 0 && stderr.contains("left out: pipe.mcap: not a regular file"), "{stderr}");
}

/// A crash whose file is replaced by another flight that landed has not been mended.
#[test]
fn another_flight_under_the_name_of_a_crash_is_not_that_crash_landing() {
    let suite = Suite::new();
    assert_eq!(suite.gate(&["--accept"]).0, 0);
    std::fs::copy(&DISPERSED.log, suite.logs().join("week-1/nominal.mcap")).unwrap();
    let (code, table, _) = suite.gate(&[]);
    assert_eq!(code, 1, "{table}");
    assert!(table.contains("MISSING") && table.contains("copy") && !table.contains("FLIPPED"), "{table}");
}
