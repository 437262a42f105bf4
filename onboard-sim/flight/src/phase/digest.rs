//! What is remembered of phase and latches, for a pilot's digest.

use super::{Hold, HoldCause, Interlocks, Mode, Motor, Phase};
use crate::memory::{Memory, Remembers, remembers};

remembers!(Mode { phase, interlocks, entered_at_s, countdown_end_s, hold, motor });
remembers!(Hold { cause, at_s });
remembers!(Interlocks {
    pin_out,
    armed,
    landing_motor_inhibited,
    abort_latched,
    no_light_latched,
    lands_here
});

impl Remembers for Phase {
    fn remember(&self, memory: &mut Memory) {
        self.index().remember(memory);
    }
}

impl Remembers for HoldCause {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for Motor {
    fn remember(&self, memory: &mut Memory) {
        let (stage, at_s) = match self {
            Self::Unlit => (0_u8, None),
            Self::Commanded => (1, None),
            Self::Burning => (2, None),
            Self::BurntOut { at_s } => (3, Some(*at_s)),
        };
        stage.remember(memory);
        at_s.remember(memory);
    }
}
