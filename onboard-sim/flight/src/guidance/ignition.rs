//! When to light the landing motor.
//!
//! The motor ignites only once, and its strength is estimated only afterwards. Every tick computes
//! the heights from which a landing exists ([`crate::guidance::vertical`]) for the certified motor,
//! a weak motor and a strong motor. The chosen height lies at a fixed position in the band that all
//! three have in common, so the landing exists for any of them. The command is sent early by the
//! delay of the igniter.

use serde::{Deserialize, Serialize};

use crate::guidance::vertical::{Band, Column};
use crate::vehicle::burn::Burn;
use crate::vehicle::thrust_curve::ThrustCurve;

/// Settings of the choice.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct IgnitionSettings {
    /// Impulse of the weakest and the strongest motor to be landed, divided by the certified
    /// impulse.
    #[serde(default)]
    pub impulse_scales: [f64; 2],
    /// Burn times of the shortest and the longest burn to be landed, divided by the certified burn
    /// time.
    #[serde(default)]
    pub burn_time_scales: [f64; 2],
    /// Chosen place in the common band: 0 at its low end, 1 at its high end.
    pub place: f64,
    /// Largest delay of an igniter beyond the expected one, s. None ignites much earlier, so the
    /// height is chosen for the middle of the two.
    pub late_s: f64,
    /// Expected time from command to thrust, s; half of the rise of the thrust counts.
    pub delay_s: f64,
    /// How long before the expected ignition the landing controller takes over, s.
    pub arm_before_s: f64,
    /// Fixed height at which thrust begins, m, for flights that are timed beforehand.
    pub fixed_height_m: Option<f64>,
}

/// Result of a tick for the choice of the ignition height.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct IgnitionPrediction {
    /// Heights from which the certified motor lands if its thrust begins there at the expected
    /// speed, m.
    pub band: Option<Band>,
    /// From the highest low end to the lowest high end of all considered motors, m; the latter may
    /// lie below the former.
    pub nearest: Option<Band>,
    /// The chosen height at which thrust should begin, m.
    pub chosen_m: Option<f64>,
    /// Height at which thrust would begin if commanded now, m.
    pub onset_height_m: f64,
    /// Vertical velocity there, m/s, up positive.
    pub onset_vertical_m_s: f64,
    /// Time until the command should go out, s; negative when late.
    pub command_in_s: Option<f64>,
}

impl IgnitionPrediction {
    /// How long the ignition has been due, s, at an even speed; `None` before. It is due when
    /// thrust commanded at the next frame would begin below the chosen height; `onset_m` is where
    /// it would begin.
    pub fn overdue_s(&self, onset_m: f64) -> Option<f64> {
        let below_m = self.chosen_m? - onset_m;
        (below_m >= 0.0).then(|| below_m / (-self.onset_vertical_m_s).max(1.0))
    }
}

/// Shortest time that a fall from the strongest motor's lowest height may last, s: a late igniter
/// is not prepared for at the cost of a punctual one. mk2-h53 has 0.1 s; higher by 2 m, 128 of 150
/// stand instead of 142 (`field`, seed 7001).
const HIGH_ROOM_S: f64 = 0.13;

/// Step and number of steps of the look along a fall that still gains speed: 4 s, after which an
/// open vehicle has reached 0.8 of its terminal speed.
const AHEAD_S: f64 = 0.25;
const AHEAD_STEPS: u32 = 16;

impl IgnitionSettings {
    /// Whether the certified motor lands from some point of the fall that begins at this height and
    /// vertical velocity. A motor that is too strong for the present speed may suit a later speed.
    pub fn lands_ahead(
        &self,
        column: &Column,
        curve: &ThrustCurve,
        height_m: f64,
        vertical_m_s: f64,
        fin_drag_area_m2: f64,
    ) -> bool {
        let Some(landings) = column.landings(&Burn::nominal(curve), 0.0) else { return false };
        (1..=AHEAD_STEPS).any(|step| {
            let after_s = self.delay_s + AHEAD_S * f64::from(step);
            let (onset_m, onset_m_s) = column.fallen(height_m, vertical_m_s, fin_drag_area_m2, after_s);
            landings.band(onset_m_s).is_some_and(|band| onset_m >= band.low_m)
        })
    }

    /// The prediction from a height and a vertical velocity (up positive), with the fins open at
    /// `fin_drag_area_m2`. Each end of a band is monotonic in impulse and in burn time, so the
    /// motors at the ends of their ranges bound all others.
    pub fn prediction(
        &self,
        column: &Column,
        curve: &ThrustCurve,
        height_m: f64,
        vertical_m_s: f64,
        fin_drag_area_m2: f64,
    ) -> IgnitionPrediction {
        let (onset_height_m, onset_vertical_m_s) =
            column.fallen(height_m, vertical_m_s, fin_drag_area_m2, self.delay_s);
        let band = |impulse_scale, time_scale| {
            column.band(&Burn { impulse_scale, time_scale, ..Burn::nominal(curve) }, 0.0, onset_vertical_m_s)
        };
        let certified = band(1.0, 1.0);
        let [weak, strong] = self.impulse_scales;
        let [short, long] = self.burn_time_scales;
        let extremes = [(weak, 1.0), (strong, 1.0), (1.0, short), (1.0, long)];
        let bands = extremes.map(|(impulse, time)| band(impulse, time));
        // If no height suits all motors, the middle between the highest low end and the lowest high
        // end is closest to all of them.
        let nearest = certified.map(|certified| {
            bands.iter().flatten().fold(certified, |nearest, band| Band {
                low_m: nearest.low_m.max(band.low_m),
                high_m: nearest.high_m.min(band.high_m),
            })
        });
        let chosen_m = self.fixed_height_m.or_else(|| {
            let Band { low_m, high_m } = nearest?;
            let in_time_m = low_m + self.place * (high_m - low_m);
            let speed_m_s = (-onset_vertical_m_s).max(0.0);
            let room_m = high_m - in_time_m - HIGH_ROOM_S * speed_m_s;
            Some(in_time_m + (0.5 * self.late_s * speed_m_s).min(room_m).max(0.0))
        });
        let command_in_s =
            chosen_m.map(|chosen_m| (onset_height_m - chosen_m) / (-onset_vertical_m_s).max(1.0));
        IgnitionPrediction {
            band: certified,
            nearest,
            chosen_m,
            onset_height_m,
            onset_vertical_m_s,
            command_in_s,
        }
    }
}
