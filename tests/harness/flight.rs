//! Starts a vehicle and a ground station, and checks that they land and that their log replays.

use std::path::Path;
use std::process::Command;

use crate::{Ended, Program, Running, program};

/// `onboard-sim fly` over these links, which logs to `vehicle.mcap` in this folder.
pub fn vehicle(folder: &Path, links: &[&str]) -> Command {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--log", "vehicle.mcap"]).current_dir(folder);
    command.args(links.iter().flat_map(|link| ["--mavlink", link]));
    command
}

/// A ground station without a screen that arms and starts by itself over these links, and logs to
/// `ground.mcap` in this folder.
pub fn auto_ground(folder: &Path, links: &[&str]) -> Command {
    let mut command = program(Program::Ground);
    command.args(["--headless", "--auto", "--log", "ground.mcap"]).current_dir(folder);
    command.args(links.iter().flat_map(|link| ["--connect", link]));
    command
}

/// A vehicle that has flown a profile by itself over one link, is safe on the ground, and stays. It
/// logs to `flight.mcap` in this folder, and its simulated time runs so fast that its motor is cold
/// after seconds, and so slowly that a client may be silent for some before its files are closed (a
/// minute of the vehicle).
pub fn landed_vehicle(folder: &Path, profile: &str, link: &str, more: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--mission", profile, "--seed", "1", "--auto", "--stay", "--speed", "5"]);
    command.args(["--network-budget", "40000", "--log", "flight.mcap", "--mavlink", link]);
    let mut vehicle = Running::start(command.args(more).current_dir(folder));
    vehicle.wait_for_line("TOUCHDOWN to SAFED");
    vehicle
}

/// Waits until both have ended and expects that both report a landing.
pub fn expect_landing(vehicle: Running, ground: Running) -> (Ended, Ended) {
    let ground = ground.wait();
    // A vehicle whose station has failed may wait for the next one.
    assert_eq!(ground.code, Some(0), "{}", ground.output);
    let vehicle = vehicle.wait();
    assert_eq!(vehicle.code, Some(0), "{}\n{}", ground.output, vehicle.output);
    (vehicle, ground)
}

/// Replays a log in this folder and expects the same bits at every controller tick.
pub fn expect_identical_replay(folder: &Path, log: &str) {
    let verified = Running::to_end(program(Program::Replay).args(["verify", log]).current_dir(folder));
    assert_eq!(verified.code, Some(0), "{}", verified.output);
    assert!(verified.output.contains("frames identical"), "{}", verified.output);
}

/// The time at the end of a vehicle's output, s.
pub fn last_time_s(output: &str) -> f64 {
    let times = output.lines().filter_map(|line| line.trim_start().split_once(" s  ")?.0.trim().parse().ok());
    times.fold(0.0, f64::max)
}
