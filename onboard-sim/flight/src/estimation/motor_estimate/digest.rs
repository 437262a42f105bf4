//! The memory of the motor estimate, for the pilot's digest.

use super::{MotorEstimate, MotorStage};
use crate::computer::memory::{Memory, Remembers, remembers};

// The prior is constant; everything that changes is in the mean and the covariance.
remembers!(MotorEstimate { detector, stage, mean, covariance, felt_at_s, starved_frames } but { prior });

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
