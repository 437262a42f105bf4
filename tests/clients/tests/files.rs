//! The vehicle's log, fetched with other people's clients.

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use clients::{MAVSDK_NATIVE, PYMAVLINK, PythonPackages, file};
use e2e::{Bound, Program, Running, Signal, program, unshared_address};

/// A vehicle that has flown by itself and is safe on the ground.
fn landed_vehicle(folder: &Path, link: &str) -> Running {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--profile", "paper-calibrated", "--auto-start", "--stay", "--speed", "20"]);
    command
        .args(["--network-budget", "20000", "--log", "flight.mcap", "--mavlink", link])
        .current_dir(folder);
    let mut vehicle = Running::start(&mut command);
    vehicle.wait_for_line("TOUCHDOWN to SAFED");
    vehicle
}

fn script(packages: &PythonPackages, name: &str) -> Command {
    let mut command = packages.python();
    command.arg(file(name));
    command
}

/// The fetched log replays bit for bit.
fn expect_identical(log: &Path) {
    let verified = Running::to_end(program(Program::Replay).arg("verify").arg(log));
    assert_eq!(verified.code, Some(0), "{}", verified.output);
    assert!(verified.output.contains("identical"), "{}", verified.output);
}

#[test]
fn val_pymavlink_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut vehicle = landed_vehicle(on_board.path(), "udpin:127.0.0.1:0");
    let log = on_ground.path().join("fetched.mcap");
    let mut client = script(&PYMAVLINK, "files_pymavlink.py");
    let ended = Running::to_end(client.arg(vehicle.bound_port(Bound::Udp).to_string()).arg(&log));
    assert!(ended.code == Some(0) && ended.output.contains("ALL OK"), "{}", ended.output);
    expect_identical(&log);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

#[test]
fn val_mavsdk_native_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let address = unshared_address();
    let mut client = script(&MAVSDK_NATIVE, "files_mavsdk.py");
    let client = Running::start(client.arg(address.to_string()).arg(on_ground.path()));
    let vehicle = landed_vehicle(on_board.path(), &format!("udpout:{address}"));
    let ended = client.wait();
    assert!(ended.code == Some(0) && ended.output.contains("ALL OK"), "{}", ended.output);
    expect_identical(&on_ground.path().join("flight.mcap"));
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

#[test]
fn val_mavproxy_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut vehicle = landed_vehicle(on_board.path(), "udpin:127.0.0.1:0");
    let link = vehicle.udp_link();
    let mut command = PYMAVLINK.program("mavproxy.py");
    command
        .args(["--master", &link, "--source-system", "255"])
        .args(["--source-component", "190", "--nodtr", "--mav20", "--state-basedir", "."])
        .env("HOME", on_ground.path())
        .current_dir(on_ground.path());
    let (mut operator, mut proxy) = Running::start_with_input(&mut command);
    proxy.wait_for_line("parameters");
    writeln!(operator, "ftp get /log/flight.mcap fetched.mcap").and_then(|()| operator.flush()).unwrap();
    proxy.wait_for_line("Wrote ");
    expect_identical(&on_ground.path().join("fetched.mcap"));
    drop(operator);
    drop(proxy);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}
