//! Tests small questions that used to be answered badly.

use std::io::Write as _;
use std::process::Stdio;

use replay::log::Recording;

use crate::command_line::{replay, run};
use crate::from_apogee::LANDED;
use crate::simulated::{DISPERSED, MK2};

#[test]
fn another_seed_is_named_in_the_answer_and_in_the_log() {
    let path = DISPERSED.beside("seed.mcap");
    let (code, stdout, stderr) =
        run(replay("refly", &DISPERSED.log).args(["--seed", "77", "--log"]).arg(&path));
    assert!(
        code == 0 && stdout.contains("plant drawn with seed 77 instead of the recorded one"),
        "{stdout}{stderr}"
    );
    let run_facts = Recording::open(&path).unwrap().head.run;
    assert_eq!(run_facts["seed"], "77");
    assert_eq!(run_facts["reflown_instead_of_seed"], "2");
}

#[test]
fn a_setting_after_the_end_of_the_flight_is_refused() {
    for (log, setting) in
        [(&MK2.log, "powered.weights.theta=90@600"), (&LANDED.log, "powered.weights.theta=9@600")]
    {
        let (code, stdout, stderr) = run(replay("evaluate", log).args(["--set", setting]));
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(stderr.contains("takes effect after the end of"), "{stderr}");
        assert!(stderr.contains("whose last frame is at T+"), "{stderr}");
    }
}

#[test]
fn info_takes_several_logs_and_standard_input() {
    let (code, stdout, _) = run(replay("info", &MK2.log).arg(&LANDED.log));
    assert!(code == 0 && stdout.matches("grade ").count() == 2, "{stdout}");
    let (code, stdout, stderr) = run(replay("info", &MK2.log).arg(MK2.beside("none.mcap")));
    assert!(
        code == 2 && stdout.contains("grade ") && stderr.contains("none.mcap: cannot be read"),
        "{stderr}"
    );
    let mut child =
        replay("info", "-".as_ref()).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(&std::fs::read(&MK2.log).unwrap()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success() && text.starts_with("standard input\n") && text.contains("bit-exact"),
        "{text}"
    );
}

/// A message and its cause do not repeat each other.
#[test]
fn no_message_is_printed_twice() {
    let none = MK2.beside("none.mcap");
    let mut unknown = replay("refly", &MK2.log);
    unknown.args(["--set", "powered.wights.theta=80"]);
    for mut command in [replay("info", &none), replay("verify", &none), replay("report", &none), unknown] {
        let (code, stdout, stderr) = run(&mut command);
        assert!(code == 2, "{stdout}{stderr}");
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
        assert_eq!(code, 2);
        for said in [info, refly, verify] {
            assert!(said.contains(words), "{words} is not in {said}");
        }
    }
}
