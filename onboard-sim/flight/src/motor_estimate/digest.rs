//! What the motor's estimate remembers, for a pilot's digest.

use super::{MotorEstimate, MotorStage};
use crate::memory::{Memory, Remembers, remembers};

// The prior is what it began with; what it says afterwards is in mean and covariance, but for constants.
remembers!(MotorEstimate { detector, stage, mean, covariance, starved_frames } but { prior });

impl Remembers for MotorStage {
    fn remember(&self, memory: &mut Memory) {
        let (stage, at_s): (u8, Option<f64>) = match self {
            Self::Waiting => (0, None),
            Self::Burning => (1, None),
            Self::EndedEarly { at_s } => (2, Some(*at_s)),
        };
        stage.remember(memory);
        at_s.remember(memory);
    }
}
