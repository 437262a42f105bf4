//! Holds: after a hold only a new start counts down again.

use super::*;

const SILENT: Event = hold(HoldCause::UplinkSilent, StartPoint::Pad);
const START: Event = Event::StartRequested { countdown_s: 5.0 };
const CAUSES: [HoldCause; 3] = [HoldCause::UplinkSilent, HoldCause::Commanded, HoldCause::TapOverdue];

const fn hold(cause: HoldCause, start: StartPoint) -> Event {
    Event::Hold { cause, start }
}

/// Armed at 2 s, the countdown started at 3 s, held at 4 s.
fn held() -> Mode {
    after(&with_arm(&[START, SILENT]))
}

#[test]
fn a_hold_clears_the_countdown_and_keeps_the_vehicle_armed() {
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
fn in_the_last_two_seconds_nothing_holds_and_an_abort_and_a_disarm_still_end_it() {
    let counting = after(&with_arm(&[START]));
    for cause in CAUSES {
        for start in [StartPoint::Pad, StartPoint::Apogee] {
            assert_eq!(transition(&counting, hold(cause, start), 5.99).refusal, None);
            for time_s in [6.0, 7.0, 8.0, 9.0, f64::NAN] {
                let late = transition(&counting, hold(cause, start), time_s);
                assert_eq!((late.refusal, late.mode), (Some(Refusal::TooLateToHold), counting), "{time_s}");
            }
        }
    }
    for time_s in [6.0, 7.9, 8.0] {
        for event in [ABORT, Event::DisarmRequested, Event::PinInserted] {
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

#[test]
fn every_event_that_leaves_pad_armed_ends_the_hold() {
    for event in [Event::DisarmRequested, Event::PinInserted, ABORT, Event::LiftOff] {
        let answer = transition(&held(), event, 9.0);
        assert_eq!((answer.refusal, answer.mode.hold), (None, None), "{event:?}");
    }
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
            // During a hold nothing is released or lit, except for a vehicle that already rises or falls.
            if mode.hold.is_some() {
                let lit = [Effect::IgniteAscentMotor, Effect::IgniteLandingMotor];
                assert!(!lit.into_iter().any(|effect| answer.effects.contains(effect)), "{context}");
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
