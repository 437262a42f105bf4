//! Other people's MAVLink clients against the real vehicle process.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use clients::{MAVSDK_GRPC, MAVSDK_NATIVE, NODE_MAVLINK, PYMAVLINK, PythonPackages, dialect, file};
use e2e::{
    Bound, Ended, Program, Running, SerialLine, Signal, keygen, program, raw_frames_of, unshared_address,
};

fn vehicle(folder: &Path, arguments: &[&str]) -> Running {
    let mut command = program(Program::OnboardSim);
    Running::start(
        command.args(["fly", "--stay", "--log", "flight.mcap"]).args(arguments).current_dir(folder),
    )
}

/// Generates our dialect beside pymavlink's, in every run, because the definitions may have
/// changed.
static DIALECT: LazyLock<()> = LazyLock::new(|| {
    let place = Running::to_end(
        PYMAVLINK.python().args(["-c", "import pymavlink.dialects.v20 as d; print(d.__path__[0])"]),
    );
    let place = Path::new(&place.output);
    let folder = tempfile::tempdir_in(place).unwrap();
    let made = folder.path().join("touchdown.py");
    let mut generator = PYMAVLINK.program("mavgen.py");
    generator.args(["--lang", "Python3", "--wire-protocol", "2.0", "-o"]).arg(&made).arg(dialect());
    let generated = Running::to_end(&mut generator);
    assert_eq!(generated.code, Some(0), "{}", generated.output);
    // The rename is atomic, because another run may be reading the file.
    std::fs::rename(&made, place.join("touchdown.py")).unwrap();
});

fn pymavlink(name: &str) -> Command {
    LazyLock::force(&DIALECT);
    script(&PYMAVLINK, name)
}

fn script(packages: &PythonPackages, name: &str) -> Command {
    let mut command = packages.python();
    command.arg(file(name));
    command
}

fn expect_success(ended: &Ended) {
    assert_eq!(ended.code, Some(0), "{}", ended.output);
    assert!(ended.output.contains("ALL OK"), "{}", ended.output);
}

/// Runs a client that sends first to a listening vehicle.
fn run_client_that_sends_first(client: &mut Command) {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = vehicle(folder.path(), &["--mavlink", "udpin:127.0.0.1:0"]);
    expect_success(&Running::to_end(client.arg(vehicle.bound_port(Bound::Udp).to_string())));
}

/// Runs a client that listens, to which a vehicle sends first.
fn run_client_that_listens(client: &mut Command) {
    let folder = tempfile::tempdir().unwrap();
    let address = unshared_address();
    let client = Running::start(client.arg(address.to_string()));
    let _vehicle = vehicle(folder.path(), &["--mavlink", &format!("udpout:{address}")]);
    expect_success(&client.wait());
}

#[test]
fn val_pymavlink_receives_the_answers_of_the_standard() {
    run_client_that_sends_first(&mut pymavlink("pymavlink_client.py"));
}

/// The client connects over UDP, and then over a serial radio.
#[test]
fn val_pymavlink_flies_a_rocket_and_aborts_its_descent() {
    let line = SerialLine::new(57_600);
    let serial = line.near_link();
    for link in ["udpin:127.0.0.1:0", &serial] {
        let folder = tempfile::tempdir().unwrap();
        let mut vehicle = vehicle(folder.path(), &["--mission", "mk2", "--mavlink", link]);
        let mut client = pymavlink("pymavlink_rocket.py");
        if link == serial {
            client.arg(&line.far).arg("57600");
        } else {
            client.arg(vehicle.bound_port(Bound::Udp).to_string());
        }
        expect_success(&Running::to_end(&mut client));
        vehicle.signal(Signal::SIGTERM);
        let flight = vehicle.wait();
        assert_eq!(flight.code, Some(4), "{link}: {}", flight.output);
        assert!(flight.output.contains("parachute deployed"), "{link}: {}", flight.output);
    }
}

#[test]
fn val_pymavlink_two_grounds_are_each_answered_for_themselves() {
    run_client_that_sends_first(&mut pymavlink("two_grounds.py"));
}

#[test]
fn val_mavsdk_native_finds_reads_arms_and_terminates() {
    run_client_that_listens(&mut script(&MAVSDK_NATIVE, "mavsdk_native.py"));
}

#[test]
fn val_mavsdk_with_its_server_finds_reads_arms_and_terminates() {
    run_client_that_sends_first(&mut script(&MAVSDK_GRPC, "mavsdk_grpc.py"));
}

#[test]
fn val_node_mavlink_reads_arms_and_terminates() {
    run_client_that_listens(NODE_MAVLINK.node().arg(file("node_client.mjs")));
}

/// The vehicle accepts what pymavlink signs and rejects what is unsigned or wrongly signed, also
/// after a restart.
#[test]
fn val_pymavlink_signatures_are_required_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("flight.key");
    let made = keygen(folder.path(), "flight.key");
    assert_eq!(made.code, Some(0), "{}", made.output);
    for further in [None, Some("restarted")] {
        let log = if further.is_some() { "second.mcap" } else { "first.mcap" };
        let mut command = program(Program::OnboardSim);
        command.args([
            "fly",
            "--stay",
            "--mavlink",
            "udpin:127.0.0.1:0",
            "--log",
            log,
            "--key",
            "flight.key",
        ]);
        let mut vehicle = Running::start(command.current_dir(folder.path()));
        let port = vehicle.bound_port(Bound::Udp).to_string();
        let mut client = pymavlink("signed_client.py");
        expect_success(&Running::to_end(client.arg(port).arg(&key).args(further)));
        vehicle.signal(Signal::SIGTERM);
        vehicle.wait();
        assert!(
            raw_frames_of(&folder.path().join(log), "tx").iter().all(|frame| frame[2] == 0),
            "the log contains signatures"
        );
    }
}

/// The test types commands into MAVProxy's standard input as an operator would.
#[test]
fn val_mavproxy_shows_arms_and_terminates() {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = vehicle(folder.path(), &["--mavlink", "udpin:127.0.0.1:0"]);
    let link = vehicle.udp_link();
    vehicle.wait_for_line("PAD_IDLE");
    let mut command = PYMAVLINK.program("mavproxy.py");
    command
        .args(["--master", &link, "--source-system", "255"])
        .args(["--source-component", "190", "--nodtr", "--mav20", "--state-basedir", "."])
        .env("HOME", folder.path())
        .current_dir(folder.path());
    let (mut operator, mut proxy) = Running::start_with_input(&mut command);
    let types = |operator: &mut std::process::ChildStdin, words: &str| {
        writeln!(operator, "{words}").and_then(|()| operator.flush()).unwrap();
    };
    // If the file request were not declined, MAVProxy would take about 11 s more.
    proxy.wait_for_line("Received 34 parameters");
    types(&mut operator, "param show NMPC_W_THETA");
    let shown = proxy.wait_for_line("NMPC_W_THETA");
    assert!(shown.contains("200"), "{shown}");
    types(&mut operator, "param set RATE_FINS 1");
    // MAVProxy sets parameters in the background, so the test asks until the vehicle's answer has
    // arrived.
    let is_set = (0..1_000).any(|_| {
        types(&mut operator, "param show RATE_FINS");
        proxy.wait_for_line("RATE_FINS").contains("1.0")
    });
    assert!(is_set, "the rate was not set");
    types(&mut operator, "long 300 0");
    proxy.wait_for_line("MISSION_START: DENIED");
    proxy.wait_for_line("start refused: cannot start in PAD_IDLE");
    types(&mut operator, "arm throttle");
    // This is what HEARTBEAT says, not what was acknowledged.
    proxy.wait_for_line("ARMED");
    types(&mut operator, "disarm");
    proxy.wait_for_line("DISARMED");
    types(&mut operator, "long 185 1");
    proxy.wait_for_line("DO_FLIGHTTERMINATION: ACCEPTED");
    types(&mut operator, "arm throttle force");
    proxy.wait_for_line("refused");
    drop(operator);
    drop(proxy);
    vehicle.signal(Signal::SIGTERM);
    let ended = vehicle.wait();
    assert_eq!(ended.code, Some(4), "{}", ended.output);
}
