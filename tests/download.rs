//! The vehicle's own log, fetched by the ground over real links: whole, checked, never overwritten,
//! and not in flight.

use std::path::{Path, PathBuf};
use std::process::Command;

use e2e::{
    ABORT, ACCEPTED, BareGround, Bound, Program, Running, SerialLine, Signal, expect_identical_replay,
    keygen, landed_vehicle, program, vehicle,
};
use protocol::dialect::TdPhase;

fn download(folder: &Path, link: &str) -> Command {
    let mut command = program(Program::Ground);
    command.args(["download", "--connect", link, "--out", "."]).current_dir(folder);
    command
}

#[test]
fn the_log_of_a_landed_vehicle_is_fetched_over_signed_udp_and_replays_bit_for_bit() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    keygen(on_board.path(), "flight.key");
    let key = on_board.path().join("flight.key").display().to_string();
    let mut vehicle = landed_vehicle(on_board.path(), "mk2", "udpin:127.0.0.1:0", &["--key", &key]);
    let link = format!("udpout:127.0.0.1:{}", vehicle.bound_port(Bound::Udp));
    let fetched = Running::to_end(download(on_ground.path(), &link).args(["--key", &key]));
    assert_eq!(fetched.code, Some(0), "{}", fetched.output);
    let log = on_ground.path().join("vehicle1-flight.mcap");
    assert!(fetched.output.contains("log ./vehicle1-flight.mcap"), "{}", fetched.output);
    let there: Vec<_> =
        std::fs::read_dir(on_ground.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(there, std::slice::from_ref(&log), "nothing else is left");
    expect_identical_replay(on_ground.path(), "vehicle1-flight.mcap");
    // All of the flight is in it: recording went on behind it, so the log on board has it as its
    // beginning.
    let (fetched_bytes, kept_bytes) =
        (std::fs::read(&log).unwrap(), std::fs::read(on_board.path().join("flight.mcap")).unwrap());
    let common = fetched_bytes.iter().zip(&kept_bytes).take_while(|(fetched, kept)| fetched == kept).count();
    assert!(fetched_bytes.len() - common < 100, "{common} of {} bytes", fetched_bytes.len());
    let again = Running::to_end(download(on_ground.path(), &link).args(["--key", &key]));
    assert_eq!(again.code, Some(1), "{}", again.output);
    assert!(again.output.contains("is this log already"), "{}", again.output);
    assert!(std::fs::read(&log).unwrap() == fetched_bytes);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

#[test]
fn the_log_is_refused_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--mission", "mk2", "--auto", "--stay", "--speed", "0.2"]);
    command.args(["--log", "flight.mcap", "--mavlink", "udpin:127.0.0.1:0"]).current_dir(folder.path());
    let mut vehicle = Running::start(&mut command);
    let link = format!("udpout:127.0.0.1:{}", vehicle.bound_port(Bound::Udp));
    vehicle.wait_for_line("to AERO_DESCENT");
    let refused = Running::to_end(&mut download(folder.path(), &link));
    assert_eq!(refused.code, Some(1), "{}", refused.output);
    assert!(refused.output.contains("it is armed or in flight"), "{}", refused.output);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

/// A vehicle that was aborted on its pad gives out its log over a radio of 57,600 baud. The ground
/// is killed on the way, and begins again with what it has.
#[test]
fn a_download_over_a_serial_line_goes_on_after_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::new(57_600);
    let mut ground = BareGround::new();
    let links = [ground.link(), line.near_link()];
    let vehicle = Running::start(vehicle(folder.path(), &[&links[0], &links[1]]).args([
        "--stay",
        "--serial-budget",
        "5760",
    ]));
    ground.wait_until_ready();
    ground.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE);
    assert_eq!(ground.command(ABORT, 1.0), ACCEPTED);
    let mut killed = Running::start(&mut download(folder.path(), &line.far_link()));
    let is_beginning = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "part");
    let beginning = || {
        let paths = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        paths.filter(is_beginning).map(|path| std::fs::metadata(path).unwrap().len()).next()
    };
    // The beginning, and three tenths.
    for _ in 0..4 {
        killed.wait_for_line("log vehicle.mcap: ");
    }
    killed.signal(Signal::SIGKILL);
    killed.wait();
    let kept = beginning().unwrap();
    let fetched = Running::to_end(&mut download(folder.path(), &line.far_link()));
    assert_eq!(fetched.code, Some(0), "{}", fetched.output);
    let log = folder.path().join("vehicle1-vehicle.mcap");
    let len = std::fs::metadata(&log).unwrap().len();
    // Its first report has what was kept.
    let reports = fetched.output.split("log vehicle.mcap: ").nth(1).unwrap();
    let first_mb: f64 = reports.split(' ').next().unwrap().parse().unwrap();
    println!("{len} bytes, {kept} of them kept; it went on at {first_mb} MB");
    assert!(kept >= len / 4 && first_mb * 1e6 > kept as f64 - 5e3, "it began again");
    assert_eq!(beginning(), None);
    expect_identical_replay(folder.path(), "vehicle1-vehicle.mcap");
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}
