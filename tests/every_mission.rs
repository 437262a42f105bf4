//! The ground station shows a recorded flight of every mission.

use std::path::Path;

use e2e::{Program, Running, program};
use flight::vehicles::mission::BUILTIN;

#[path = "../onboard-sim/flight/tests/missions/mod.rs"]
mod missions;

use self::missions::TEST_MISSIONS;

/// Flies a mission by itself, with telemetry without a receiver, and shows its log. Of the second
/// seed, in which all stand.
fn shown(folder: &Path, mission: &str, text: &str) {
    let (log, file) = (format!("{mission}.mcap"), format!("{mission}.toml"));
    std::fs::write(folder.join(&file), text).expect("the file of the mission");
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--mission", &file, "--seed", "2", "--auto", "--speed", "max"]);
    fly.args(["--mavlink", "udpout:127.0.0.1:9"]);
    let flown = Running::to_end(fly.args(["--log", &log]).current_dir(folder));
    assert_eq!(flown.code, Some(0), "{mission}: {}", flown.output);
    let mut ground = program(Program::Ground);
    let shown = Running::to_end(ground.args(["--replay", &log, "--headless"]).current_dir(folder));
    assert_eq!(shown.code, Some(0), "{mission}: {}", shown.output);
    let moments =
        ["countdown started", "landing motor commanded to light", "ground contact", "STANDS UNDAMAGED"];
    let places: Vec<_> = moments.iter().map(|moment| shown.output.find(moment)).collect();
    assert!(places.is_sorted() && places[0].is_some(), "{mission}: {}", shown.output);
    for never in ["NaN", "plane", "ABORT", "panicked"] {
        assert!(!shown.output.contains(never), "{mission}: {never}: {}", shown.output);
    }
}

#[test]
fn the_ground_station_shows_a_flight_of_every_mission() {
    let folder = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for (mission, text) in BUILTIN.iter().chain(&TEST_MISSIONS) {
            scope.spawn(|| shown(folder.path(), mission, text));
        }
    });
}
