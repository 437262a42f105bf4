//! Tests small questions that used to be answered badly.

use std::io::Write as _;
use std::process::Stdio;

use serde_json::Value;

use crate::command_line::{data, refusal, replay, run};
use crate::from_apogee::LANDED;
use crate::simulated::MK2;

#[test]
fn a_setting_after_the_end_of_the_flight_is_refused() {
    for log in [&MK2.log, &LANDED.log] {
        let refused = refusal(replay("evaluate", log).args(["--set", "powered.weights.theta=90@600"]));
        assert!(refused.contains("takes effect after the end of"), "{refused}");
    }
}

#[test]
fn info_takes_several_logs_and_standard_input() {
    let (code, found) = data(replay("info", &MK2.log).arg(&LANDED.log));
    assert_eq!((code, found.as_array().unwrap().len()), (0, 2));
    let (code, found) = data(replay("info", &MK2.log).arg(MK2.beside("none.mcap")));
    assert_eq!((code, found.as_array().unwrap().len()), (5, 1));
    let mut child = replay("info", "-".as_ref());
    child.arg("--json").stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = child.spawn().unwrap();
    child.stdin.take().unwrap().write_all(&std::fs::read(&MK2.log).unwrap()).unwrap();
    let found: Value = serde_json::from_slice(&child.wait_with_output().unwrap().stdout).unwrap();
    assert_eq!((&found["file"], &found["grade"]["level"]), (&"standard input".into(), &"bit-exact".into()));
}

/// A message and its cause do not repeat each other.
#[test]
fn no_message_is_printed_twice() {
    let none = MK2.beside("none.mcap");
    let mut unknown = replay("refly", &MK2.log);
    unknown.args(["--set", "powered.wights.theta=80"]);
    for mut command in [replay("info", &none), replay("verify", &none), replay("report", &none), unknown] {
        let (code, stdout, stderr) = run(&mut command);
        assert!(code == 1, "{stdout}{stderr}");
        let message = stderr.lines().last().unwrap_or_default();
        let parts: Vec<&str> = message.split(": ").collect();
        for (place, part) in parts.iter().enumerate() {
            assert!(
                part.len() < 8 || !parts[place + 1..].iter().any(|later| later.contains(part)),
                "{message}"
            );
        }
    }
}

/// A profile with a key more, and one with a key fewer, name the key.
#[test]
fn a_key_that_a_profile_has_or_lacks_is_named() {
    use crate::flown::{FLIGHT, Recipe, mission_toml, write_log};
    let directory = tempfile::tempdir().unwrap();
    let whole = mission_toml();
    let more = whole.replacen("[start]", "[start]\nfuture_key = 1.0", 1);
    let fewer: String = whole.split_inclusive('\n').filter(|line| !line.starts_with("height_m")).collect();
    assert!(more != whole && fewer != whole);
    for (name, text, words) in
        [("more.mcap", more, "unknown field `future_key`"), ("fewer.mcap", fewer, "missing field `height_m`")]
    {
        let path = directory.path().join(name);
        let recipe = Recipe { profile_toml: Some(text), with_frames: false };
        std::fs::write(&path, write_log(&FLIGHT.frames, &recipe).bytes).unwrap();
        let (_, info, _) = run(&mut replay("info", &path));
        let (code, _, refly) = run(&mut replay("refly", &path));
        let (_, verify, _) = run(&mut replay("verify", &path));
        assert_eq!(code, 1);
        for said in [info, refly, verify] {
            assert!(said.contains(words), "{words} is not in {said}");
        }
    }
}
