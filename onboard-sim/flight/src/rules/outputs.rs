//! The pyrotechnic outputs: both igniters, the separation charge and the parachute.
//!
//! [`Outputs::decided`] is the only function that switches one of them on. The flight computer
//! calls it once, at the end of a frame, when the crew has been answered and the phase is settled.
//! An output is energised unless [an inhibit](why_not) applies, so each lists all of its inhibits.
//! They repeat latches that the [phase table](crate::rules::phase) has checked already: an error
//! there alone ignites nothing.

use serde::{Deserialize, Serialize};

use crate::rules::phase::{Mode, Motor, Phase};

/// A pyrotechnic output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PyroOutput {
    LandingIgniter,
    Parachute,
    AscentIgniter,
    /// The charge between booster and vehicle.
    Separation,
}

impl PyroOutput {
    /// Ordered by number, which is the index in [`Outputs`] and in the digest.
    pub const ALL: [Self; 4] = [Self::LandingIgniter, Self::Parachute, Self::AscentIgniter, Self::Separation];
}

/// What the outputs depend on besides the mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlightProgress {
    /// The frame is part of a flight; the frame in which the countdown ends is not.
    pub flying: bool,
    /// The vehicle has left its rail.
    pub lifted_off: bool,
    /// Apogee is near, or has passed: the booster is to be separated.
    pub separation_due: bool,
    /// The time of the landing igniter's current has not passed.
    pub igniting: bool,
    /// The fins, which close over the parachute hatch, are clear of it, or have had the time to
    /// open.
    pub hatch_free: bool,
}

/// All inhibits of an output; with none it is energised.
pub fn why_not(
    output: PyroOutput,
    mode: &Mode,
    progress: FlightProgress,
) -> impl Iterator<Item = &'static str> {
    let Mode { phase, interlocks: locks, motor, .. } = *mode;
    let reasons = [
        (PyroOutput::AscentIgniter, phase != Phase::Boost, "only BOOST lights the ascent motor"),
        (PyroOutput::AscentIgniter, !progress.flying, "the flight begins with the next frame"),
        (PyroOutput::AscentIgniter, progress.lifted_off, "the vehicle has lifted off"),
        (PyroOutput::AscentIgniter, !locks.armed, "not armed"),
        (PyroOutput::AscentIgniter, !locks.pin_out, "the pin is in"),
        (PyroOutput::AscentIgniter, locks.abort_latched, "an abort is latched"),
        // The current lasts its full time: sensed thrust may be a knock before the motor ignites.
        (PyroOutput::LandingIgniter, !phase.in_landing_burn(), "only the landing burn ignites its motor"),
        (PyroOutput::LandingIgniter, !progress.igniting, "the igniter's time is over"),
        (PyroOutput::LandingIgniter, locks.landing_motor_inhibited, "the landing motor is inhibited"),
        (PyroOutput::LandingIgniter, !locks.armed, "not armed"),
        (PyroOutput::LandingIgniter, !locks.pin_out, "the pin is in"),
        // An abort too low for the parachute lands on the motor, as does one after the ignition
        // command.
        (PyroOutput::LandingIgniter, locks.abort_latched && !locks.lands_in_place, "an abort is latched"),
        (PyroOutput::Separation, !progress.separation_due, "apogee is not near"),
        (PyroOutput::Separation, phase.on_pad(), "the vehicle is on its pad"),
        (PyroOutput::Parachute, phase != Phase::Chute, "only CHUTE ejects the parachute"),
        (PyroOutput::Parachute, motor == Motor::Burning, "the landing motor burns"),
        (PyroOutput::Parachute, !progress.hatch_free, "the fins are still over its hatch"),
    ];
    let applies = move |(of, holds, words)| (of == output && holds).then_some(words);
    reasons.into_iter().filter_map(applies)
}

/// The energised outputs. Nothing else in the flight computer can set one: the field is private.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Outputs([bool; 4]);

impl Outputs {
    /// All off.
    pub const NONE: Self = Self([false; 4]);

    /// The outputs at the end of a frame.
    pub fn decided(mode: &Mode, progress: FlightProgress) -> Self {
        Self::of(|output| why_not(output, mode, progress).next().is_none())
    }

    /// The outputs recorded in a log or reported by a board.
    pub fn of(is_on: impl Fn(PyroOutput) -> bool) -> Self {
        Self(PyroOutput::ALL.map(is_on))
    }

    /// Whether an output is energised.
    pub fn is_on(&self, output: PyroOutput) -> bool {
        self.0[output as usize]
    }

    /// Whether an igniter is energised.
    pub fn lights(&self) -> bool {
        self.is_on(PyroOutput::AscentIgniter) || self.is_on(PyroOutput::LandingIgniter)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::rules::phase::{Effect, Event, HoldCause, StartPoint, transition};

    const SEEN: FlightProgress = FlightProgress {
        flying: true,
        lifted_off: false,
        separation_due: false,
        igniting: false,
        hatch_free: true,
    };

    fn boosting() -> Mode {
        let mut mode = Mode { phase: Phase::Boost, ..Mode::power_up(0.0) };
        (mode.interlocks.armed, mode.interlocks.pin_out) = (true, true);
        mode
    }

    #[test]
    fn every_output_is_at_the_place_of_its_number() {
        assert!(PyroOutput::ALL.iter().enumerate().all(|(place, output)| *output as usize == place));
    }

    #[test]
    fn each_output_that_is_off_names_every_reason() {
        let reasons = |output, mode: &Mode, progress| why_not(output, mode, progress).collect::<Vec<_>>();
        assert!(reasons(PyroOutput::AscentIgniter, &boosting(), SEEN).is_empty());
        let risen = FlightProgress { lifted_off: true, ..SEEN };
        assert_eq!(reasons(PyroOutput::AscentIgniter, &boosting(), risen), ["the vehicle has lifted off"]);
        let at_power_up = Mode::power_up(0.0);
        assert_eq!(
            reasons(PyroOutput::AscentIgniter, &at_power_up, SEEN),
            ["only BOOST lights the ascent motor", "not armed", "the pin is in"]
        );
        assert_eq!(
            reasons(PyroOutput::LandingIgniter, &at_power_up, SEEN),
            [
                "only the landing burn ignites its motor",
                "the igniter's time is over",
                "not armed",
                "the pin is in"
            ]
        );
        assert_eq!(
            reasons(PyroOutput::Separation, &at_power_up, SEEN),
            ["apogee is not near", "the vehicle is on its pad"]
        );
        let burning = Mode { phase: Phase::Powered, motor: Motor::Burning, ..boosting() };
        assert_eq!(
            reasons(PyroOutput::Parachute, &burning, SEEN),
            ["only CHUTE ejects the parachute", "the landing motor burns"]
        );
        assert_eq!(reasons(PyroOutput::LandingIgniter, &burning, SEEN), ["the igniter's time is over"]);
        let igniting = FlightProgress { igniting: true, ..SEEN };
        for phase in [Phase::Ignition, Phase::Powered] {
            let mode = Mode { phase, ..burning };
            assert!(Outputs::decided(&mode, igniting).is_on(PyroOutput::LandingIgniter), "{phase:?}");
        }
        let ejecting = Mode { phase: Phase::Chute, ..boosting() };
        let closed = FlightProgress { hatch_free: false, ..SEEN };
        assert_eq!(reasons(PyroOutput::Parachute, &ejecting, closed), ["the fins are still over its hatch"]);
        assert!(Outputs::decided(&ejecting, SEEN).is_on(PyroOutput::Parachute));
        assert!(Outputs::decided(&boosting(), SEEN).is_on(PyroOutput::AscentIgniter));
        assert!(Outputs::decided(&boosting(), SEEN).lights());
        assert_eq!(Outputs::decided(&at_power_up, SEEN), Outputs::NONE);
    }

    /// An event of any kind; most of them advance the flight.
    fn event(dice: u32, lifted_off: bool) -> Event {
        let flag = |bit: u32| dice >> bit & 1 == 1;
        let (above_commit_height, gate_open) = (flag(29), flag(30));
        match dice & 31 {
            0 => Event::AbortRequested { lifted_off, above_commit_height, gate_open },
            1 => Event::DisarmRequested { lifted_off },
            2 => Event::Hold { cause: HoldCause::Commanded, start: StartPoint::Pad },
            3 => Event::PinInserted,
            4 | 5 => Event::PinPulled,
            6 => Event::HoldElapsed,
            7 => Event::NoLiftOff,
            8 => Event::NoThrustTimeout,
            9 => Event::GateShutForGood { parachute_fills: gate_open },
            10 => Event::Contact { thrust_below_weight: gate_open },
            11 => Event::Apogee { booster_attached: gate_open },
            12 | 13 => Event::Apogee { booster_attached: false },
            14 => Event::SelfTestPassed,
            15..=17 => Event::ArmRequested { checks_passed: true },
            18 | 19 => Event::StartRequested { countdown_s: 1.0, checks_passed: true },
            20 | 21 => Event::CountdownElapsed,
            22 => Event::ReleasedAt(StartPoint::Apogee),
            23 => Event::LiftOff,
            24 => Event::Burnout,
            25 => Event::SeparationDue,
            26 | 27 => Event::FinsConfirmed,
            28 => Event::LandArm,
            29 => Event::IgnitionGate { open: gate_open },
            30 => Event::ThrustConfirmed,
            _ => Event::ReleasedEarly { parachute_fills: gate_open },
        }
    }

    /// The requirement: in a million random sequences no igniter is energised after an accepted
    /// abort, disarm or hold, except the landing motor's of a vehicle aborted too low for its
    /// parachute or after the ignition command. A motor is ignited armed and with its pin out, at
    /// most once, and never together with the parachute.
    #[test]
    fn in_a_million_random_sequences_no_igniter_is_on_after_an_abort_a_disarm_or_a_hold() {
        let mut random = ChaCha8Rng::seed_from_u64(48);
        let (mut ended, mut with_current, mut landings) = (0_u64, 0_u64, 0_u64);
        for _ in 0..1_000_000_u32 {
            let mut mode = Mode::power_up(0.0);
            for first in [Event::SelfTestPassed, Event::PinPulled] {
                mode = transition(&mode, first, 0.0).mode;
            }
            let (mut progress, mut time_s) = (FlightProgress { flying: false, ..SEEN }, 0.0);
            let (mut ascent_began, mut landing_began) = (false, false);
            let mut before = Outputs::NONE;
            // Outputs that stay off until a new start, or permanently.
            let mut stopped = false;
            for _ in 0..24 {
                let dice = random.next_u32();
                time_s += [0.005, 0.5, 1.0, 1.1][(dice >> 5 & 3) as usize];
                let requested = event(dice, progress.lifted_off);
                let answer = transition(&mode, requested, time_s);
                let accepted = answer.refusal.is_none();
                mode = answer.mode;
                progress.flying |= !mode.phase.on_pad();
                progress.lifted_off |= accepted && requested == Event::LiftOff;
                progress.separation_due |= accepted && requested == Event::SeparationDue;
                // The current ends at any time.
                progress.igniting &= dice >> 7 & 3 != 0;
                progress.igniting |= answer.effects.contains(Effect::IgniteLandingMotor);
                let outputs = Outputs::decided(&mode, progress);
                let stops = matches!(
                    requested,
                    Event::AbortRequested { .. } | Event::DisarmRequested { .. } | Event::Hold { .. }
                );
                if accepted && stops {
                    stopped = true;
                    ended += 1;
                    with_current += u64::from(before.is_on(PyroOutput::AscentIgniter));
                } else if accepted && matches!(requested, Event::StartRequested { .. } | Event::LiftOff) {
                    // An armed vehicle that lifts off by itself flies its mission.
                    stopped = false;
                }
                let (ascent, landing) =
                    (outputs.is_on(PyroOutput::AscentIgniter), outputs.is_on(PyroOutput::LandingIgniter));
                let locks = mode.interlocks;
                assert!(!(ascent && (stopped || locks.abort_latched)), "{requested:?}: {mode:?}");
                assert!(!(landing && (stopped || locks.abort_latched) && !locks.lands_in_place), "{mode:?}");
                assert!(!outputs.lights() || (locks.armed && locks.pin_out), "{mode:?}");
                assert!(!(ascent && landing), "{mode:?}");
                assert!(!outputs.is_on(PyroOutput::Parachute) || !outputs.lights(), "{mode:?}");
                // An output that was switched off stays off.
                assert!(!(ascent && ascent_began && !before.is_on(PyroOutput::AscentIgniter)), "{mode:?}");
                assert!(!(landing && landing_began && !before.is_on(PyroOutput::LandingIgniter)), "{mode:?}");
                (ascent_began, landing_began) = (ascent_began | ascent, landing_began | landing);
                landings += u64::from(landing && stopped);
                before = outputs;
            }
        }
        let found = format!("{ended} ended, {with_current} of them with current, {landings} landings");
        assert!(
            ended > 100_000 && with_current > 1_000 && landings > 10,
            "the sequences test too little: {found}"
        );
    }
}
