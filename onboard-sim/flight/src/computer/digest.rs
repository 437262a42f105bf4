//! Digests of the flight computer's memory: of all of it, and of the part that decides in the air.

use super::pad_check::PadCheck;
use super::self_test::SelfTest;
use super::{Commands, Computer, CrewMemory, LogState, Release};
use crate::computer::memory::{Memory, Remembers, remembers};
use crate::computer::pilot::BoosterCommands;
use crate::rules::operator::Operator;
use crate::rules::phase::{Hold, HoldCause, Interlocks, Mode, Motor, MotorStatus};
use crate::rules::two_person::{Ask, Station, Tapping};

/// The part of the phase table that decides in the air. Times of the vehicle's clock decide nothing there, nor do the
/// pin and the arming, which a person may change on the ground.
struct InTheAir<'a>(&'a Computer);

impl Remembers for InTheAir<'_> {
    fn remember(&self, memory: &mut Memory) {
        let mode = self.0.mode();
        mode.phase.index().remember(memory);
        let Interlocks {
            pin_out: _,
            armed: _,
            landing_motor_inhibited,
            abort_latched,
            no_light_latched,
            lands_here,
        } = mode.interlocks;
        [landing_motor_inhibited, abort_latched, no_light_latched, lands_here].remember(memory);
        stage(mode.motor).remember(memory);
        self.0.pilot.remember(memory);
    }
}

fn stage(motor: Motor) -> u8 {
    match motor {
        Motor::Unlit => 0,
        Motor::Commanded => 1,
        Motor::Burning => 2,
        Motor::BurntOut { .. } => 3,
    }
}

remembers!(Interlocks {
    pin_out,
    armed,
    landing_motor_inhibited,
    abort_latched,
    no_light_latched,
    lands_here
});
remembers!(Hold { cause, at_s });
remembers!(Commands { gimbal_rad, fins_rad, ignite, parachute, booster });
remembers!(BoosterCommands { ignite, separate });
remembers!(Release { frame, time_s });
remembers!(CrewMemory { two_person, held_by });

remembers!(Ask { act, number, by, station, at_s });
remembers!(Tapping { by, at_s });
remembers!(LogState { running } but { space_bytes });

impl Remembers for Operator {
    fn remember(&self, memory: &mut Memory) {
        [self.number, self.role as u8].remember(memory);
        self.name.bytes().remember(memory);
    }
}

impl Remembers for Station {
    fn remember(&self, memory: &mut Memory) {
        [self.system, self.component].remember(memory);
        // Logs from before stations were told apart have the same digest.
        if self.number != 0 {
            self.number.remember(memory);
        }
    }
}

impl Remembers for crate::rules::two_person::Act {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for HoldCause {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for SelfTest {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for MotorStatus {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for Motor {
    fn remember(&self, memory: &mut Memory) {
        stage(*self).remember(memory);
        if let Self::BurntOut { at_s } = self {
            at_s.remember(memory);
        }
    }
}

impl Remembers for Mode {
    fn remember(&self, memory: &mut Memory) {
        let Self { phase, interlocks, entered_at_s, countdown_end_s, hold, motor } = self;
        phase.index().remember(memory);
        interlocks.remember(memory);
        (*entered_at_s, *countdown_end_s).remember(memory);
        hold.remember(memory);
        motor.remember(memory);
    }
}

/// The whole memory. Law and first state are constants of the flight; the last frame in the air came with its input, and its
/// decisions are compared as output. Time, frame, uplink, battery and booster wire come with each input; limits and the length of the countdown never change.
struct Whole<'a>(&'a Computer);

impl Remembers for Whole<'_> {
    fn remember(&self, memory: &mut Memory) {
        let Computer {
            table,
            pad,
            pilot,
            law: _,
            believed: _,
            flown: _,
            gate_told,
            frame: _,
            arming: _,
            countdown_s: _,
            commands,
            self_test,
            readiness,
            rehearsed,
            motor_watch,
            log,
            uplink: _,
            commander: _,
            people: _,
            crew,
            fins_answering,
            igniter_continuity,
            booster_attached: _,
            battery_v: _,
            pad_check,
            release,
            level,
        } = self.0;
        table.mode().remember(memory);
        pad.remember(memory);
        pilot.remember(memory);
        gate_told.remember(memory);
        commands.remember(memory);
        self_test.remember(memory);
        readiness.remember(memory);
        rehearsed.is_some().remember(memory);
        motor_watch.remember(memory);
        log.remember(memory);
        fins_answering.remember(memory);
        igniter_continuity.remember(memory);
        release.remember(memory);
        level.index().remember(memory);
        // A crew without operators leaves nothing behind, and logs from before there were any have the same digest.
        if *crew != CrewMemory::default() {
            crew.remember(memory);
        }
        // The same for a check that nobody has asked for.
        if *pad_check != PadCheck::default() {
            pad_check.remember(memory);
        }
    }
}

impl Computer {
    /// A number that changes with anything that the computer remembers, from power-up on.
    pub fn digest(&self) -> u64 {
        Memory::digest_of(&Whole(self))
    }

    /// A number that changes with anything that decides in the air, to compare a replay with a log.
    ///
    /// The mission is left out because it is constant, and a solve's workspace because the next solve reads nothing of
    /// it.
    pub fn flight_digest(&self) -> u64 {
        Memory::digest_of(&InTheAir(self))
    }
}
