//! The transition table.

use super::{Effect, Effects, Event, Hold, Interlocks, Mode, Motor, Phase, Refusal, StartPoint};

/// The result of an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// The mode afterwards; unchanged if refused.
    pub mode: Mode,
    pub effects: Effects,
    /// The reason, if refused.
    pub refusal: Option<Refusal>,
}

/// One row of the table.
enum Row {
    /// Accepted: the mode with edited latches and countdown, the next phase, and the effects.
    Go(Mode, Phase, Effects),
    Refuse(Refusal),
}

/// The mode after `event` at vehicle time `time_s`.
///
/// The function is total and pure: it has a result for every event in every phase.
pub fn transition(mode: &Mode, event: Event, time_s: f64) -> Transition {
    match row(mode, event, time_s) {
        Row::Go(mut next, phase, effects) => {
            // For every row that ignites the motor.
            if effects.contains(Effect::IgniteLandingMotor) {
                next.motor = Motor::Commanded;
            }
            // A hold exists only in PAD_ARMED, so it ends with that phase.
            if phase != Phase::PadArmed {
                next.hold = None;
            }
            if phase != mode.phase {
                next.phase = phase;
                next.entered_at_s = time_s;
            }
            Transition { mode: next, effects, refusal: None }
        }
        Row::Refuse(refusal) => Transition { mode: *mode, effects: Effects::NONE, refusal: Some(refusal) },
    }
}

#[expect(
    clippy::match_same_arms,
    reason = "rows of different phases stay apart even where they say the same"
)]
#[expect(clippy::too_many_lines, reason = "one table, read as one")]
fn row(mode: &Mode, event: Event, time_s: f64) -> Row {
    use Event as E;
    use Phase as P;
    let phase = mode.phase;
    let locks = mode.interlocks;
    let go = |to: Phase| Row::Go(*mode, to, Effects::NONE);
    let go_with = |to: Phase, effects: &[Effect]| goes(*mode, to, effects);
    let wrong = |action, only| Row::Refuse(Refusal::WrongPhase { action, phase, only });
    let latch = |interlocks: Interlocks| Mode { interlocks, ..*mode };

    match (phase, event) {
        // On the pad.
        (P::Safe, E::SelfTestPassed) => go(P::PadIdle),
        (_, E::SelfTestPassed) => wrong("pass the self-test", "only SAFE waits for it"),

        (P::Safe | P::PadIdle | P::PadArmed, E::PinPulled) => {
            // A pin that is out at power-up was not put in after the wait.
            let was_in = phase == P::PadIdle && mode.pad_wait_remaining_s(time_s).is_none();
            let aborted_before_s = mode.aborted_before_s.filter(|_| !was_in);
            let pulled = Mode { aborted_before_s, ..latch(Interlocks { pin_out: true, ..locks }) };
            goes(pulled, phase, &[])
        }
        (P::Safe | P::PadIdle | P::Touchdown | P::Safed, E::PinInserted) => {
            goes(latch(Interlocks { pin_out: false, ..locks }), phase, &[])
        }
        (P::PadArmed, E::PinInserted) => disarmed(&latch(Interlocks { pin_out: false, ..locks })),
        // After the flight a person may insert the pin and pull it again. Without the pin, an
        // unignited motor is live.
        (P::Touchdown | P::Safed, E::PinPulled) => {
            let burnt = matches!(mode.motor, Motor::BurntOut { .. });
            let to = if burnt { phase } else { P::Touchdown };
            goes(latch(Interlocks { pin_out: true, ..locks }), to, &[])
        }
        (_, E::PinPulled | E::PinInserted) => wrong("move the pin", "it moves on the ground only"),

        (P::PadIdle, E::ArmRequested { .. }) if locks.abort_latched => Row::Refuse(Refusal::AbortLatched),
        (P::PadIdle, E::ArmRequested { .. }) if !locks.pin_out => Row::Refuse(Refusal::PinIn),
        (P::PadIdle, E::ArmRequested { checks_passed: false }) => Row::Refuse(Refusal::ChecksFailed),
        (P::PadIdle, E::ArmRequested { checks_passed: true }) => {
            goes(latch(Interlocks { armed: true, ..locks }), P::PadArmed, &[])
        }
        (_, E::ArmRequested { .. }) => wrong("arm", "only PAD_IDLE arms"),

        (P::PadArmed, E::DisarmRequested { .. }) => disarmed(mode),
        // On the ground nothing is ignited any more, but that does not make the motor safe.
        (P::Touchdown, E::DisarmRequested { .. }) => {
            goes(latch(Interlocks { armed: false, ..locks }), phase, &[Effect::Disarm])
        }
        // The igniter was energised: an abort's effects are the minimum.
        (P::Boost, E::DisarmRequested { lifted_off: false }) if !locks.abort_latched => {
            stays_on_its_pad(mode)
        }
        (_, E::DisarmRequested { .. }) => {
            wrong("disarm", "only PAD_ARMED, BOOST before the lift-off, and TOUCHDOWN disarm")
        }

        (P::PadArmed, E::StartRequested { countdown_s, checks_passed }) => match mode.countdown_end_s {
            Some(_) => Row::Refuse(Refusal::CountdownRunning),
            None if !checks_passed => Row::Refuse(Refusal::ChecksFailed),
            None if !(countdown_s.is_finite() && countdown_s >= 0.0) => Row::Refuse(Refusal::BadCountdown),
            None => goes(
                Mode { countdown_end_s: Some(time_s + countdown_s), hold: None, ..*mode },
                phase,
                &[Effect::StartCountdown],
            ),
        },
        (_, E::StartRequested { .. }) => wrong("start", "only PAD_ARMED starts a countdown"),

        // A hold cancels the countdown: only a new start counts down again.
        (P::PadArmed, E::Hold { cause, start }) => match (mode.countdown_end_s, mode.hold) {
            (Some(_), _) if !mode.may_hold_for(cause, start, time_s) => Row::Refuse(Refusal::TooLateToHold),
            (Some(_), _) => goes(
                Mode { countdown_end_s: None, hold: Some(Hold { cause, at_s: time_s }), ..*mode },
                phase,
                &[Effect::HoldCountdown],
            ),
            (None, Some(_)) => Row::Refuse(Refusal::AlreadyHeld),
            (None, None) => Row::Refuse(Refusal::NoCountdown),
        },
        (_, E::Hold { .. }) => wrong("hold", "only a countdown in PAD_ARMED is held"),
        (P::PadArmed, E::HoldElapsed) => match mode.held(time_s) {
            Some((_, left_s)) if left_s <= 0.0 => disarmed(mode),
            _ => Row::Refuse(Refusal::HoldNotOver),
        },
        (_, E::HoldElapsed) => wrong("end a hold", "only PAD_ARMED is held"),

        // From here on the vehicle must not be approached, because the motor may ignite late.
        (P::PadArmed, E::CountdownElapsed) if countdown_over(mode, time_s) => {
            goes(Mode { countdown_end_s: None, ..*mode }, P::Boost, &[Effect::IgniteAscentMotor])
        }
        // A drone's pilot lets go when he likes, but not before the countdown is over, and not
        // while it is held.
        (P::PadArmed, E::ReleasedAt(StartPoint::Apogee | StartPoint::Drone))
            if countdown_over(mode, time_s) =>
        {
            goes(Mode { countdown_end_s: None, ..*mode }, P::Deploy, &[Effect::FinsOpen])
        }
        (P::PadArmed, E::CountdownElapsed | E::ReleasedAt(StartPoint::Apogee | StartPoint::Drone)) => {
            Row::Refuse(Refusal::CountdownNotElapsed)
        }
        (_, E::CountdownElapsed) => wrong("end a countdown", "only PAD_ARMED counts down"),
        (_, E::ReleasedAt(StartPoint::Pad)) => wrong("release at the pad", "a pad start lifts off by itself"),
        (_, E::ReleasedAt(_)) => wrong("release", "only PAD_ARMED is released"),
        // It falls, whatever the crew intended: without its motor, under the parachute if that
        // still helps.
        (P::Safe | P::PadIdle | P::PadArmed, E::ReleasedEarly { parachute_fills }) => {
            down_without_the_motor(mode, parachute_fills)
        }
        (_, E::ReleasedEarly { .. }) => wrong("release early", "only a hanging vehicle is released"),

        // Ascent.
        // Also without a countdown: a rising vehicle must be controlled.
        (P::PadArmed, E::LiftOff) => goes(Mode { countdown_end_s: None, ..*mode }, P::Boost, &[]),
        // An uncommanded lift-off, or a late ignition after an abort: the vehicle rises, and
        // descends under the parachute.
        (P::Safe | P::PadIdle, E::LiftOff) => goes(inhibited(mode), P::Boost, &[Effect::InhibitLandingMotor]),
        (P::Boost, E::LiftOff) => go(phase),
        (_, E::LiftOff) => wrong("lift off", "only a vehicle on its pad and BOOST lift off"),
        (P::Boost, E::NoLiftOff) => stays_on_its_pad(mode),
        (_, E::NoLiftOff) => wrong("miss the lift-off", "only BOOST waits for it"),
        (P::Boost, E::Burnout) => go(P::Coast),
        // Burnout of the landing motor, which occurs once; ground contact decides what follows.
        (P::Powered | P::Touchdown, E::Burnout) if mode.motor == Motor::Burning => {
            goes(Mode { motor: Motor::BurntOut { at_s: time_s }, ..*mode }, phase, &[])
        }
        (P::Powered, E::Burnout) => go(phase),
        (_, E::Burnout) => wrong("burn out", "only BOOST, POWERED and a motor still burning in TOUCHDOWN do"),
        (P::Boost | P::Coast, E::SeparationDue) => go_with(phase, &[Effect::SeparateBooster]),
        (_, E::SeparationDue) => wrong("separate the booster", "only BOOST and COAST have one"),
        (P::Boost | P::Coast, E::Apogee { .. }) if locks.abort_latched => {
            go_with(P::Chute, &[Effect::DeployChute])
        }
        // A vehicle with its booster can neither steer nor land.
        (P::Boost | P::Coast, E::Apogee { booster_attached: true }) => {
            goes(inhibited(mode), P::Chute, &[Effect::InhibitLandingMotor, Effect::DeployChute])
        }
        (P::Boost | P::Coast, E::Apogee { booster_attached: false }) => {
            go_with(P::Deploy, &[Effect::FinsOpen])
        }
        (_, E::Apogee { .. }) => wrong("pass apogee", "only BOOST and COAST rise"),

        // Descent.
        (P::Deploy, E::FinsConfirmed) => go(P::AeroDescent),
        (_, E::FinsConfirmed) => wrong("confirm the fins", "only DEPLOY waits for them"),
        (P::AeroDescent, E::LandArm) => may_light(locks, || go(P::LandArmed)),
        (_, E::LandArm) => wrong("arm for landing", "only AERO_DESCENT does"),
        (P::LandArmed, E::IgnitionGate { open: false }) => go(phase),
        (P::LandArmed, E::IgnitionGate { open: true }) => {
            may_light(locks, || go_with(P::Ignition, &[Effect::IgniteLandingMotor]))
        }
        (_, E::IgnitionGate { .. }) => wrong("ignite", "only LAND_ARMED ignites, once"),
        (P::Deploy | P::AeroDescent | P::LandArmed, E::GateShutForGood { parachute_fills }) => {
            down_without_the_motor(mode, parachute_fills)
        }
        (_, E::GateShutForGood { .. }) => wrong("give up the ignition", "only a descent waits for it"),

        // Landing burn. A late light after "no light" counts as thrust, too.
        (P::Ignition, E::ThrustConfirmed) => goes(Mode { motor: Motor::Burning, ..*mode }, P::Powered, &[]),
        (_, E::ThrustConfirmed) => wrong("confirm thrust", "only IGNITION waits for it"),
        (P::Ignition, E::NoThrustTimeout) if !locks.no_light_latched => goes(
            latch(Interlocks { no_light_latched: true, landing_motor_inhibited: true, ..locks }),
            phase,
            &[Effect::InhibitLandingMotor, Effect::FinsOpen, Effect::RecordLoss],
        ),
        (P::Ignition, E::NoThrustTimeout) => go(phase),
        (_, E::NoThrustTimeout) => wrong("miss thrust", "only IGNITION waits for it"),

        (_, E::AbortRequested { lifted_off, above_commit_height, gate_open }) => {
            abort(mode, lifted_off, above_commit_height, gate_open, time_s)
        }

        // Ground.
        (P::Safe | P::PadIdle | P::PadArmed | P::Touchdown | P::Safed, E::Contact { .. }) => {
            wrong("touch down", "only a vehicle in the air touches down")
        }
        (_, E::Contact { thrust_below_weight: false }) => Row::Refuse(Refusal::ThrustAboveWeight),
        (_, E::Contact { thrust_below_weight: true }) => goes(
            latch(Interlocks { landing_motor_inhibited: true, ..locks }),
            P::Touchdown,
            &[Effect::InhibitLandingMotor],
        ),
        (P::Touchdown, E::SafingDone) => {
            if let Err(refusal) = mode.may_be_safed(time_s) {
                return Row::Refuse(refusal);
            }
            let effects = if locks.armed { Effects::of(&[Effect::Disarm]) } else { Effects::NONE };
            Row::Go(latch(Interlocks { armed: false, ..locks }), P::Safed, effects)
        }
        (_, E::SafingDone) => wrong("safe", "only TOUCHDOWN is made safe"),
    }
}

/// Effects of changing from a descent to the parachute.
const TO_THE_PARACHUTE: [Effect; 3] = [Effect::InhibitLandingMotor, Effect::FinsOpen, Effect::DeployChute];

/// A row with its effects.
fn goes(mode: Mode, to: Phase, effects: &[Effect]) -> Row {
    Row::Go(mode, to, Effects::of(effects))
}

/// Without the motor only the parachute brakes: too low to fill, it still takes off some of the
/// speed.
fn down_without_the_motor(mode: &Mode, parachute_fills: bool) -> Row {
    let lost = [Effect::InhibitLandingMotor, Effect::FinsOpen, Effect::DeployChute, Effect::RecordLoss];
    goes(inhibited(mode), Phase::Chute, if parachute_fills { &TO_THE_PARACHUTE } else { &lost })
}

/// Permanently inhibits the landing motor.
fn inhibited(mode: &Mode) -> Mode {
    Mode {
        interlocks: Interlocks { landing_motor_inhibited: true, abort_latched: true, ..mode.interlocks },
        countdown_end_s: None,
        ..*mode
    }
}

/// The ascent motor's igniter was energised and is off. As after an abort on the pad, the motor may
/// still ignite. If it does, the vehicle rises as if unarmed.
fn stays_on_its_pad(mode: &Mode) -> Row {
    let inhibited = inhibited(mode);
    let interlocks = Interlocks { armed: false, ..inhibited.interlocks };
    let effects = [Effect::InhibitLandingMotor, Effect::Disarm, Effect::ShowPadWait];
    goes(Mode { interlocks, ..inhibited }, Phase::PadIdle, &effects)
}

/// The abort column: the effect of an abort in each phase.
#[expect(
    clippy::match_same_arms,
    reason = "rows of different phases stay apart even where they say the same"
)]
fn abort(mode: &Mode, lifted_off: bool, above_commit_height: bool, gate_open: bool, time_s: f64) -> Row {
    use Phase as P;
    let phase = mode.phase;
    let locks = mode.interlocks;
    let may_burn = gate_open && locks.armed && !locks.landing_motor_inhibited && !locks.abort_latched;
    let inhibited = inhibited(mode);
    match phase {
        P::Touchdown | P::Safed => {
            Row::Refuse(Refusal::WrongPhase { action: "abort", phase, only: "the vehicle is on the ground" })
        }
        P::Chute => {
            Row::Refuse(Refusal::WrongPhase { action: "abort", phase, only: "the parachute is out already" })
        }
        // An ignited motor cannot be stopped, and a parachute under thrust would burn or tangle. So
        // the vehicle lands.
        P::Ignition | P::Powered if locks.lands_in_place => Row::Refuse(Refusal::AlreadyAborted),
        P::Ignition | P::Powered => {
            let interlocks = Interlocks { abort_latched: true, lands_in_place: true, ..locks };
            goes(Mode { interlocks, ..*mode }, phase, &[])
        }
        P::Safe | P::PadIdle | P::PadArmed if locks.abort_latched => Row::Refuse(Refusal::AlreadyAborted),
        P::Safe | P::PadIdle | P::PadArmed => {
            let interlocks = Interlocks { armed: false, ..inhibited.interlocks };
            let effects = [Effect::InhibitLandingMotor, Effect::Disarm, Effect::ShowPadWait];
            let to = if phase == P::PadArmed { P::PadIdle } else { phase };
            // The wait runs from the abort, even if the phase stays.
            goes(Mode { interlocks, entered_at_s: time_s, ..inhibited }, to, &effects)
        }
        P::Boost | P::Coast if locks.abort_latched => Row::Refuse(Refusal::AlreadyAborted),
        P::Boost if !lifted_off => stays_on_its_pad(mode),
        P::Boost | P::Coast => goes(inhibited, phase, &[Effect::InhibitLandingMotor]),
        // A repeated abort on the way down may still have enough height for the parachute.
        P::Deploy | P::AeroDescent | P::LandArmed if above_commit_height => {
            goes(inhibited, P::Chute, &TO_THE_PARACHUTE)
        }
        P::Deploy | P::AeroDescent | P::LandArmed if locks.abort_latched => {
            Row::Refuse(Refusal::AlreadyAborted)
        }
        // Too low for the parachute: a landing on the motor is the safest option, and the chosen
        // height the safest one for ignition. Of mk2 flights aborted here at a random moment 992 of
        // 1,000 (`field`) and 903 of 999 (`real`) land; with immediate ignition, 852 and 737 of
        // them (seed 2001).
        P::Deploy | P::AeroDescent | P::LandArmed if may_burn => {
            let interlocks = Interlocks { abort_latched: true, lands_in_place: true, ..locks };
            goes(Mode { interlocks, ..*mode }, phase, &[])
        }
        P::Deploy | P::AeroDescent | P::LandArmed => {
            goes(inhibited, phase, &[Effect::InhibitLandingMotor, Effect::FinsOpen, Effect::RecordLoss])
        }
    }
}

fn disarmed(mode: &Mode) -> Row {
    let interlocks = Interlocks { armed: false, ..mode.interlocks };
    let effects = match mode.countdown_end_s {
        Some(_) => Effects::of(&[Effect::Disarm, Effect::CancelCountdown]),
        None => Effects::of(&[Effect::Disarm]),
    };
    Row::Go(Mode { interlocks, countdown_end_s: None, ..*mode }, Phase::PadIdle, effects)
}

fn countdown_over(mode: &Mode, time_s: f64) -> bool {
    mode.countdown_end_s.is_some_and(|end_s| time_s >= end_s)
}

/// The interlocks of the landing motor that hold in every phase.
fn may_light(locks: Interlocks, row: impl FnOnce() -> Row) -> Row {
    // An abort too low for the parachute lands on the motor.
    let aborted = locks.abort_latched && !locks.lands_in_place;
    if !locks.armed {
        Row::Refuse(Refusal::NotArmed)
    } else if aborted {
        Row::Refuse(Refusal::AbortLatched)
    } else if locks.landing_motor_inhibited {
        Row::Refuse(Refusal::LandingMotorInhibited)
    } else {
        row()
    }
}
