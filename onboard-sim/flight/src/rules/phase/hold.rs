//! The hold of a countdown.

use super::{Mode, Phase, StartPoint};
use serde::{Deserialize, Serialize};

/// The station that armed the vehicle counts as silent when no frame of it was accepted for this long, s.
pub const UPLINK_SILENT_S: f64 = 2.0;

/// A held vehicle disarms after this long without a new start, s.
pub const HOLD_LIMIT_S: f64 = 60.0;

/// So long before the release, s, and later nothing holds the countdown any more: a hold that comes as late as the release
/// itself must not leave the crew in doubt whether the motor lights. An abort and a disarm still end it.
pub const LAST_HOLD_S: f64 = 2.0;

/// Why a countdown was held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum HoldCause {
    /// No frame of the station that armed the vehicle was accepted for [`UPLINK_SILENT_S`].
    UplinkSilent = 1,
    /// A station asked for a hold.
    Commanded = 2,
    /// Whoever confirmed the start has not tapped in time.
    TapOverdue = 3,
}

/// A hold: the countdown is cancelled, but the vehicle is still armed. Only a new start continues the launch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    pub cause: HoldCause,
    /// When the countdown was held, vehicle time, s.
    pub at_s: f64,
}

impl StartPoint {
    /// From when on nothing holds, s before the release. `None` below a drone: its pilot lets go at no set time after the
    /// countdown, so a hold comes in time until then.
    pub fn last_hold_s(self) -> Option<f64> {
        (self != Self::Drone).then_some(LAST_HOLD_S)
    }
}

impl Mode {
    /// Whether a countdown runs that may still be held.
    pub fn may_hold(&self, start: StartPoint, time_s: f64) -> bool {
        let in_time = |end_s: f64| start.last_hold_s().is_none_or(|last_s| end_s - time_s > last_s);
        self.countdown_end_s.is_some_and(in_time)
    }

    /// Why the last countdown was held, and the time left until the vehicle disarms, s; `None` unless it is held.
    pub fn held(&self, time_s: f64) -> Option<(HoldCause, f64)> {
        let hold = self.hold.filter(|_| self.phase == Phase::PadArmed)?;
        Some((hold.cause, (hold.at_s + HOLD_LIMIT_S - time_s).max(0.0)))
    }
}
