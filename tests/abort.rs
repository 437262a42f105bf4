//! Aborts in the phases of this flight, sent to the real vehicle process over a real socket.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use e2e::{ABORT, ACCEPTED, ARM, BareGround, Ended, Running, START, Signal, vehicle};
use protocol::dialect::{MavModeFlag, MavState, TdAbortEffect, TdInterlock, TdMotor, TdPhase};

/// MAV_RESULT_FAILED as a number.
const FAILED: u8 = 4;

struct Flight {
    vehicle: Running,
    ground: BareGround,
    _folder: tempfile::TempDir,
}

fn fly_to(phase: TdPhase) -> Flight {
    let folder = tempfile::tempdir().unwrap();
    let mut ground = BareGround::new();
    let vehicle =
        Running::start(vehicle(folder.path(), &[&ground.link()]).args(["--stay", "--dispersion", "none"]));
    ground.wait_until_ready();
    if phase != TdPhase::TD_PHASE_PAD_IDLE {
        assert_eq!(ground.command(ARM, 1.0), ACCEPTED);
    }
    if phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32 {
        assert_eq!(ground.command(START, 0.0), ACCEPTED);
        ground.wait_for_phase(phase);
    }
    Flight { vehicle, ground, _folder: folder }
}

/// Stops the vehicle, which then reports how its flight ended.
fn ended(flight: Flight) -> Ended {
    flight.vehicle.signal(Signal::SIGTERM);
    flight.vehicle.wait()
}

#[test]
fn an_abort_on_the_pad_disarms_latches_and_prevents_arming() {
    for phase in [TdPhase::TD_PHASE_PAD_IDLE, TdPhase::TD_PHASE_PAD_ARMED] {
        let mut flight = fly_to(phase);
        let before = flight.ground.wait_for_phase(phase);
        assert_eq!(before.abort_effect, TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD);
        assert_eq!(flight.ground.command(ABORT, 1.0), ACCEPTED);
        assert_ne!(flight.ground.command(ARM, 1.0), ACCEPTED);
        let after = flight.ground.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE);
        assert!(after.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED));
        assert!(!after.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED));
        assert!(after.approach_wait_s > 50, "{}", after.approach_wait_s);
        let beat = flight.ground.wait_for_heartbeat();
        assert_eq!(beat.system_status, MavState::MAV_STATE_FLIGHT_TERMINATION);
        assert!(!beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
        let ended = ended(flight);
        assert_eq!(ended.code, Some(4), "{}", ended.output);
    }
}

#[test]
fn an_abort_in_the_countdown_prevents_the_release() {
    let mut flight = fly_to(TdPhase::TD_PHASE_PAD_ARMED);
    assert_eq!(flight.ground.command(START, 0.0), ACCEPTED);
    assert_eq!(flight.ground.command(ABORT, 1.0), ACCEPTED);
    // The wait is longer than the countdown.
    let aborted_at_ms = flight.ground.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms;
    while flight.ground.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE).time_boot_ms < aborted_at_ms + 11_000 {}
    let ended = ended(flight);
    assert_eq!(ended.code, Some(4), "{}", ended.output);
    assert!(!ended.output.contains("LAND_ARMED"), "{}", ended.output);
}

#[test]
fn an_abort_under_thrust_lands_on_the_ground_below_and_reports_that_no_cut_off_exists() {
    let mut flight = fly_to(TdPhase::TD_PHASE_POWERED);
    let before = flight.ground.wait_for_phase(TdPhase::TD_PHASE_POWERED);
    assert_eq!(before.abort_effect, TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE);
    assert_eq!(flight.ground.command(ABORT, 1.0), ACCEPTED);
    flight.ground.wait_for_phase(TdPhase::TD_PHASE_TOUCHDOWN);
    // It is judged at rest.
    flight.vehicle.wait_for_line("STANDS UNDAMAGED");
    let ended = ended(flight);
    assert_eq!(ended.code, Some(4), "{}", ended.output);
    assert!(ended.output.contains("no cut-off exists"), "{}", ended.output);
    assert!(ended.output.contains("landing on the ground below"), "{}", ended.output);
    assert!(!ended.output.contains("CHUTE"), "{}", ended.output);
    assert!(
        ended.output.contains("ABORTED, then STANDS UNDAMAGED"),
        "the verdict stands beside it: {}",
        ended.output
    );
}

#[test]
fn an_abort_after_touchdown_is_refused() {
    let mut flight = fly_to(TdPhase::TD_PHASE_TOUCHDOWN);
    assert_eq!(flight.ground.command(ABORT, 1.0), FAILED);
    // At rest the vehicle disarms. It reports a hot motor, not a safe one, for a minute.
    flight.ground.wait_for_status("a disarmed vehicle with a hot motor", |status| {
        assert_eq!(status.phase, TdPhase::TD_PHASE_TOUCHDOWN);
        let disarmed = !status.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED);
        disarmed && status.motor == TdMotor::TD_MOTOR_HOT && status.approach_wait_s > 40
    });
    let ended = ended(flight);
    assert_eq!(ended.code, Some(0), "a landing stays a landing: {}", ended.output);
}

#[test]
fn a_termination_command_with_zero_does_nothing() {
    let mut flight = fly_to(TdPhase::TD_PHASE_PAD_ARMED);
    assert_eq!(flight.ground.command(ABORT, 0.0), FAILED);
    let beat = flight.ground.wait_for_heartbeat();
    assert!(beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
    let ended = ended(flight);
    assert_eq!(ended.code, Some(5), "{}", ended.output);
}
