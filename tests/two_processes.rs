//! Vehicle and ground as processes of their own, over UDP and over a serial line.

use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use e2e::{Bound, Ended, Program, Running, SerialLine, command_frame, heartbeat_frame, program};
use protocol::dialect::MavCmd;
use protocol::frame::Encoder;
use protocol::identity::GROUND;

fn vehicle(folder: &Path, link: &str) -> Command {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--mavlink", link, "--log", "vehicle.mcap"]).current_dir(folder);
    command
}

fn ground(folder: &Path, link: &str) -> Command {
    let mut command = program(Program::Ground);
    command.args(["--connect", link, "--headless", "--auto", "--log", "ground.mcap"]).current_dir(folder);
    command
}

fn verified(folder: &Path) -> Ended {
    Running::to_end(program(Program::Replay).args(["verify", "vehicle.mcap"]).current_dir(folder))
}

#[test]
fn over_udp_they_land_and_the_vehicle_s_log_replays() {
    let folder = tempfile::tempdir().unwrap();
    let mut station = Running::start(&mut ground(folder.path(), "udpin:127.0.0.1:0"));
    let link = format!("udpout:127.0.0.1:{}", station.bound_port(Bound::Udp));
    let flight = Running::start(&mut vehicle(folder.path(), &link));
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!(station.code, Some(0), "{}", station.output);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    let verified = verified(folder.path());
    assert_eq!(verified.code, Some(0), "{}", verified.output);
    // The ground's log has no controller ticks and says so.
    let telemetry_only =
        Running::to_end(program(Program::Replay).arg("verify").arg(folder.path().join("ground.mcap")));
    assert_eq!(telemetry_only.code, Some(2), "{}", telemetry_only.output);
}

#[test]
fn over_a_radio_s_serial_line_they_land_within_its_budget() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::new(57_600);
    let link = |device: &Path| format!("serial:{}:57600", device.display());
    let flight = Running::start(&mut vehicle(folder.path(), &link(&line.near)));
    let station = Running::start(&mut ground(folder.path(), &link(&line.far)));
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!(station.code, Some(0), "{}", station.output);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    let verified = verified(folder.path());
    assert_eq!(verified.code, Some(0), "{}", verified.output);

    let [down, up] = line.carried();
    // Vehicle time is real time here; the last line before the summary carries it.
    let seconds = flight
        .output
        .lines()
        .filter_map(|line| {
            line.trim_start().split_once(" s  ").and_then(|(time, _)| time.trim().parse::<f64>().ok())
        })
        .fold(0.0, f64::max);
    assert!(seconds > 10.0, "{}", flight.output);
    let (down_s, up_s) = (down as f64 / seconds, up as f64 / seconds);
    println!("serial line at 57600 baud: {down_s:.0} B/s down, {up_s:.0} B/s up over {seconds:.1} s");
    assert!((500.0..=2_000.0).contains(&down_s), "{down_s} B/s down");
    assert!(up_s < 500.0, "{up_s} B/s up");
}

/// A line that has stopped taking what the vehicle says still carries an abort to it.
#[test]
fn an_abort_is_heard_while_nothing_the_vehicle_sends_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::that_takes_nothing_from_near(57_600);
    let mut flight =
        Running::start(&mut vehicle(folder.path(), &format!("serial:{}:57600", line.near.display())));
    let mut radio = std::fs::File::options().write(true).open(&line.far).unwrap();
    let station = Speaking::on(radio.try_clone().unwrap());
    let mut encoder = Encoder::new(GROUND);
    let mut command = |command, param1| {
        radio.write_all(command_frame(&mut encoder, command, param1).as_bytes()).unwrap();
    };
    flight.wait_for_line("PAD_IDLE");
    command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0);
    flight.wait_for_line("PAD_ARMED");
    command(MavCmd::MAV_CMD_MISSION_START, 0.0);
    // By the end of the countdown the vehicle has sent more than a terminal's buffer holds.
    flight.wait_for_line("to POWERED");
    drop(station);
    command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0);
    let before_burn_out = flight.wait_for_line("no cut-off exists");
    assert!(before_burn_out.contains("ABORT"), "{before_burn_out}");
    let ended = flight.wait();
    assert_eq!(ended.code, Some(4), "{}", ended.output);
    let at =
        |words: &str| ended.output.find(words).unwrap_or_else(|| panic!("no {words} in {}", ended.output));
    assert!(at("no cut-off exists") < at("burn-out"), "{}", ended.output);
}

/// A ground station that says ten times a second that it is there, until it is dropped.
struct Speaking(Arc<AtomicBool>);

impl Speaking {
    fn on(mut radio: std::fs::File) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        std::thread::Builder::new()
            .name("heartbeats".to_owned())
            .spawn(move || {
                let mut encoder = Encoder::new(GROUND);
                while !ends.load(Ordering::Relaxed)
                    && radio.write_all(heartbeat_frame(&mut encoder).as_bytes()).is_ok()
                {
                    std::thread::sleep(Duration::from_millis(100));
                }
            })
            .expect("a thread");
        Self(over)
    }
}

impl Drop for Speaking {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn a_flight_that_misses_its_limits_is_called_so_by_both() {
    let folder = tempfile::tempdir().unwrap();
    let listed =
        Running::to_end(program(Program::OnboardSim).args(["profiles", "--show", "paper-calibrated"]));
    assert_eq!(listed.code, Some(0));
    // A motor 8 % weaker than the controller believes.
    let weak = format!("{}\n[plant]\nthrust_scale = 0.92\n", listed.output);
    std::fs::write(folder.path().join("weak.toml"), weak).unwrap();
    let mut station = Running::start(&mut ground(folder.path(), "udpin:127.0.0.1:0"));
    let link = format!("udpout:127.0.0.1:{}", station.bound_port(Bound::Udp));
    let flight = Running::start(vehicle(folder.path(), &link).args(["--profile", "weak.toml"]));
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!(station.code, Some(3), "{}", station.output);
    assert_eq!(flight.code, Some(3), "{}", flight.output);
    assert!(
        flight.output.contains("NOT LANDED") && station.output.contains("NOT LANDED"),
        "{}",
        station.output
    );
}
