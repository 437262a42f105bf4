//! What is remembered of phase and latches, for a pilot's digest.

use super::{Interlocks, Mode, Phase};
use crate::memory::{Memory, Remembers, remembers};

remembers!(Mode { phase, interlocks, entered_at_s, countdown_end_s });
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
