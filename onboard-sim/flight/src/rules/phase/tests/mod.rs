use proptest::prelude::*;

use super::*;

/// Every event, with every combination of its flags.
fn every_event() -> Vec<Event> {
    let flags = [false, true];
    let mut events = vec![
        Event::SelfTestPassed,
        Event::PinPulled,
        Event::PinInserted,
        Event::StartRequested { countdown_s: 5.0, checks_passed: true },
        Event::CountdownElapsed,
        Event::ReleasedAt(StartPoint::Pad),
        Event::ReleasedAt(StartPoint::Apogee),
        Event::ReleasedAt(StartPoint::Drone),
        Event::LiftOff,
        Event::NoLiftOff,
        Event::Burnout,
        Event::SeparationDue,
        Event::FinsConfirmed,
        Event::LandArm,
        Event::ThrustConfirmed,
        Event::NoThrustTimeout,
        Event::SafingDone,
        Event::Hold { cause: HoldCause::UplinkSilent, start: StartPoint::Pad },
        Event::Hold { cause: HoldCause::Commanded, start: StartPoint::Pad },
        Event::Hold { cause: HoldCause::Commanded, start: StartPoint::Drone },
        Event::HoldElapsed,
    ];
    for flag in flags {
        events.push(Event::DisarmRequested { lifted_off: flag });
        events.push(Event::ArmRequested { checks_passed: flag });
        events.push(Event::IgnitionGate { open: flag });
        events.push(Event::Contact { thrust_below_weight: flag });
        events.push(Event::GateShutForGood { parachute_fills: flag });
        events.push(Event::ReleasedEarly { parachute_fills: flag });
        events.push(Event::Apogee { booster_attached: flag });
        for gate_open in flags {
            for lifted_off in flags {
                events.push(Event::AbortRequested { lifted_off, above_commit_height: flag, gate_open });
            }
        }
    }
    events
}

/// A vehicle in the phase, with everything in order for the next phase.
fn in_order(phase: Phase) -> Mode {
    let armed = !matches!(phase, Phase::Safe | Phase::PadIdle | Phase::Safed);
    Mode {
        phase,
        interlocks: Interlocks { pin_out: true, armed, ..Interlocks::default() },
        motor: match phase {
            Phase::Ignition => Motor::Commanded,
            Phase::Powered => Motor::Burning,
            // The motor has cooled at `LATER_S`.
            Phase::Touchdown | Phase::Safed => Motor::BurntOut { at_s: LATER_S - MOTOR_HOT_S },
            _ => Motor::Unlit,
        },
        ..Mode::power_up(0.0)
    }
}

const LATER_S: f64 = 10.0;

#[expect(
    clippy::match_same_arms,
    reason = "rows of different phases stay apart even where they say the same"
)]
/// The next phase and the effects of an event for a vehicle with everything in order; `None` is a
/// refusal.
fn expected(phase: Phase, event: Event) -> Option<(Phase, &'static [Effect])> {
    use Effect::{
        DeployChute, Disarm, FinsOpen, IgniteLandingMotor, InhibitLandingMotor, RecordLoss, SeparateBooster,
        ShowPadWait, StartCountdown,
    };
    use Event as E;
    use Phase as P;
    let next: (Phase, &'static [Effect]) = match (phase, event) {
        (P::Safe, E::SelfTestPassed) => (P::PadIdle, &[]),
        (P::Safe | P::PadIdle | P::PadArmed | P::Touchdown | P::Safed, E::PinPulled)
        | (P::Safe | P::PadIdle | P::Touchdown | P::Safed, E::PinInserted) => (phase, &[]),
        (P::PadArmed, E::PinInserted | E::DisarmRequested { .. }) => (P::PadIdle, &[Disarm]),
        (P::PadIdle, E::ArmRequested { checks_passed: true }) => (P::PadArmed, &[]),
        (P::PadArmed, E::StartRequested { .. }) => (P::PadArmed, &[StartCountdown]),
        (P::PadArmed | P::Boost, E::LiftOff) => (P::Boost, &[]),
        (P::Safe | P::PadIdle, E::LiftOff) => (P::Boost, &[InhibitLandingMotor]),
        (
            P::Boost,
            E::NoLiftOff
            | E::DisarmRequested { lifted_off: false }
            | E::AbortRequested { lifted_off: false, .. },
        ) => (P::PadIdle, &[InhibitLandingMotor, Disarm, ShowPadWait]),
        (P::Safe | P::PadIdle | P::PadArmed, E::ReleasedEarly { parachute_fills: true }) => {
            (P::Chute, &[InhibitLandingMotor, FinsOpen, DeployChute])
        }
        (P::Safe | P::PadIdle | P::PadArmed, E::ReleasedEarly { parachute_fills: false }) => {
            (P::Chute, &[InhibitLandingMotor, FinsOpen, DeployChute, RecordLoss])
        }
        (P::Boost | P::Coast, E::SeparationDue) => (phase, &[SeparateBooster]),
        (P::Boost | P::Coast, E::Apogee { booster_attached: true }) => {
            (P::Chute, &[InhibitLandingMotor, DeployChute])
        }
        (P::Boost, E::Burnout) => (P::Coast, &[]),
        (P::Powered, E::Burnout) => (P::Powered, &[]),
        (P::Boost | P::Coast, E::Apogee { booster_attached: false }) => (P::Deploy, &[FinsOpen]),
        (P::Deploy, E::FinsConfirmed) => (P::AeroDescent, &[]),
        (P::AeroDescent, E::LandArm) | (P::LandArmed, E::IgnitionGate { open: false }) => (P::LandArmed, &[]),
        (P::LandArmed, E::IgnitionGate { open: true }) => (P::Ignition, &[IgniteLandingMotor]),
        (P::Ignition, E::ThrustConfirmed) => (P::Powered, &[]),
        (P::Ignition, E::NoThrustTimeout) => (P::Ignition, &[InhibitLandingMotor, FinsOpen, RecordLoss]),
        (P::Deploy | P::AeroDescent | P::LandArmed, E::GateShutForGood { parachute_fills: true }) => {
            (P::Chute, &[InhibitLandingMotor, FinsOpen, DeployChute])
        }
        (P::Deploy | P::AeroDescent | P::LandArmed, E::GateShutForGood { parachute_fills: false }) => {
            (P::Chute, &[InhibitLandingMotor, FinsOpen, DeployChute, RecordLoss])
        }
        (P::Safe | P::PadIdle, E::AbortRequested { .. }) => {
            (phase, &[InhibitLandingMotor, Disarm, ShowPadWait])
        }
        (P::PadArmed, E::AbortRequested { .. }) => (P::PadIdle, &[InhibitLandingMotor, Disarm, ShowPadWait]),
        (P::Boost | P::Coast, E::AbortRequested { .. }) => (phase, &[InhibitLandingMotor]),
        (P::Deploy | P::AeroDescent | P::LandArmed, E::AbortRequested { above_commit_height: true, .. }) => {
            (P::Chute, &[InhibitLandingMotor, FinsOpen, DeployChute])
        }
        (P::Deploy | P::AeroDescent | P::LandArmed, E::AbortRequested { gate_open: true, .. }) => {
            (phase, &[])
        }
        (P::Deploy | P::AeroDescent | P::LandArmed, E::AbortRequested { .. }) => {
            (phase, &[InhibitLandingMotor, FinsOpen, RecordLoss])
        }
        (P::Ignition | P::Powered, E::AbortRequested { .. }) => (phase, &[]),
        (
            P::Boost
            | P::Coast
            | P::Deploy
            | P::AeroDescent
            | P::LandArmed
            | P::Ignition
            | P::Powered
            | P::Chute,
            E::Contact { thrust_below_weight: true },
        ) => (P::Touchdown, &[InhibitLandingMotor]),
        (P::Touchdown, E::DisarmRequested { .. }) => (phase, &[Disarm]),
        (P::Touchdown, E::SafingDone) => (P::Safed, &[Disarm]),
        _ => return None,
    };
    Some(next)
}

#[test]
fn every_event_in_every_phase_has_the_result_of_the_table() {
    for phase in Phase::ALL {
        for event in every_event() {
            let mode = in_order(phase);
            let answer = transition(&mode, event, LATER_S);
            let context = format!("{} + {event:?}", phase.name());
            if let Some((to, effects)) = expected(phase, event) {
                assert_eq!(answer.refusal, None, "{context}");
                assert_eq!(answer.mode.phase, to, "{context}");
                assert_eq!(answer.effects, Effects::of(effects), "{context}");
            } else {
                let refusal = answer.refusal.unwrap_or_else(|| panic!("{context}: accepted"));
                assert!(!refusal.to_string().is_empty(), "{context}");
                assert_eq!((answer.mode, answer.effects), (mode, Effects::NONE), "{context}");
            }
        }
    }
}

/// Applies events in order, one second apart, from power-up, and expects each to be accepted.
fn after(events: &[Event]) -> Mode {
    events.iter().enumerate().fold(Mode::power_up(0.0), |mode, (second, event)| {
        let answer = transition(&mode, *event, second as f64);
        assert_eq!(answer.refusal, None, "{event:?} in {}", mode.phase.name());
        answer.mode
    })
}

const ARM: [Event; 3] =
    [Event::SelfTestPassed, Event::PinPulled, Event::ArmRequested { checks_passed: true }];

fn with_arm(rest: &[Event]) -> Vec<Event> {
    ARM.iter().chain(rest).copied().collect()
}

const ABORT: Event = Event::AbortRequested { lifted_off: true, above_commit_height: false, gate_open: false };

#[test]
fn the_countdown_must_run_out_before_a_release() {
    let mode = after(&with_arm(&[Event::StartRequested { countdown_s: 5.0, checks_passed: true }]));
    let release = Event::ReleasedAt(StartPoint::Apogee);
    assert_eq!(transition(&mode, release, 7.9).refusal, Some(Refusal::CountdownNotElapsed));
    assert_eq!(transition(&mode, release, 8.0).mode.phase, Phase::Deploy);
    assert_eq!(mode.countdown_remaining_s(6.0), Some(2.0));
    assert_eq!(
        transition(&mode, Event::StartRequested { countdown_s: 5.0, checks_passed: true }, 4.0).refusal,
        Some(Refusal::CountdownRunning)
    );
}

#[test]
fn a_countdown_must_be_a_number_of_seconds() {
    for countdown_s in [f64::NAN, f64::INFINITY, -1.0] {
        let answer =
            transition(&after(&ARM), Event::StartRequested { countdown_s, checks_passed: true }, 3.0);
        assert_eq!(answer.refusal, Some(Refusal::BadCountdown));
    }
}

#[test]
fn disarming_cancels_the_countdown_and_latches_nothing() {
    let counting = after(&with_arm(&[Event::StartRequested { countdown_s: 5.0, checks_passed: true }]));
    let answer = transition(&counting, Event::DisarmRequested { lifted_off: false }, 4.0);
    assert_eq!(answer.mode.phase, Phase::PadIdle);
    assert_eq!(answer.effects, Effects::of(&[Effect::Disarm, Effect::CancelCountdown]));
    assert_eq!(answer.mode.countdown_end_s, None);
    assert!(!answer.mode.interlocks.abort_latched);
    assert_eq!(transition(&answer.mode, ARM[2], 5.0).mode.phase, Phase::PadArmed);
}

#[test]
fn a_pad_abort_latches_and_shows_the_wait() {
    let mode = after(&with_arm(&[ABORT]));
    assert_eq!(mode.phase, Phase::PadIdle);
    assert!(
        !mode.interlocks.armed && mode.interlocks.landing_motor_inhibited && mode.interlocks.abort_latched
    );
    assert_eq!(mode.pad_wait_remaining_s(13.0), Some(50.0));
    assert_eq!(mode.pad_wait_remaining_s(63.0), None);
    let refusal = transition(&mode, ARM[2], 100.0).refusal;
    assert_eq!(refusal, Some(Refusal::AbortLatched));
}

#[test]
fn a_refused_arming_gives_the_reason() {
    let reason = |mode: &Mode, checks_passed| {
        transition(mode, Event::ArmRequested { checks_passed }, 9.0)
            .refusal
            .map(|refusal| refusal.to_string())
    };
    let idle = after(&ARM[..1]);
    assert_eq!(reason(&idle, true).unwrap(), "the pin is in: pull it before arming");
    assert_eq!(reason(&after(&ARM[..2]), false).unwrap(), "an arming check failed");
    assert_eq!(reason(&in_order(Phase::Powered), true).unwrap(), "cannot arm in POWERED: only PAD_IDLE arms");
}

#[test]
fn after_an_abort_under_thrust_the_vehicle_lands_in_place_and_the_phase_stays() {
    let aborted = transition(&in_order(Phase::Powered), ABORT, 1.0);
    assert_eq!(aborted.mode.phase, Phase::Powered);
    assert!(aborted.mode.interlocks.lands_in_place && aborted.effects.is_empty());
    assert_eq!(transition(&aborted.mode, ABORT, 2.0).refusal, Some(Refusal::AlreadyAborted));
    let burns = Event::AbortRequested { lifted_off: false, above_commit_height: false, gate_open: true };
    let falls = transition(&in_order(Phase::LandArmed), burns, 1.0).mode;
    assert!(falls.phase == Phase::LandArmed && falls.interlocks.lands_in_place);
    let ignition = transition(&falls, Event::IgnitionGate { open: true }, 2.0);
    assert!(ignition.mode.phase == Phase::Ignition && ignition.mode.interlocks.lands_in_place);
    assert_eq!(ignition.effects, Effects::of(&[Effect::IgniteLandingMotor]));
    let room = Event::AbortRequested { lifted_off: false, above_commit_height: true, gate_open: true };
    let chute = transition(&falls, room, 2.0).mode;
    assert!(chute.phase == Phase::Chute && chute.interlocks.landing_motor_inhibited, "a gust lifted it");
}

#[test]
fn no_light_is_latched_once_and_a_late_light_still_counts() {
    let dark = transition(&in_order(Phase::Ignition), Event::NoThrustTimeout, 1.0).mode;
    assert!(dark.interlocks.no_light_latched && dark.interlocks.landing_motor_inhibited);
    let again = transition(&dark, Event::NoThrustTimeout, 1.1);
    assert!(again.effects.is_empty() && again.mode == dark);
    assert_eq!(transition(&dark, Event::ThrustConfirmed, 1.2).mode.phase, Phase::Powered);
}

#[test]
fn names_and_numbers_of_phases_are_one_to_one() {
    for (index, phase) in Phase::ALL.into_iter().enumerate() {
        assert_eq!(usize::from(phase.index()), index);
        assert_eq!(Phase::from_index(phase.index()), Some(phase));
    }
    assert_eq!(Phase::from_index(13), None);
}

#[test]
fn a_set_of_effects_lists_exactly_its_members() {
    let effects = Effects::of(&[Effect::RecordLoss, Effect::IgniteAscentMotor]);
    assert_eq!(effects.iter().collect::<Vec<_>>(), [Effect::IgniteAscentMotor, Effect::RecordLoss]);
}

#[test]
fn each_way_to_an_inhibited_motor_has_its_cause() {
    let counting = after(&with_arm(&[Event::StartRequested { countdown_s: 5.0, checks_passed: true }]));
    for (mode, event, cause) in [
        (counting, ABORT, Latch::Commanded),
        (in_order(Phase::Powered), ABORT, Latch::Commanded),
        (in_order(Phase::PadIdle), Event::LiftOff, Latch::UncommandedLiftOff),
        (counting, Event::ReleasedEarly { parachute_fills: true }, Latch::UncommandedRelease),
        (in_order(Phase::Coast), Event::Apogee { booster_attached: true }, Latch::NoSeparation),
        (in_order(Phase::LandArmed), Event::GateShutForGood { parachute_fills: false }, Latch::Gate),
        (in_order(Phase::Ignition), Event::NoThrustTimeout, Latch::NoLight),
        (in_order(Phase::Boost), Event::NoLiftOff, Latch::Other),
    ] {
        let answer = transition(&mode, event, 6.5);
        assert_eq!(Latch::of(&event, mode.interlocks, answer.mode.interlocks), Some(cause), "{event:?}");
    }
    // A touchdown inhibits the motor, as it should.
    let down = transition(&in_order(Phase::Powered), Event::Contact { thrust_below_weight: true }, 6.5);
    assert!(down.mode.interlocks.landing_motor_inhibited);
    let event = Event::Contact { thrust_below_weight: true };
    assert_eq!(Latch::of(&event, in_order(Phase::Powered).interlocks, down.mode.interlocks), None);
}

mod ground;

fn any_event() -> impl Strategy<Value = Event> {
    prop::sample::select(every_event())
}

/// Events that advance the flight, so that random sequences reach the late phases too.
fn likely_event() -> impl Strategy<Value = Event> {
    let leading = with_arm(&[
        Event::StartRequested { countdown_s: 1.0, checks_passed: true },
        Event::ReleasedAt(StartPoint::Apogee),
        Event::FinsConfirmed,
        Event::LandArm,
        Event::IgnitionGate { open: true },
        Event::LiftOff,
        Event::Apogee { booster_attached: false },
        Event::Hold { cause: HoldCause::UplinkSilent, start: StartPoint::Pad },
        Event::ThrustConfirmed,
        Event::Contact { thrust_below_weight: true },
    ]);
    prop_oneof![prop::sample::select(leading), any_event()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn in_any_sequence_of_events_the_landing_motor_is_ignited_at_most_once_and_after_every_gate(
        events in prop::collection::vec(likely_event(), 0..60),
    ) {
        let mut mode = Mode::power_up(0.0);
        let (mut ignitions, mut ascents, mut latch) = (0, 0, None);
        for (second, event) in events.into_iter().enumerate() {
            let answer = transition(&mode, event, second as f64);
            if answer.effects.contains(Effect::IgniteAscentMotor) {
                ascents += 1;
                prop_assert!(ascents == 1 && mode.interlocks.armed && answer.mode.phase == Phase::Boost);
            }
            if answer.effects.contains(Effect::IgniteLandingMotor) {
                ignitions += 1;
                let locks = mode.interlocks;
                prop_assert!(locks.armed && locks.pin_out);
                prop_assert!(!locks.landing_motor_inhibited && (!locks.abort_latched || locks.lands_in_place));
                prop_assert!(mode.phase.in_descent());
                prop_assert_eq!(event, Event::IgnitionGate { open: true });
                prop_assert_eq!(answer.mode.phase, Phase::Ignition);
            }
            if answer.effects.contains(Effect::DeployChute) {
                prop_assert!(!mode.phase.in_landing_burn(), "parachute under thrust");
            }
            let (before, after) = (mode.interlocks, answer.mode.interlocks);
            if answer.refusal.is_none() {
                latch = latch.or_else(|| Latch::of(&event, before, after));
            }
            prop_assert_eq!(latch.is_some(), after.abort_latched || after.no_light_latched, "a latch without a cause");
            prop_assert!(!before.abort_latched || after.abort_latched, "an abort latch was cleared");
            prop_assert!(!before.landing_motor_inhibited || after.landing_motor_inhibited, "an inhibit was cleared");
            if answer.refusal.is_some() {
                prop_assert_eq!(answer.mode, mode);
                prop_assert!(answer.effects.is_empty());
            }
            mode = answer.mode;
        }
        prop_assert!(ignitions <= 1);
    }
}
