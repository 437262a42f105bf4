//! What may differ from the data so that a vehicle still lands from one ignition height, and the height at which its flight
//! must begin.
//!
//! Guidance computes the heights from which a landing exists for the certified motor, a weak and a strong one, a short and
//! a long burn ([`flight::guidance::ignition`]). Here its own choice is asked for more and more scatter.

use flight::guidance::ignition::IgnitionSettings;
use flight::guidance::vertical::{Band, Column, fall_ends_m_s};
use flight::vehicle::burn::Burn;
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;

/// Largest scatter that is tried, as a multiple of the mission's.
pub const MOST_SCATTER: f64 = 4.0;
/// The igniter may be early or late by this, s, at a scatter of 1: two standard deviations of a single one, as in the set
/// of dispersions `field`. The airframe's `igniter.scatter_scale` multiplies it.
const IGNITER_S: f64 = 0.1;
/// Halvings of an interval; the scatter is then known to 0.004.
const HALVINGS: usize = 10;
/// Weakest and strongest motor that is looked at, as impulse over the certified impulse.
const IMPULSE_SCALES: [f64; 2] = [0.5, 2.0];

/// A vehicle with a motor just before its thrust begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Onset<'a> {
    column: Column,
    curve: &'a ThrustCurve,
    settings: IgnitionSettings,
    igniter_s: f64,
}

/// The landings of a vehicle whose thrust begins at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Speed at the first thrust, m/s, positive downwards.
    pub speed_m_s: f64,
    /// Largest scatter that one ignition height suits, as a multiple of what the mission plans for (its impulse and burn
    /// time scales, and 0.1 s of the igniter): 1 and more is what a landing vehicle has. At most [`MOST_SCATTER`].
    pub scatter: f64,
    /// Height of the feet at which guidance lets the thrust begin, m.
    pub onset_m: f64,
    /// Heights of the feet from which the certified motor lands, m.
    pub heights: Band,
    /// Impulse over the certified impulse of the weakest and the strongest motor that land from `onset_m`.
    pub impulse_scales: [f64; 2],
}

impl<'a> Onset<'a> {
    /// A mission's vehicle at another mass, kg, with another motor.
    pub(crate) fn new(mission: &Mission, mass_kg: f64, curve: &'a ThrustCurve, density_kg_m3: f64) -> Self {
        Self {
            column: Column::of_mission(mission, mass_kg, density_kg_m3, 1.0, mission.soft_tilt_deg),
            curve,
            settings: IgnitionSettings { delay_s: 0.0, fixed_height_m: None, ..mission.ignition },
            igniter_s: IGNITER_S * mission.airframe.igniter_scatter(),
        }
    }

    pub(crate) fn column(&self) -> &Column {
        &self.column
    }

    /// Heights from which a motor of another impulse lands at a speed, m/s.
    fn band(&self, impulse_scale: f64, speed_m_s: f64) -> Option<Band> {
        let burn = Burn { impulse_scale, ..Burn::nominal(self.curve) };
        self.column.band(&burn, 0.0, -speed_m_s)
    }

    /// Whether the certified motor lands at a speed, m/s.
    pub(crate) fn lands(&self, speed_m_s: f64) -> bool {
        self.band(1.0, speed_m_s).is_some()
    }

    /// Whether one ignition height suits a scatter.
    fn suits(&self, scatter: f64, speed_m_s: f64) -> bool {
        let scaled = |scales: [f64; 2]| scales.map(|scale| 1.0 + scatter * (scale - 1.0));
        let settings = IgnitionSettings {
            impulse_scales: scaled(self.settings.impulse_scales),
            burn_time_scales: scaled(self.settings.burn_time_scales),
            ..self.settings
        };
        let sound =
            settings.impulse_scales.iter().chain(&settings.burn_time_scales).all(|scale| *scale > 0.05);
        let room_m = 2.0 * scatter * self.igniter_s * speed_m_s;
        let prediction = || settings.prediction(&self.column, self.curve, 0.0, -speed_m_s, 0.0);
        sound && prediction().common.is_some_and(|common| common.high_m - common.low_m >= room_m)
    }

    /// The largest scatter that one ignition height suits at a speed, m/s; 0 if even none is too much.
    pub(crate) fn scatter(&self, speed_m_s: f64) -> f64 {
        if !self.lands(speed_m_s) {
            return 0.0;
        }
        halved([0.0, MOST_SCATTER], |scatter| self.suits(scatter, speed_m_s))
    }

    /// Height of the feet at which guidance lets the thrust begin, m, at a speed, m/s.
    pub(crate) fn chosen_m(&self, speed_m_s: f64) -> Option<f64> {
        self.settings.prediction(&self.column, self.curve, 0.0, -speed_m_s, 0.0).chosen_m
    }

    /// The window at a speed, m/s; `None` if no landing exists.
    pub(crate) fn window(&self, speed_m_s: f64) -> Option<Window> {
        let heights = self.band(1.0, speed_m_s)?;
        let onset_m = self.chosen_m(speed_m_s)?;
        let lands = |impulse_scale: f64| {
            self.band(impulse_scale, speed_m_s).is_some_and(|band| band.contains(onset_m))
        };
        let ends = IMPULSE_SCALES.map(|end| if lands(1.0) { halved([1.0, end], lands) } else { 1.0 });
        Some(Window { speed_m_s, scatter: self.scatter(speed_m_s), onset_m, heights, impulse_scales: ends })
    }
}

/// The value nearest to the second end that is still right, if the first end is right.
fn halved([mut right, end]: [f64; 2], is_right: impl Fn(f64) -> bool) -> f64 {
    if is_right(end) {
        return end;
    }
    let mut wrong = end;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (right + wrong);
        *(if is_right(middle) { &mut right } else { &mut wrong }) = middle;
    }
    right
}

/// What leads from the start of a flight to the first thrust: a fall from rest with open fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fall {
    pub gravity_m_s2: f64,
    /// Terminal speed with open fins, m/s.
    pub terminal_m_s: f64,
    /// Distance from the feet up to the centre of gravity, m.
    pub cg_above_feet_m: f64,
}

impl Fall {
    /// With open fins of a drag area, m^2.
    pub fn new(column: &Column, open_fins_m2: f64, cg_above_feet_m: f64) -> Self {
        Self {
            gravity_m_s2: column.gravity_m_s2,
            terminal_m_s: column.terminal_speed_m_s(open_fins_m2),
            cg_above_feet_m,
        }
    }

    /// Height of the centre of gravity above the pad, m, at which the flight must begin so that the vehicle falls at a
    /// speed, m/s, when its feet are at a height, m. `None` at the terminal speed and above.
    ///
    /// A start at apogee and one that is dropped both begin at rest, so the height is the same. The difference of `v^2`
    /// from `V_t^2` falls by a factor of e in each `V_t^2 / (2 g)` of height.
    pub fn start_height_m(&self, feet_m: f64, speed_m_s: f64) -> Option<f64> {
        let share = speed_m_s / self.terminal_m_s;
        let left = 1.0 - share * share;
        let e_height_m = self.terminal_m_s * self.terminal_m_s / (2.0 * self.gravity_m_s2);
        (left > 0.0).then(|| feet_m + self.cg_above_feet_m - e_height_m * libm::log(left))
    }

    /// Speed, m/s, when the feet are at a height, m, after a start at a height of the centre of gravity, m.
    pub fn speed_m_s(&self, start_height_m: f64, feet_m: f64) -> f64 {
        let fallen_m = start_height_m - self.cg_above_feet_m - feet_m;
        fall_ends_m_s(fallen_m, 0.0, self.terminal_m_s, self.gravity_m_s2)
    }

    /// Speed, m/s, after falling for a time, s: `V_t tanh(g t / V_t)`.
    pub fn speed_after_m_s(&self, time_s: f64) -> f64 {
        self.terminal_m_s * libm::tanh(self.gravity_m_s2 * time_s / self.terminal_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FALL: Fall = Fall { gravity_m_s2: 9.81, terminal_m_s: 40.0, cg_above_feet_m: 0.5 };

    /// 81.55 m for each factor of e; 1 - 0.9^2 = 0.19, ln 0.19 = -1.66073: 135.43 m of fall.
    #[test]
    fn val_hand_nine_tenths_of_the_terminal_speed() {
        let start_m = FALL.start_height_m(60.0, 36.0).unwrap();
        assert!((start_m - 195.93).abs() < 0.01, "{start_m}");
        assert!((FALL.speed_m_s(start_m, 60.0) - 36.0).abs() < 1e-9);
        assert_eq!(FALL.start_height_m(60.0, 40.0), None);
        // Without drag it would be 9.81 m/s after a second; 40 tanh(0.24525) = 9.6177.
        assert!((FALL.speed_after_m_s(1.0) - 9.6177).abs() < 1e-3);
    }
}
