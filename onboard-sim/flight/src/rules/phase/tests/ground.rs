//! On the ground after the flight: the status of the motor, and when the vehicle becomes SAFED.
//! On the ground before it: holds of the countdown.

use super::*;

/// On the ground since 100 s, with this motor.
fn landed(motor: Motor, pin_out: bool) -> Mode {
    let mode = in_order(Phase::Touchdown);
    let interlocks = Interlocks { pin_out, landing_motor_inhibited: true, ..mode.interlocks };
    Mode { motor, interlocks, entered_at_s: 100.0, ..mode }
}

#[test]
fn during_a_flight_the_motor_is_live_then_burning_then_hot_then_burnt() {
    let mut mode = after(&ARM[..2]);
    let mut status = |events: &[Event], time_s: f64| {
        for event in events {
            let answer = transition(&mode, *event, time_s);
            assert_eq!(answer.refusal, None, "{event:?}");
            mode = answer.mode;
        }
        (mode.motor_status(time_s), mode.approach_wait_s(time_s))
    };
    let start = [ARM[2], Event::StartRequested { countdown_s: 0.0, checks_passed: true }];
    assert_eq!(status(&[], 2.0), (MotorStatus::Live, Some(0.0)));
    assert_eq!(status(&start, 3.0), (MotorStatus::Live, None));
    let fall = [Event::ReleasedAt(StartPoint::Apogee), Event::FinsConfirmed, Event::LandArm];
    assert_eq!(status(&fall, 4.0), (MotorStatus::Live, None));
    assert_eq!(status(&[Event::IgnitionGate { open: true }], 5.0), (MotorStatus::Burning, None));
    assert_eq!(status(&[Event::ThrustConfirmed], 5.1), (MotorStatus::Burning, None));
    let contact = Event::Contact { thrust_below_weight: true };
    assert_eq!(status(&[contact], 10.0), (MotorStatus::Burning, None), "it may burn out on the ground");
    assert_eq!(status(&[Event::Burnout], 11.0), (MotorStatus::Hot, Some(MOTOR_HOT_S)));
    assert_eq!(status(&[], 70.0), (MotorStatus::Hot, Some(1.0)));
    assert_eq!(status(&[], 71.0), (MotorStatus::Burnt, Some(0.0)));
    assert_eq!(status(&[Event::SafingDone], 71.0), (MotorStatus::Burnt, Some(0.0)));
    assert_eq!(mode.phase, Phase::Safed);
}

#[test]
fn after_no_light_the_motor_is_live_and_after_a_late_light_it_burns() {
    let dark = transition(&in_order(Phase::Ignition), Event::NoThrustTimeout, 1.0).mode;
    assert_eq!(dark.motor_status(1.0), MotorStatus::Live);
    let late = transition(&dark, Event::ThrustConfirmed, 1.2).mode;
    assert_eq!(late.motor_status(1.2), MotorStatus::Burning);
}

#[test]
fn a_live_motor_on_the_ground_is_safed_only_by_the_pin_and_the_wait() {
    for motor in [Motor::Unlit, Motor::Commanded] {
        let live = landed(motor, true);
        assert_eq!(live.motor_status(101.0), MotorStatus::Live);
        assert_eq!(live.approach_wait_s(110.0), Some(MISFIRE_WAIT_S - 10.0));
        // No matter how long the vehicle lies there.
        assert_eq!(transition(&live, Event::SafingDone, 1e6).refusal, Some(Refusal::MotorLive));
        let pinned = transition(&live, Event::PinInserted, 120.0).mode;
        assert_eq!(pinned.motor_status(120.0), MotorStatus::PinIn);
        let early = transition(&pinned, Event::SafingDone, 159.9);
        assert_eq!(early.refusal, Some(Refusal::MisfireWait));
        let safed = transition(&pinned, Event::SafingDone, 160.0);
        assert_eq!(safed.mode.phase, Phase::Safed);
        assert_eq!(safed.effects, Effects::of(&[Effect::Disarm]));
        // When the pin is pulled again, the motor is live again, so the vehicle must not be SAFED.
        let pulled = transition(&safed.mode, Event::PinPulled, 200.0).mode;
        assert_eq!((pulled.phase, pulled.motor_status(200.0)), (Phase::Touchdown, MotorStatus::Live));
        assert_eq!(pulled.approach_wait_s(200.0), Some(MISFIRE_WAIT_S));
    }
}

#[test]
fn a_pin_does_not_cool_a_motor() {
    let hot = landed(Motor::BurntOut { at_s: 99.0 }, false);
    assert_eq!(transition(&hot, Event::SafingDone, 158.9).refusal, Some(Refusal::MotorHot));
    let burning = landed(Motor::Burning, false);
    assert_eq!(transition(&burning, Event::SafingDone, 1e6).refusal, Some(Refusal::MotorBurning));
    let safed = transition(&hot, Event::SafingDone, 159.0).mode;
    assert_eq!(
        transition(&safed, Event::PinPulled, 160.0).mode.phase,
        Phase::Safed,
        "a burnt motor stays burnt"
    );
}

/// Every state of motor and pin, at several times.
#[test]
fn on_the_ground_no_event_leads_to_safed_with_a_dangerous_motor() {
    let motors = [Motor::Unlit, Motor::Commanded, Motor::Burning, Motor::BurntOut { at_s: 100.0 }];
    for motor in motors {
        for pin_out in [false, true] {
            for time_s in [101.0, 159.9, 160.0, 1e6] {
                for event in every_event() {
                    let mode = landed(motor, pin_out);
                    let next = transition(&mode, event, time_s).mode;
                    let burnt = matches!(motor, Motor::BurntOut { .. });
                    let unlit = matches!(motor, Motor::Unlit | Motor::Commanded);
                    let safe = time_s >= 160.0 && (burnt || (unlit && !pin_out));
                    let safed = safe && event == Event::SafingDone;
                    let context = format!("{motor:?}, pin out {pin_out}, {time_s} s, {event:?}");
                    assert_eq!(next.phase == Phase::Safed, safed, "{context}");
                    assert!(safed || next.phase == Phase::Touchdown, "{context}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn no_sequence_of_events_leads_to_safed_with_a_dangerous_motor(
        events in prop::collection::vec((likely_event(), 0.0_f64..40.0), 0..60),
    ) {
        let (mut mode, mut time_s) = (Mode::power_up(0.0), 0.0);
        for (event, later_s) in events {
            time_s += later_s;
            mode = transition(&mode, event, time_s).mode;
            if mode.phase == Phase::Safed {
                prop_assert!(matches!(mode.motor_status(time_s), MotorStatus::Burnt | MotorStatus::PinIn));
            }
            if mode.approach_wait_s(time_s) == Some(0.0) {
                prop_assert!(!mode.interlocks.armed || mode.phase == Phase::Touchdown);
                prop_assert!(!matches!(mode.motor_status(time_s), MotorStatus::Burning | MotorStatus::Hot));
            }
        }
    }
}

// Holds: after a hold only a new start counts down again.

const SILENT: Event = hold(HoldCause::UplinkSilent, StartPoint::Pad);
const START: Event = Event::StartRequested { countdown_s: 5.0, checks_passed: true };
const CAUSES: [HoldCause; 5] = [
    HoldCause::UplinkSilent,
    HoldCause::Commanded,
    HoldCause::TapOverdue,
    HoldCause::StationDeaf,
    HoldCause::CheckFailed,
];

const fn hold(cause: HoldCause, start: StartPoint) -> Event {
    Event::Hold { cause, start }
}

/// Armed at 2 s, the countdown started at 3 s, held at 4 s.
fn held() -> Mode {
    after(&with_arm(&[START, SILENT]))
}

#[test]
fn a_hold_clears_the_countdown_and_leaves_the_vehicle_armed() {
    let counting = after(&with_arm(&[START]));
    for cause in CAUSES {
        let answer = transition(&counting, hold(cause, StartPoint::Pad), 4.0);
        assert_eq!(answer.effects, Effects::of(&[Effect::HoldCountdown]));
        assert_eq!((answer.mode.phase, answer.mode.countdown_end_s), (Phase::PadArmed, None));
        assert!(answer.mode.interlocks.armed);
        assert_eq!(answer.mode.held(4.0), Some((cause, HOLD_LIMIT_S)));
        assert_eq!(answer.mode.held(34.0), Some((cause, 30.0)));
    }
}

/// The countdown ends at 8 s.
#[test]
fn in_the_last_two_seconds_no_key_and_no_silence_holds_and_a_failing_check_an_abort_and_a_disarm_still_end_it()
 {
    let counting = after(&with_arm(&[START]));
    for cause in CAUSES {
        for start in [StartPoint::Pad, StartPoint::Apogee] {
            assert_eq!(transition(&counting, hold(cause, start), 5.99).refusal, None);
            for time_s in [6.0, 7.0, 8.0, 9.0, f64::NAN] {
                let late = transition(&counting, hold(cause, start), time_s);
                if cause == HoldCause::CheckFailed {
                    assert_eq!((late.refusal, late.mode.countdown_end_s), (None, None), "{time_s}");
                    continue;
                }
                assert_eq!((late.refusal, late.mode), (Some(Refusal::TooLateToHold), counting), "{time_s}");
            }
        }
    }
    for time_s in [6.0, 7.9, 8.0] {
        for event in [ABORT, Event::DisarmRequested { lifted_off: false }, Event::PinInserted] {
            let ended = transition(&counting, event, time_s);
            assert_eq!((ended.refusal, ended.mode.countdown_end_s), (None, None), "{event:?}");
            assert!(!ended.mode.interlocks.armed);
        }
    }
}

/// Its pilot lets go some time after the countdown.
#[test]
fn below_a_drone_a_countdown_can_be_held_until_the_release() {
    let counting = after(&with_arm(&[START]));
    for time_s in [7.0, 8.0, 30.0] {
        for cause in CAUSES {
            assert_eq!(transition(&counting, hold(cause, StartPoint::Drone), time_s).refusal, None);
        }
    }
}

#[test]
fn a_held_vehicle_is_not_released_and_a_second_hold_does_not_lengthen_the_first() {
    for release in [Event::CountdownElapsed, Event::ReleasedAt(StartPoint::Apogee)] {
        assert_eq!(transition(&held(), release, 30.0).refusal, Some(Refusal::CountdownNotElapsed));
    }
    let again = transition(&held(), SILENT, 30.0);
    assert_eq!((again.refusal, again.mode), (Some(Refusal::AlreadyHeld), held()));
    assert_eq!(transition(&after(&ARM), SILENT, 3.0).refusal, Some(Refusal::NoCountdown));
}

#[test]
fn a_new_start_ends_the_hold_with_a_full_countdown() {
    let started = transition(&held(), START, 50.0).mode;
    assert_eq!((started.hold, started.countdown_remaining_s(50.0)), (None, Some(5.0)));
    assert_eq!(transition(&started, Event::HoldElapsed, 64.0).refusal, Some(Refusal::HoldNotOver));
}

#[test]
fn after_a_minute_a_held_vehicle_disarms() {
    let early = transition(&held(), Event::HoldElapsed, 4.0 + HOLD_LIMIT_S - 0.1);
    assert_eq!(early.refusal, Some(Refusal::HoldNotOver));
    let disarmed = transition(&held(), Event::HoldElapsed, 4.0 + HOLD_LIMIT_S);
    assert_eq!((disarmed.mode.phase, disarmed.mode.hold), (Phase::PadIdle, None));
    assert_eq!(disarmed.effects, Effects::of(&[Effect::Disarm]));
    assert!(!disarmed.mode.interlocks.armed && !disarmed.mode.interlocks.abort_latched);
    assert_eq!(transition(&after(&ARM), Event::HoldElapsed, 900.0).refusal, Some(Refusal::HoldNotOver));
}

/// Every mode of an armed vehicle on the pad that the table can reach, at 100 s.
fn armed_on_the_pad() -> Vec<Mode> {
    let holds = [None, Some(50.0), Some(10.0)];
    let mut modes = Vec::new();
    for countdown_end_s in [None, Some(99.0), Some(101.0)] {
        for hold_at_s in holds.into_iter().filter(|hold| hold.is_none() || countdown_end_s.is_none()) {
            let hold = hold_at_s.map(|at_s| Hold { cause: HoldCause::Commanded, at_s });
            modes.push(Mode { countdown_end_s, hold, ..in_order(Phase::PadArmed) });
        }
    }
    modes
}

#[test]
fn no_event_leaves_an_armed_vehicle_with_both_a_hold_and_a_countdown() {
    for mode in armed_on_the_pad() {
        for event in every_event() {
            let answer = transition(&mode, event, 100.0);
            let next = answer.mode;
            let context = format!("{mode:?} + {event:?}");
            assert!(next.hold.is_none() || next.countdown_end_s.is_none(), "{context}");
            assert!(next.hold.is_none() || next.phase == Phase::PadArmed, "{context}");
            // During a hold nothing is released or ignited, except for a vehicle that already rises
            // or falls.
            if mode.hold.is_some() {
                let ignition = [Effect::IgniteAscentMotor, Effect::IgniteLandingMotor];
                assert!(!ignition.into_iter().any(|effect| answer.effects.contains(effect)), "{context}");
                let moves = matches!(event, Event::LiftOff | Event::ReleasedEarly { .. });
                assert!(next.phase.on_pad() || moves, "{context}");
                let restarted = next.countdown_end_s.is_some();
                assert_eq!(restarted, matches!(event, Event::StartRequested { .. }), "{context}");
            }
            if next.hold.is_some() && mode.hold.is_none() {
                assert!(matches!(event, Event::Hold { .. }) && mode.countdown_end_s.is_some(), "{context}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn in_any_sequence_of_events_a_hold_never_resumes_by_itself_and_lights_nothing(
        events in prop::collection::vec((likely_event(), 0.0_f64..40.0), 0..60),
    ) {
        let (mut mode, mut time_s) = (Mode::power_up(0.0), 0.0);
        let mut started_since_the_hold = true;
        for (event, later_s) in events {
            time_s += later_s;
            let held = mode.hold.is_some();
            let answer = transition(&mode, event, time_s);
            prop_assert!(!(held && answer.effects.contains(Effect::IgniteLandingMotor)));
            prop_assert!(!(held && answer.effects.contains(Effect::IgniteAscentMotor)));
            if answer.effects.contains(Effect::HoldCountdown) {
                started_since_the_hold = false;
            }
            started_since_the_hold |= answer.effects.contains(Effect::StartCountdown);
            prop_assert!(started_since_the_hold || answer.mode.countdown_end_s.is_none());
            prop_assert!(answer.mode.hold.is_none() || answer.mode.phase == Phase::PadArmed);
            mode = answer.mode;
        }
    }
}

/// An abort 20 s before a power-up with the pin out, and in.
#[test]
fn after_an_abort_before_power_up_the_wait_and_the_pin_are_still_due() {
    let mut mode = Mode { aborted_before_s: Some(-20.0), ..Mode::power_up(0.0) };
    let mut happen = |event, time_s| {
        let answer = transition(&mode, event, time_s);
        assert_eq!(answer.refusal, None, "{event:?}");
        mode = answer.mode;
        (mode.approach_wait_s(time_s), mode.abort_to_save_s(time_s), mode.aborted_before_s)
    };
    let (kept, due) = (Some(-20.0), Some(-20.0));
    assert_eq!(happen(Event::PinPulled, 0.0), (Some(40.0), kept, due), "it was out at power-up");
    assert_eq!(happen(Event::SelfTestPassed, 2.0), (Some(38.0), kept, due));
    // Put in too soon, and pulled too soon.
    assert_eq!(happen(Event::PinInserted, 10.0), (Some(30.0), kept, due));
    assert_eq!(happen(Event::PinPulled, 39.0), (Some(1.0), kept, due));
    assert_eq!(happen(Event::PinInserted, 41.0), (Some(0.0), None, due), "a power cycle forgets it now");
    assert_eq!(happen(Event::PinPulled, 50.0), (Some(0.0), None, None));
}

#[test]
fn an_abort_on_the_pad_is_saved_until_its_wait_is_over_and_the_pin_is_in() {
    let aborted = transition(&in_order(Phase::PadArmed), ABORT, 100.0).mode;
    assert_eq!(aborted.abort_to_save_s(500.0), Some(100.0));
    let pinned = transition(&aborted, Event::PinInserted, 120.0).mode;
    assert_eq!((pinned.abort_to_save_s(159.0), pinned.abort_to_save_s(160.0)), (Some(100.0), None));
    assert_eq!(in_order(Phase::PadIdle).abort_to_save_s(1.0), None);
}
