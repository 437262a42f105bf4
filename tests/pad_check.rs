//! The check on the pad with the real processes: over UDP, signed, and in both logs.

use std::path::Path;

use e2e::{Bound, Program, Running, Signal, Terminal, keygen, program};

/// A large window: the page of the checks shows everything at once.
const SIZE: (u16, u16) = (100, 34);

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
    screen.type_until(b"X\r", "RUNS");
    // Meanwhile an arming is refused, and ends the check. It is not typed again behind the refusal:
    // then it would arm.
    screen.type_until(b"AARM\r", "ARM REFUSED by the vehicle");
    screen.wait_for("STOPPED early");
    screen.type_until(b"6", "a check of the vehicle ran");
    screen.type_until(b"X\r", "CHECK 2 RUNS");
    screen.wait_for("CHECK 2 PASSED");
    for words in ["gimbal pitch", "fin 4", "gyro bias", "igniter wire", "log space"] {
        screen.wait_for(words);
    }
    screen.type_until(b"U", "RADIO RUNS");
    screen.wait_for("RADIO PASSED");
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
    screen.type_until(b"X\r", "RUNS");
    screen.wait_for("FAILED: 3 outside");
    let row = screen.wait_for(" fin 2 ");
    assert!(row.contains("NO 0.0, 87.7 deg"), "{row}");
    end(screen, vehicle);
}
