//! How a divergence grows from tick to tick.

use serde::Serialize;

/// Most differing ticks that are kept.
const STEPS_KEPT: usize = 200;

/// One differing tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GrowthStep {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// Number of fields that differ.
    pub fields_different: usize,
    /// Difference of the gimbal commands, rad.
    pub gimbal_rad: f64,
    /// The largest distance of the two values of a field, in representable numbers.
    pub worst_ulps: Option<u64>,
}

/// How a divergence grows.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Growth {
    /// The first differing ticks.
    pub steps: Vec<GrowthStep>,
    /// The tick with the largest difference of the gimbal commands.
    pub peak: Option<GrowthStep>,
    /// The last differing tick.
    pub last: Option<GrowthStep>,
}

impl Growth {
    /// Notes a differing tick.
    pub(super) fn note(&mut self, step: GrowthStep) {
        if self.steps.len() < STEPS_KEPT {
            self.steps.push(step);
        }
        // A difference that is NaN counts as the largest.
        let exceeds = |peak: &GrowthStep| step.gimbal_rad.is_nan() || step.gimbal_rad > peak.gimbal_rad;
        if self.peak.as_ref().is_none_or(exceeds) {
            self.peak = Some(step);
        }
        self.last = Some(step);
    }
}
