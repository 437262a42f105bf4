//! How a divergence grows from tick to tick.

use protocol::log::v1;
use serde::Serialize;

use super::difference::FieldDifference;

/// Differing ticks kept one by one.
const STEPS_KEPT: usize = 200;

/// One differing tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GrowthStep {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// How many of its fields differ.
    pub fields_different: usize,
    /// How far the gimbal commands are apart, rad.
    pub gimbal_rad: f64,
    /// How far the predicted touchdowns are apart, m.
    pub touchdown_m: f64,
    /// The most representable numbers that lie between two values of one field.
    pub worst_ulps: Option<u64>,
}

/// How a divergence grows.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Growth {
    /// The first differing ticks, one by one.
    pub steps: Vec<GrowthStep>,
    /// The tick whose gimbal commands are farthest apart.
    pub peak: Option<GrowthStep>,
    /// The last differing tick.
    pub last: Option<GrowthStep>,
}

impl Growth {
    /// Notes a differing tick.
    pub(super) fn note(
        &mut self,
        recorded: &v1::ControllerTick,
        again: &v1::ControllerTick,
        fields: &[FieldDifference],
    ) {
        let touchdown = |tick: &v1::ControllerTick| {
            (tick.output.predicted_touchdown.state.x_m, tick.output.predicted_touchdown.state.z_m)
        };
        let (then, now) = (touchdown(recorded), touchdown(again));
        let step = GrowthStep {
            tick: recorded.input.tick,
            time_s: recorded.input.time_s,
            fields_different: fields.len(),
            gimbal_rad: (recorded.output.gimbal_command_rad - again.output.gimbal_command_rad).abs(),
            touchdown_m: libm::hypot(then.0 - now.0, then.1 - now.1),
            worst_ulps: fields.iter().filter_map(|field| field.ulps).max(),
        };
        if self.steps.len() < STEPS_KEPT {
            self.steps.push(step);
        }
        // A difference that is not a number is the largest there is.
        let exceeds = |peak: &GrowthStep| step.gimbal_rad.is_nan() || step.gimbal_rad > peak.gimbal_rad;
        if self.peak.as_ref().is_none_or(exceeds) {
            self.peak = Some(step);
        }
        self.last = Some(step);
    }
}
