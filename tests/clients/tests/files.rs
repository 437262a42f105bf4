//! The vehicle's log, fetched with other people's clients.

use std::io::Write as _;
use std::process::Command;

use clients::{MAVSDK_NATIVE, PYMAVLINK, PythonPackages, file};
use e2e::{Bound, Running, Signal, expect_identical_replay, landed_vehicle, unshared_address};

/// A short log: the landing alone.
const PROFILE: &str = "mk2";

fn script(packages: &PythonPackages, name: &str) -> Command {
    let mut command = packages.python();
    command.arg(file(name));
    command
}

#[test]
fn val_pymavlink_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut vehicle = landed_vehicle(on_board.path(), PROFILE, "udpin:127.0.0.1:0", &[]);
    let log = on_ground.path().join("fetched.mcap");
    let mut client = script(&PYMAVLINK, "files_pymavlink.py");
    let ended = Running::to_end(client.arg(vehicle.bound_port(Bound::Udp).to_string()).arg(&log));
    assert!(ended.code == Some(0) && ended.output.contains("ALL OK"), "{}", ended.output);
    expect_identical_replay(on_ground.path(), "fetched.mcap");
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

#[test]
fn val_mavsdk_native_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let address = unshared_address();
    let mut client = script(&MAVSDK_NATIVE, "files_mavsdk.py");
    let client = Running::start(client.arg(address.to_string()).arg(on_ground.path()));
    let vehicle = landed_vehicle(on_board.path(), PROFILE, &format!("udpout:{address}"), &[]);
    let ended = client.wait();
    assert!(ended.code == Some(0) && ended.output.contains("ALL OK"), "{}", ended.output);
    expect_identical_replay(on_ground.path(), "flight.mcap");
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}

#[test]
fn val_mavproxy_fetches_the_log() {
    let (on_board, on_ground) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut vehicle = landed_vehicle(on_board.path(), PROFILE, "udpin:127.0.0.1:0", &[]);
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
    expect_identical_replay(on_ground.path(), "fetched.mcap");
    drop(operator);
    drop(proxy);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}
