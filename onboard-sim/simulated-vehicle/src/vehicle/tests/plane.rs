//! The planar vehicle: arming, countdown, landing, and an abort in every phase it passes.

use flight::computer::AbortEffect;
use flight::guidance::controller::ControlLevel;
use flight::rules::phase::MotorStatus;
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::{Profile, StartPoint};
use sim::plane::DeadlinePolicy;
use sim::plane::draw::{Draw, draw};

use super::*;

fn drawn(profile: &Profile, drawn: Draw, policy: DeadlinePolicy) -> Told {
    Told::of(Vehicle::in_plane(PlanarFlight::new(profile, drawn, policy).unwrap()))
}

fn vehicle_of(profile: &Profile) -> Told {
    drawn(profile, draw(profile, 1), DeadlinePolicy::Observe)
}

fn flight(vehicle: &mut Told) -> &mut PlanarFlight {
    let Flight::Plane(flight) = &mut vehicle.flight else { panic!("in the plane") };
    flight
}

fn vehicle() -> Told {
    vehicle_of(&vehicles::profile::builtin("paper-calibrated").unwrap())
}

fn in_phase(phase: Phase) -> Told {
    vehicle().run_to(phase)
}

#[test]
fn the_nominal_flight_passes_its_phases_and_lands_inside_table_2() {
    let mut vehicle = in_phase(Phase::PadArmed);
    vehicle.request(Asked::Start);
    let events = vehicle.run_until(Vehicle::is_over);
    let expected = [Phase::PadArmed, Phase::LandArmed, Phase::Ignition, Phase::Powered, Phase::Touchdown];
    assert_eq!(phases(&events), expected);
    let judged = vehicle.judged().unwrap();
    assert!(judged.landed && judged.verdict.landed(), "{:?}: {}", judged.impact, judged.verdict.summary());
    assert!(events.iter().any(|event| matches!(event, VehicleEvent::Verdict { .. })));
}

#[test]
fn a_landed_vehicle_is_over_at_once_and_safed_when_its_motor_has_cooled() {
    let mut vehicle = in_phase(Phase::PadArmed);
    vehicle.request(Asked::Start);
    let flown = vehicle.run_until(Vehicle::is_over);
    assert!(said(&flown, "burn-out: motor hot for 60 s"), "{flown:?}");
    let over_at_s = vehicle.time_s();
    assert_eq!((vehicle.phase(), vehicle.snapshot().motor), (Phase::Touchdown, MotorStatus::Hot));
    let wait_s = vehicle.snapshot().approach_wait_s.unwrap();
    let afterwards = vehicle.run_until(|v| v.phase() == Phase::Safed);
    assert!((vehicle.time_s() - over_at_s - wait_s).abs() < 0.05, "{} s, said {wait_s}", vehicle.time_s());
    assert!(wait_s > 50.0 && vehicle.is_over());
    assert!(
        !afterwards.iter().any(|event| matches!(event, VehicleEvent::Tick(_))),
        "the controller stands still"
    );
    let after = vehicle.snapshot();
    assert_eq!((after.motor, after.approach_wait_s), (MotorStatus::Burnt, Some(0.0)));
    assert!(!after.interlocks.armed);
}

/// A vehicle that was armed and started, and whose ignition gate will refuse its tilt.
fn started_with_a_shut_gate() -> Told {
    let mut profile = vehicles::profile::builtin("paper-calibrated").unwrap();
    profile.gate.tilt_max_deg = 1.0;
    profile.dispersion.pitch_deg = 20.0;
    let mut vehicle = vehicle_of(&profile);
    vehicle.run_until(|v| v.phase() == Phase::PadIdle);
    vehicle.request(Asked::Arm);
    vehicle.request(Asked::Start);
    vehicle
}

#[test]
fn a_motor_that_was_never_lit_is_live_until_its_pin_is_put_back() {
    let mut vehicle = started_with_a_shut_gate();
    let flown = vehicle.run_until(Vehicle::is_over);
    assert!(said(&flown, "LIVE MOTOR: do not approach for 60 s"), "{flown:?}");
    let mut later = Vec::new();
    for _ in 0..10_000 {
        later.extend(vehicle.advance());
    }
    assert!(said(&later, "LIVE MOTOR: the wait is over"), "{later:?}");
    assert_eq!((vehicle.phase(), vehicle.snapshot().motor), (Phase::Touchdown, MotorStatus::Live));
    vehicle.set_pin_out(false);
    let safed = vehicle.run_until(|v| v.phase() == Phase::Safed);
    assert!(said(&safed, "pin in"), "{safed:?}");
}

#[test]
fn ticks_are_numbered_without_gaps_and_fall_on_samples_since_ignition() {
    let mut vehicle = in_phase(Phase::PadArmed);
    vehicle.request(Asked::Start);
    let events = vehicle.run_until(Vehicle::is_over);
    let ticks: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            VehicleEvent::Tick(tick) => Some(tick.tick.input),
            _ => None,
        })
        .collect();
    for pair in ticks.windows(2) {
        assert_eq!(pair[1].tick, pair[0].tick + 1);
    }
    // The gate opens on the plan of the first tick, which therefore still belongs to the phase before.
    let powered: Vec<_> = ticks.iter().filter(|tick| tick.phase.is_landing()).collect();
    assert!(powered.len() >= 50, "{}", powered.len());
    for (k, tick) in powered.iter().enumerate() {
        assert!((tick.time_since_ignition_s - 0.1 * k as f64).abs() < 1e-9);
    }
    // As in the paper, the first action falls one sample after ignition.
    assert_eq!(powered[0].gimbal_applied_rad.to_bits(), 0.0f64.to_bits());
}

#[test]
fn two_flights_of_one_seed_are_equal_to_the_bit() {
    let fly = || {
        let mut vehicle = vehicle_of(&vehicles::profile::builtin("paper-dispersed").unwrap());
        vehicle.run_until(|v| v.phase() == Phase::PadIdle);
        vehicle.request(Asked::Arm);
        vehicle.request(Asked::Start);
        vehicle.run_until(Vehicle::is_over)
    };
    // Debug prints a double's shortest exact form, so equal text is equal bits (but for NaN payloads).
    assert_eq!(format!("{:?}", fly()), format!("{:?}", fly()));
}

#[test]
fn a_failed_check_refuses_arming_and_says_which() {
    let mut vehicle = in_phase(Phase::PadIdle);
    vehicle.set_log_state(LogState { running: false, space_bytes: 0 });
    let answer = vehicle.request(Asked::Arm);
    assert_eq!(answer.ending, Ending::NotNow);
    assert!(answer.reason.unwrap().starts_with("log: found not running"));
    assert_eq!(vehicle.phase(), Phase::PadIdle);
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    assert_eq!(vehicle.request(Asked::Arm).ending, Ending::Accepted);
    assert_eq!(vehicle.request(Asked::Arm).ending, Ending::Accepted, "armed already");
}

#[test]
fn a_landing_that_cannot_be_is_refused_on_the_pad_with_its_bound() {
    let mut vehicle = vehicle_of(&vehicles::profile::builtin("paper-as-printed").unwrap());
    let mut events = vehicle.run_until(|v| v.phase() == Phase::PadIdle);
    for _ in 0..300 {
        events.extend(vehicle.advance());
    }
    let said = |event: &&VehicleEvent| matches!(event, VehicleEvent::Text { text, .. } if text.contains("not landable: best touchdown speed 4.3 m/s"));
    assert_eq!(events.iter().filter(said).count(), 1, "said unasked, and once");
    let reason = vehicle.request(Asked::Arm).reason.unwrap();
    assert!(reason.contains("not landable: best touchdown speed 4.3 m/s"), "{reason}");
}

#[test]
fn a_countdown_can_be_cancelled_without_a_latch() {
    let mut vehicle = in_phase(Phase::PadArmed);
    assert_eq!(vehicle.request(Asked::Start).ending, Ending::Accepted);
    assert_eq!(vehicle.request(Asked::Start).ending, Ending::Accepted, "running already");
    assert_eq!(vehicle.request(Asked::Disarm).ending, Ending::Accepted);
    assert_eq!(vehicle.phase(), Phase::PadIdle);
    assert!(!vehicle.aborted());
    for _ in 0..500 {
        vehicle.advance();
    }
    assert_eq!(vehicle.phase(), Phase::PadIdle, "nothing was released");
    assert_eq!(vehicle.request(Asked::Arm).ending, Ending::Accepted);
}

#[test]
fn start_and_disarm_are_refused_where_they_do_not_belong() {
    assert_eq!(in_phase(Phase::PadIdle).request(Asked::Start).ending, Ending::Denied);
    let mut flying = in_phase(Phase::Powered);
    for asked in [Asked::Arm, Asked::Disarm, Asked::Start] {
        let answer = flying.request(asked);
        assert_eq!(answer.ending, Ending::Denied, "{asked:?}");
        assert!(answer.reason.unwrap().contains("POWERED"));
    }
}

#[test]
fn an_abort_on_the_pad_disarms_latches_and_shows_the_wait() {
    for phase in [Phase::PadIdle, Phase::PadArmed] {
        let mut vehicle = in_phase(phase);
        assert_eq!(vehicle.snapshot().abort_effect, AbortEffect::SafeOnPad);
        assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted);
        let after = vehicle.snapshot();
        assert_eq!(after.phase, Phase::PadIdle);
        assert!(!after.interlocks.armed && after.interlocks.landing_motor_inhibited);
        assert_eq!(after.pad_wait_s, Some(60.0));
        assert_eq!(after.abort_effect, AbortEffect::None);
        assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted, "repeated until answered");
        let refused = vehicle.request(Asked::Arm);
        assert_ne!(refused.ending, Ending::Accepted);
        assert!(refused.reason.unwrap().contains("abort"));
        assert!(vehicle.is_over());
    }
}

#[test]
fn an_abort_in_the_countdown_releases_nothing() {
    let mut vehicle = in_phase(Phase::PadArmed);
    vehicle.request(Asked::Start);
    vehicle.advance();
    assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted);
    for _ in 0..500 {
        vehicle.advance();
    }
    assert_eq!(vehicle.phase(), Phase::PadIdle);
    assert!(vehicle.snapshot().thrust_n.abs() < f64::EPSILON);
}

/// How long an aborted vehicle had been burning, s, and the abort's landing.
fn aborted_after(burning_s: f64) -> (Told, Vec<VehicleEvent>) {
    let mut vehicle = in_phase(Phase::Ignition);
    vehicle.run_until(|v| v.snapshot().since_zero_s.is_some_and(|since_s| since_s >= burning_s));
    assert_eq!(vehicle.snapshot().abort_effect, AbortEffect::LandHere);
    assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted);
    assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted, "repeated until answered");
    let events = vehicle.run_until(Vehicle::is_over);
    (vehicle, events)
}

#[test]
fn an_abort_under_thrust_lands_and_stays_an_abort() {
    for burning_s in [0.0, 0.3, 1.5, 3.0] {
        let (vehicle, events) = aborted_after(burning_s);
        assert!(!phases(&events).contains(&Phase::Chute));
        assert!(said(&events, "no cut-off exists; landing on the ground below"), "{events:?}");
        let judged = vehicle.judged().unwrap();
        assert!(judged.landed, "{burning_s} s: {judged:?}");
        assert!(vehicle.aborted(), "the verdict stands beside the abort");
    }
}

/// Where no landing can be planned, an abort can only hold it upright, and that is said before.
#[test]
fn without_a_plan_an_abort_under_thrust_holds_upright() {
    let mut vehicle = in_phase(Phase::Powered);
    // Burns on its back: no landing from here.
    let thrown =
        PlanarState { theta_rad: -1.0, z_m: 4.0, w_m_s: 8.0, ..flight(&mut vehicle).plant().state() };
    flight(&mut vehicle).place(thrown);
    let level = |v: &Vehicle| v.computer().plane().unwrap().output().unwrap().level;
    vehicle.run_until(|v| level(v) == ControlLevel::Stabiliser);
    assert_eq!(vehicle.snapshot().abort_effect, AbortEffect::UprightOnly);
    assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted);
    vehicle.run_until(Vehicle::is_over);
    assert!(!vehicle.judged().unwrap().landed);
}

/// Before the gate has opened nothing is left but the fall: 5 m/s at 15 m, and then hardly any drag.
#[test]
fn an_abort_with_the_gate_shut_says_how_hard_it_hits() {
    let mut vehicle = started_with_a_shut_gate();
    vehicle.run_until(|v| v.phase() == Phase::LandArmed);
    let AbortEffect::Impact { m_s } = vehicle.snapshot().abort_effect else {
        panic!("{:?}", vehicle.snapshot().abort_effect)
    };
    assert_eq!(vehicle.request(Asked::Abort).ending, Ending::Accepted);
    vehicle.run_until(Vehicle::is_over);
    let found_m_s = vehicle.judged().unwrap().impact.state.speed_m_s();
    assert!((f64::from(m_s) - 1.0..=f64::from(m_s)).contains(&found_m_s), "{m_s} said, {found_m_s} found");
}

#[test]
fn an_abort_on_the_ground_is_refused_in_words() {
    for phase in [Phase::Touchdown, Phase::Safed] {
        let mut vehicle = in_phase(phase);
        assert_eq!(vehicle.snapshot().abort_effect, AbortEffect::None);
        let answer = vehicle.request(Asked::Abort);
        assert_eq!(answer.ending, Ending::Failed);
        assert!(answer.reason.unwrap().contains("on the ground"));
        assert!(!vehicle.aborted());
    }
}

#[test]
fn a_gate_that_does_not_open_lights_nothing() {
    let mut vehicle = started_with_a_shut_gate();
    let events = vehicle.run_until(Vehicle::is_over);
    assert!(!phases(&events).contains(&Phase::Ignition), "{:?}", phases(&events));
    assert!(!vehicle.judged().unwrap().landed);
    let gate_words = events.iter().any(|event| {
        matches!(event, VehicleEvent::Text { text, .. } if text.starts_with("ignition gate closed: tilt"))
    });
    assert!(gate_words);
}

/// The motor cannot be cut off: it is lit only on a plan from where the vehicle really is, not on a rehearsal.
#[test]
fn a_release_that_no_plan_lands_from_lights_nothing() {
    let mut profile = vehicles::profile::builtin("paper-calibrated").unwrap();
    for (altitude_m, w_m_s) in [(6.0, 0.0), (40.0, 0.0), (15.0, 30.0)] {
        let mut truth = draw(&profile, 1);
        truth.release.z_m = altitude_m;
        truth.release.w_m_s = w_m_s;
        profile.gate.speed_error_max_fraction = 100.0;
        let mut vehicle = drawn(&profile, truth, DeadlinePolicy::Observe);
        vehicle.run_until(|v| v.phase() == Phase::PadIdle);
        assert_eq!(vehicle.request(Asked::Arm).ending, Ending::Accepted);
        vehicle.request(Asked::Start);
        let events = vehicle.run_until(Vehicle::is_over);
        assert!(!phases(&events).contains(&Phase::Ignition), "{altitude_m} m, {w_m_s} m/s");
        let said = |event: &&VehicleEvent| matches!(event, VehicleEvent::Text { text, .. } if text.starts_with("ignition gate closed"));
        let complaints = events.iter().filter(said).count();
        assert!((1..=4).contains(&complaints), "said when it changes, not every sample: {complaints}");
    }
}

#[test]
fn an_actuator_that_does_not_move_fails_the_self_test() {
    let mut profile = vehicles::profile::builtin("paper-calibrated").unwrap();
    profile.fins.rate_limit_deg_s = 1e-6;
    let mut vehicle = vehicle_of(&profile);
    let mut events = Vec::new();
    for _ in 0..300 {
        events.extend(vehicle.advance());
    }
    assert_eq!(vehicle.phase(), Phase::Safe);
    assert!(events.iter().any(|event| {
        matches!(event, VehicleEvent::Text { text, .. } if text.starts_with("self-test failed"))
    }));
}

#[test]
fn a_log_that_stops_in_flight_is_announced() {
    let mut vehicle = in_phase(Phase::Powered);
    vehicle.set_log_state(LogState { running: false, space_bytes: 0 });
    let events = vehicle.advance();
    assert!(events.iter().any(|event| {
        matches!(event, VehicleEvent::Text { severity: Severity::Error, text } if text.contains("log has stopped"))
    }));
}

#[test]
fn a_late_output_is_not_applied_when_deadlines_are_enforced() {
    let profile = vehicles::profile::builtin("paper-calibrated").unwrap();
    let mut vehicle = drawn(&profile, draw(&profile, 1), DeadlinePolicy::Enforce);
    vehicle.run_until(|v| v.phase() == Phase::PadIdle);
    vehicle.request(Asked::Arm);
    vehicle.request(Asked::Start);
    vehicle.run_until(|v| v.phase() == Phase::Powered);
    // A clock that moves by 0.2 s a look: every tick is late.
    let mut now = Duration::ZERO;
    let mut slow = || {
        now += Duration::from_millis(200);
        now
    };
    let mut ticks = Vec::new();
    for _ in 0..15 {
        for event in vehicle.advance_timed(&mut slow) {
            if let VehicleEvent::Tick(tick) = event {
                ticks.push(tick.tick);
            }
        }
    }
    assert!(ticks.len() >= 3);
    assert!(ticks[1].input.deadline_missed && ticks[2].input.deadline_missed);
    // What was applied is the plan before the late one, one interval on.
    let before = ticks[0].output.plan.used_gimbal_rad()[1];
    assert_eq!(ticks[2].input.gimbal_applied_rad.to_bits(), before.to_bits());
}

#[test]
fn a_profile_that_starts_elsewhere_is_refused_by_name() {
    let mut profile = vehicles::profile::builtin("paper-calibrated").unwrap();
    profile.start.at = StartPoint::Apogee;
    let error = PlanarFlight::new(&profile, draw(&profile, 1), DeadlinePolicy::Observe).err().unwrap();
    assert!(error.to_string().contains("start.at = Apogee is not simulated"), "{error}");
    profile.start.at = StartPoint::Ignition;
    profile.nmpc.sample_time_s = 0.0995;
    let error = PlanarFlight::new(&profile, draw(&profile, 1), DeadlinePolicy::Observe).err().unwrap();
    assert!(error.to_string().contains("whole number of milliseconds"), "{error}");
}
