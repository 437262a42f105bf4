//! Switches and feedback.

use serde::{Deserialize, Serialize};

use super::Sensors;

/// Switches and feedback: contact, igniter continuity and fin positions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SwitchParams {
    /// Time from the first contact until it is reported, ms.
    pub contact_late_ms: u32,
    /// Probability that the igniter's continuity is reported as lost, for all of a flight.
    pub continuity_lost_share: f64,
    /// Error of each fin's feedback, the same for all of a flight, degrees.
    pub fin_feedback_deg: f64,
}

impl Sensors {
    /// Fin openings in the feedback, rad.
    pub fn fins_rad(&self, fins_rad: &[f64; 4]) -> [f64; 4] {
        core::array::from_fn(|fin| fins_rad[fin] + self.flaws.fin_feedback_rad[fin])
    }

    /// Whether the igniter's continuity is reported.
    pub fn igniter_continuity(&self) -> bool {
        !self.flaws.continuity_lost
    }

    /// Whether contact is reported, from whether there has been one.
    pub fn contact(&mut self, touched: bool) -> bool {
        if !touched {
            return false;
        }
        let since_ms = *self.contact_ms.get_or_insert(self.elapsed_ms);
        self.elapsed_ms - since_ms >= self.params.switches.contact_late_ms
    }
}
