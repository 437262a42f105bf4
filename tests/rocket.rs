//! A rocket from apogee on the wire: by itself, with the ground station over UDP and over a radio's serial line, and aborted.

use std::path::Path;

use e2e::{BareGround, Program, Running, SerialLine, Signal, program};
use protocol::dialect::{MavCmd, MavMessage, MavState, TdAbortEffect, TdChute, TdPhase};

const ACCEPTED: u8 = 0;

fn verify(folder: &Path, log: &str) {
    let verified = Running::to_end(program(Program::Replay).args(["verify", log]).current_dir(folder));
    assert_eq!(verified.code, Some(0), "{}", verified.output);
    assert!(verified.output.contains("ticks identical"), "{}", verified.output);
}

#[test]
fn by_itself_it_lands_and_its_log_replays_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--profile", "mk2", "--speed", "max", "--log", "flight.mcap"])
        .current_dir(folder.path());
    let flight = Running::to_end(&mut fly);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    for words in ["no ascent is flown", "AERO_DESCENT", "POWERED", "TOUCHDOWN", "LANDED", "Table 2"] {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    verify(folder.path(), "flight.mcap");
}

#[test]
fn the_ground_s_own_demonstration_flies_it_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = program(Program::Ground);
    ground.args(["--profile", "mk2", "--speed", "max", "--log", "both.mcap"]).current_dir(folder.path());
    let flight = Running::to_end(&mut ground);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    for words in ["AERO_DESCENT", "no ascent is flown", "LANDED"] {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    verify(folder.path(), "both.mcap");
}

#[test]
fn over_a_radio_s_serial_line_it_lands_within_its_budget() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::new(57_600);
    let link = |device: &Path| format!("serial:{}:57600", device.display());
    let mut vehicle = program(Program::OnboardSim);
    vehicle.args(["fly", "--profile", "mk2", "--mavlink", &link(&line.near)]).current_dir(folder.path());
    let mut ground = program(Program::Ground);
    ground
        .args(["--connect", &link(&line.far), "--headless", "--auto", "--log", "ground.mcap"])
        .current_dir(folder.path());
    let flight = Running::start(&mut vehicle);
    let station = Running::start(&mut ground);
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!(station.code, Some(0), "{}", station.output);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    let [down, _] = line.carried();
    let seconds = flight
        .output
        .lines()
        .filter_map(|line| line.trim_start().split_once(" s  ")?.0.trim().parse::<f64>().ok())
        .fold(0.0, f64::max);
    assert!(seconds > 15.0, "{}", flight.output);
    let down_s = down as f64 / seconds;
    println!("serial line at 57600 baud: {down_s:.0} B/s down over {seconds:.1} s");
    assert!((500.0..=2_000.0).contains(&down_s), "{down_s} B/s down");
}

#[test]
fn an_abort_in_the_descent_brings_it_down_under_its_parachute() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = BareGround::new();
    let mut command = program(Program::OnboardSim);
    command
        .args(["fly", "--profile", "mk2", "--stay", "--speed", "2", "--mavlink", &ground.link()])
        .args(["--log", "flight.mcap"])
        .current_dir(folder.path());
    let vehicle = Running::start(&mut command);
    ground.wait_for("every check passed", |_, message| match message {
        Some(MavMessage::TD_FLIGHT_STATUS(status))
            if status.phase == TdPhase::TD_PHASE_PAD_IDLE && status.checks_failed.is_empty() =>
        {
            Some(())
        }
        _ => None,
    });
    assert_eq!(ground.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0), ACCEPTED);
    assert_eq!(ground.command(MavCmd::MAV_CMD_MISSION_START, 0.0), ACCEPTED);
    ground.wait_for("room for the parachute", |_, message| match message {
        Some(MavMessage::TD_FLIGHT_STATUS(status))
            if status.abort_effect == TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW =>
        {
            Some(())
        }
        _ => None,
    });
    assert_eq!(ground.command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0), ACCEPTED);
    ground.wait_for_phase(TdPhase::TD_PHASE_CHUTE);
    ground.wait_for("an open parachute", |_, message| match message {
        Some(MavMessage::TD_DESCENT(descent)) if descent.chute == TdChute::TD_CHUTE_OPEN => Some(()),
        _ => None,
    });
    assert_eq!(ground.wait_for_heartbeat().system_status, MavState::MAV_STATE_FLIGHT_TERMINATION);
    vehicle.signal(Signal::SIGTERM);
    let ended = vehicle.wait();
    assert_eq!(ended.code, Some(4), "{}", ended.output);
    assert!(ended.output.contains("parachute deployed"), "{}", ended.output);
    assert!(!ended.output.contains("IGNITION"), "{}", ended.output);
    verify(folder.path(), "flight.mcap");
}
