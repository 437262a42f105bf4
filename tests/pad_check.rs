//! The check on the pad with the real processes: over UDP, signed, and in both logs.

use std::path::Path;

use e2e::{Bound, Program, Running, Signal, Terminal, keygen, program};

/// A large window: the page of the checks shows everything at once.
const SIZE: (u16, u16) = (100, 34);
/// Most attempts at an action that a busy machine may spoil.
const ATTEMPTS: usize = 4;

fn station(folder: &Path) -> Terminal {
    let mut command = program(Program::Ground);
    command
        .args(["--connect", "udpin:127.0.0.1:0", "--key", "flight.key", "--log", "ground.mcap"])
        .envs([("XDG_RUNTIME_DIR", folder), ("XDG_CONFIG_HOME", folder)])
        .env("TERM", "xterm-256color")
        .current_dir(folder);
    Terminal::start(&command, SIZE, false)
}

fn vehicle(folder: &Path, link: &str, more: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    command
        .args(["fly", "--mission", "mk2", "--stay", "--key", "flight.key", "--log", "vehicle.mcap"])
        .args(["--mavlink", link])
        .args(more)
        .current_dir(folder);
    Running::start(&mut command)
}

/// Types these keys until what they begin has this result; returns the screen with it. A busy
/// machine may spoil it: keys that are typed again stop a check, and a station that stands still
/// stops a test of the radio.
fn repeat_until(screen: &mut Terminal, keys: &[u8], [begun, result, spoiled]: [&str; 3]) -> Vec<String> {
    for _ in 0..ATTEMPTS {
        screen.type_until(keys, begun);
        let ended = screen.wait_until(result, |window| {
            let result = window.shows(result).then(|| Some(window.rows()));
            result.or_else(|| window.shows(spoiled).then_some(None))
        });
        if let Some(rows) = ended {
            return rows;
        }
    }
    panic!("{spoiled} {ATTEMPTS} times on:\n{}", screen.window().rows().join("\n"));
}

fn check(screen: &mut Terminal, result: &str) -> Vec<String> {
    repeat_until(screen, b"X\r", [" RUNS", result, "STOPPED early"])
}

fn end(mut screen: Terminal, vehicle: Running) {
    screen.signal(Signal::SIGTERM);
    screen.wait_for_end();
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

fn replay(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let ended = Running::to_end(program(Program::Replay).args(arguments).current_dir(folder));
    (ended.code, ended.output)
}

#[test]
fn a_crew_checks_its_vehicle_and_then_arms_it() {
    let folder = tempfile::tempdir().unwrap();
    keygen(folder.path(), "flight.key");
    let mut screen = station(folder.path());
    let link = format!("udpout:127.0.0.1:{}", screen.bound_port(Bound::Udp));
    let vehicle = vehicle(folder.path(), &link, &[]);
    screen.wait_for("every arming check passes");
    // While a check runs, an arming is refused, and ends the check. On a busy machine the check may
    // be over before the keys arrive, or they are typed again behind the refusal: then they arm.
    let was_refused = (0..ATTEMPTS).any(|_| {
        screen.type_until(b"X\r", "RUNS");
        screen.type_until(b"AARM\r", "ARM commanded");
        let is_refused = screen.wait_until("an answer to the arming", |window| {
            let refused = window.shows("ARM REFUSED by the vehicle") && window.shows("STOPPED early");
            (refused || window.shows(" ARMED ")).then_some(refused)
        });
        if !is_refused {
            screen.type_until(b"D\r", " disarmed ");
        }
        is_refused
    });
    assert!(was_refused, "{}", screen.window().rows().join("\n"));
    screen.type_until(b"6", "a check of the vehicle ran");
    check(&mut screen, "PASSED");
    for words in ["gimbal pitch", "fin 4", "gyro bias", "igniter wire", "log space"] {
        screen.wait_for(words);
    }
    repeat_until(&mut screen, b"U", ["RADIO RUNS", "RADIO PASSED", "RADIO STOPPED"]);
    screen.type_until(b"0AARM\r", " ARMED ");
    end(screen, vehicle);
    // The computer, given the recorded requests again, checks the same and finds the same.
    let (code, words) = replay(folder.path(), &["verify", "vehicle.mcap"]);
    assert_eq!(code, Some(0), "{words}");
    let (code, words) = replay(folder.path(), &["verify", "--book", "ground.mcap", "vehicle.mcap"]);
    assert_eq!(code, Some(0), "{words}");
}

/// A closed fin that is stuck closed agrees with its command: the arming checks pass.
#[test]
fn a_fin_that_is_stuck_closed_is_found_by_the_check_alone() {
    let folder = tempfile::tempdir().unwrap();
    keygen(folder.path(), "flight.key");
    let mut screen = station(folder.path());
    let link = format!("udpout:127.0.0.1:{}", screen.bound_port(Bound::Udp));
    let vehicle = vehicle(folder.path(), &link, &["--fault", "fin-stuck:1@pad+1"]);
    screen.wait_for("every arming check passes");
    let rows = check(&mut screen, "FAILED: 3 outside");
    let row = rows.iter().find(|row| row.contains(" fin 2 ")).unwrap();
    assert!(row.contains("NO 0.0, 87.7 deg"), "{row}");
    end(screen, vehicle);
}
