//! Vehicle and ground as two processes, over UDP and over a serial line.

use std::io::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use e2e::{
    ABORT, ARM, Program, Running, START, SerialLine, auto_ground, command_frame, expect_identical_replay,
    expect_landing, heartbeat_frame, last_time_s, program, vehicle,
};
use protocol::frame::Encoder;
use protocol::identity::GROUND;

#[test]
fn over_udp_they_land_and_the_log_of_the_vehicle_replays() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = Running::start(&mut auto_ground(folder.path(), &["udpin:127.0.0.1:0"]));
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&ground.udp_link()]));
    expect_landing(vehicle, ground);
    expect_identical_replay(folder.path(), "vehicle.mcap");
    // The ground's log has no controller ticks, and `replay verify` says so.
    let mut verify = program(Program::Replay);
    let telemetry_only = Running::to_end(verify.args(["verify", "ground.mcap"]).current_dir(folder.path()));
    assert_eq!(telemetry_only.code, Some(5), "{}", telemetry_only.output);
}

#[test]
fn over_a_serial_radio_they_land_within_its_budget() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::new(57_600);
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&line.near_link()]));
    let ground = Running::start(&mut auto_ground(folder.path(), &[&line.far_link()]));
    let (vehicle, _) = expect_landing(vehicle, ground);
    expect_identical_replay(folder.path(), "vehicle.mcap");

    let [down, up] = line.carried();
    let seconds = last_time_s(&vehicle.output);
    assert!(seconds > 10.0, "{}", vehicle.output);
    let (down_s, up_s) = (down as f64 / seconds, up as f64 / seconds);
    println!("serial line at 57600 baud: {down_s:.0} B/s down, {up_s:.0} B/s up over {seconds:.1} s");
    assert!((500.0..=2_000.0).contains(&down_s), "{down_s} B/s down");
    assert!(up_s < 500.0, "{up_s} B/s up");
}

/// An abort reaches the vehicle even if the line no longer takes the vehicle's bytes.
#[test]
fn an_abort_is_received_while_the_line_takes_no_bytes_of_the_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::that_takes_nothing_from_near(57_600);
    let mut flight = Running::start(&mut vehicle(folder.path(), &[&line.near_link()]));
    let mut radio = std::fs::File::options().write(true).open(&line.far).unwrap();
    let station = HeartbeatSender::on(radio.try_clone().unwrap());
    let mut encoder = Encoder::new(GROUND);
    let mut command = |command, param1| {
        radio.write_all(command_frame(&mut encoder, command, param1).as_bytes()).unwrap();
    };
    // Its heartbeats come with an arming, which is refused until the landing is rehearsed.
    flight.wait_for_line("PAD_ARMED");
    command(START, 0.0);
    // By the end of the countdown the vehicle has sent more bytes than the terminal's buffer holds.
    flight.wait_for_line("to POWERED");
    drop(station);
    command(ABORT, 1.0);
    let before_burn_out = flight.wait_for_line("no cut-off exists");
    assert!(before_burn_out.contains("ABORT"), "{before_burn_out}");
    let ended = flight.wait();
    assert_eq!(ended.code, Some(4), "{}", ended.output);
    let at =
        |words: &str| ended.output.find(words).unwrap_or_else(|| panic!("no {words} in {}", ended.output));
    assert!(at("no cut-off exists") < at("burn-out"), "{}", ended.output);
}

/// Sends a ground station's heartbeat and an arming ten times a second until it is dropped.
struct HeartbeatSender(Arc<AtomicBool>);

impl HeartbeatSender {
    fn on(mut radio: std::fs::File) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        std::thread::Builder::new()
            .name("heartbeats".to_owned())
            .spawn(move || {
                let mut encoder = Encoder::new(GROUND);
                while !ends.load(Ordering::Relaxed)
                    && radio.write_all(heartbeat_frame(&mut encoder, 0).as_bytes()).is_ok()
                    && radio.write_all(command_frame(&mut encoder, ARM, 1.0).as_bytes()).is_ok()
                {
                    std::thread::sleep(Duration::from_millis(100));
                }
            })
            .expect("a thread");
        Self(over)
    }
}

impl Drop for HeartbeatSender {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn both_report_a_flight_that_misses_its_limits() {
    let folder = tempfile::tempdir().unwrap();
    let mut station = Running::start(&mut auto_ground(folder.path(), &["udpin:127.0.0.1:0"]));
    let mut weak = vehicle(folder.path(), &[&station.udp_link()]);
    let flight = Running::start(weak.args(["--fault", "weak-motor:0.75@0"]));
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!(station.code, Some(3), "{}", station.output);
    assert_eq!(flight.code, Some(3), "{}", flight.output);
    assert!(
        flight.output.contains("NOT LANDED") && station.output.contains("HARD LANDING: not upright"),
        "{}",
        station.output
    );
}
