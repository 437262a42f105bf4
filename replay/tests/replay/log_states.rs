//! Every command on every state of a log, by one rule: it uses the messages outside of the damage,
//! names the damage once, and needs little memory.

use std::process::Command;

use e2e::{LogState, log_states};
use rayon::prelude::*;

use crate::flown::COMPLETE;

/// Memory that a command may use, kB: a log is streamed.
const DATA_MAX_KB: u32 = 64 << 10;

/// Exit codes (`replay --help`).
const YES: i32 = 0;
const ERROR: i32 = 1;
const NO: i32 = 3;
const NOT_SEEN: i32 = 5;

/// A command, `@` is where it writes, and its exit codes for an intact and for a damaged log.
const COMMANDS: [(&[&str], i32, i32); 12] = [
    (&["info"], YES, YES),
    (&["info", "--again"], YES, YES),
    (&["verify"], YES, YES),
    // The verdict of the short flight is invented, and the flight that is flown again has another.
    (&["verify", "--strict"], NO, NO),
    (&["evaluate"], YES, YES),
    (&["refly", "--at", "frame:1"], YES, YES),
    (&["compare", "INTACT"], YES, NO),
    (&["report", "--out", "@.html"], YES, YES),
    (&["export", "--out", "@"], YES, YES),
    (&["export", "--out", "@.kml"], YES, YES),
    (&["export", "--out", "@.gpx"], YES, YES),
    (&["fit"], YES, YES),
];

/// Runs a command with little memory: exit code, standard output, standard error.
fn within(arguments: &[&str]) -> (Option<i32>, String, String) {
    let limited = format!("ulimit -d {DATA_MAX_KB}; exec \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &limited, "sh", env!("CARGO_BIN_EXE_replay")])
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Messages that a log has by `info`; 0 if it has no answer.
fn messages_of(log: &str) -> u64 {
    let (_, stdout, _) = within(&["info", "--json", log]);
    let info = serde_json::from_str(&stdout).unwrap_or(serde_json::Value::Null);
    let channels = info["channels"].as_array().into_iter().flatten();
    channels.map(|channel| channel["messages"].as_u64().unwrap()).sum()
}

#[test]
fn every_command_answers_every_state_of_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let intact = path("intact.mcap");
    std::fs::write(&intact, &COMPLETE.bytes).unwrap();
    let states = log_states(&COMPLETE.bytes);
    let all = states[0].before;
    let wrong: Vec<String> = states
        .into_par_iter()
        .enumerate()
        .flat_map_iter(|(number, state)| {
            let log = path(&format!("{number}.mcap"));
            std::fs::write(&log, &state.bytes).unwrap();
            // It is used up to the damage, or beyond it.
            let used = messages_of(&log);
            let mut wrong = Vec::new();
            if !(state.before..=state.outside).contains(&used) {
                wrong.push(format!("{}: {used} messages used of {}", state.name, state.before));
            }
            let has_gap = state.before < used && used == state.outside && used < all;
            for (command, of_intact, of_damaged) in COMMANDS {
                let written = path(&format!("{number}-written"));
                let arguments: Vec<String> = command
                    .iter()
                    .map(|argument| argument.replace('@', &written).replace("INTACT", &intact))
                    .chain([log.clone()])
                    .collect();
                let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
                let (code, stdout, stderr) = within(&arguments);
                let expected = match command[0] {
                    _ if used == 0 => ERROR,
                    _ if state.is_intact => of_intact,
                    "verify" if has_gap => NOT_SEEN,
                    _ => of_damaged,
                };
                let is_named = match expected {
                    ERROR => stderr.contains(&log),
                    _ => stderr.matches(" is damaged: ").count() == usize::from(!state.is_intact),
                };
                if code != Some(expected) || !is_named || format!("{stdout}{stderr}").contains("os error") {
                    wrong.push(format!("{}, {command:?}: {code:?}, not {expected}: {stderr}", state.name));
                }
            }
            recovers(&state, &log, &path(&format!("{number}-recovered.mcap")), &mut wrong);
            wrong
        })
        .collect();
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// A recovered log has every message outside of the damage.
fn recovers(state: &LogState, log: &str, output: &str, wrong: &mut Vec<String>) {
    let (code, stdout, stderr) = within(&["recover", log, output]);
    let expected = if state.outside == 0 { ERROR } else { YES };
    let names_damage = stdout.contains("DAMAGED") != state.is_intact;
    let has = if expected == YES && code == Some(YES) { messages_of(output) } else { 0 };
    if code != Some(expected) || (expected == YES && !names_damage) || has != state.outside {
        wrong.push(format!(
            "{}, recover: {code:?}, {has} of {} messages: {stdout}{stderr}",
            state.name, state.outside
        ));
    }
}
