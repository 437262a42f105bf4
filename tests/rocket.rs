//! A rocket that flies from apogee: alone, with the ground station over UDP and over a serial
//! radio, and aborted.

use e2e::{
    ABORT, ACCEPTED, ARM, BareGround, Program, Running, START, SerialLine, Signal, auto_ground,
    expect_identical_replay, expect_landing, last_time_s, program, vehicle,
};
use protocol::dialect::{MavMessage, MavState, TdAbortEffect, TdChute, TdInterlock, TdPhase};

#[test]
fn a_rocket_without_a_ground_lands_and_its_log_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--mission", "mk2", "--speed", "max", "--log", "flight.mcap"])
        .current_dir(folder.path());
    let flight = Running::to_end(&mut fly);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    for words in ["no ascent is flown", "AERO_DESCENT", "POWERED", "TOUCHDOWN", "STANDS UNDAMAGED", "Table 2"]
    {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    expect_identical_replay(folder.path(), "flight.mcap");
}

#[test]
fn the_demonstration_of_the_ground_flies_the_same_mission_from_the_pad() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = program(Program::Ground);
    ground.args(["--mission", "mk2", "--speed", "max", "--log", "both.mcap"]).current_dir(folder.path());
    let flight = Running::to_end(&mut ground);
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    for words in ["phase PAD_ARMED -> BOOST", "LIFT-OFF", "APOGEE at", "STANDS UNDAMAGED"] {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    expect_identical_replay(folder.path(), "both.mcap");
}

/// Neither armed nor started, it rises all the same, and comes down under its parachute.
#[test]
fn an_uncommanded_lift_off_is_flown_to_the_parachute() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = BareGround::new();
    let mut command = vehicle(folder.path(), &[&ground.link()]);
    let fault = ["--fault", "ascent-self-lights@pad+5"];
    let flight = ["--mission", "mk2", "--start", "pad", "--stay", "--speed", "2"];
    let vehicle = Running::start(command.args(flight).args(fault));
    ground.wait_for_status("a boost", |status| status.phase == TdPhase::TD_PHASE_BOOST);
    let down = ground.wait_for_status("the parachute", |status| status.phase == TdPhase::TD_PHASE_CHUTE);
    assert!(down.interlocks.contains(TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED), "{down:?}");
    ground.wait_for_status("the ground", |status| status.phase == TdPhase::TD_PHASE_TOUCHDOWN);
    vehicle.signal(Signal::SIGTERM);
    let output = vehicle.wait().output;
    assert!(output.contains("LIFT-OFF without a countdown"), "{output}");
    expect_identical_replay(folder.path(), "vehicle.mcap");
}

#[test]
fn over_a_serial_radio_it_lands_within_its_budget() {
    let folder = tempfile::tempdir().unwrap();
    let line = SerialLine::new(57_600);
    let mut vehicle = vehicle(folder.path(), &[&line.near_link()]);
    let vehicle = Running::start(vehicle.args(["--mission", "mk2"]));
    let ground = Running::start(&mut auto_ground(folder.path(), &[&line.far_link()]));
    let (flight, _) = expect_landing(vehicle, ground);
    let [down, _] = line.carried();
    let seconds = last_time_s(&flight.output);
    assert!(seconds > 15.0, "{}", flight.output);
    let down_s = down as f64 / seconds;
    println!("serial line at 57600 baud: {down_s:.0} B/s down over {seconds:.1} s");
    assert!((500.0..=2_000.0).contains(&down_s), "{down_s} B/s down");
}

#[test]
fn an_abort_in_the_descent_opens_the_parachute() {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = BareGround::new();
    let mut command = vehicle(folder.path(), &[&ground.link()]);
    let vehicle = Running::start(command.args(["--mission", "mk2", "--stay", "--speed", "2"]));
    ground.wait_until_ready();
    assert_eq!(ground.command(ARM, 1.0), ACCEPTED);
    assert_eq!(ground.command(START, 0.0), ACCEPTED);
    ground.wait_for_status("room for the parachute", |status| {
        status.abort_effect == TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW
    });
    assert_eq!(ground.command(ABORT, 1.0), ACCEPTED);
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
    expect_identical_replay(folder.path(), "vehicle.mcap");
}
