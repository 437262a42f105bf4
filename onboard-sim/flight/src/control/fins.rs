//! Finds the four opening angles for commanded moments and drag.
//!
//! The sines of the openings are written as a mean and one amplitude for each of the patterns
//! pitch, yaw and roll, which are orthogonal. The effect of the patterns follows Eq. 13-17, with
//! one effect that the paper leaves out: the lifts cause more than roll. With unequal openings the
//! four alternating lifts leave a side force, which acts at the fins' station, a distance `a` ahead
//! of the centre of gravity. With `h` the angle from y to an open fin, `g = r(s) s`, `s = sin
//! kappa`, divided by dynamic pressure and area:
//!
//! ```text
//! roll  = sum ROLL[i]  C_l g(s_i)
//! pitch = sum PITCH[i] (C_d sin h g(s_i) - a C_l cos h s_i)
//! yaw   = sum YAW[i]   (C_d cos h g(s_i) + a C_l sin h s_i)
//! ```
//!
//! If a command does not fit between the stops, first drag is sacrificed, then roll, then pitch and
//! yaw together, so that a commanded tilt preserves its direction.

use nalgebra::Vector3;

use crate::vehicle::fins::{FinModel, PITCH, ROLL, YAW};

/// Rounds that correct the amplitudes. The gains are quadratic in the openings; each round leaves
/// about a tenth of the error.
const ROUNDS: usize = 8;
/// Smallest slope that a correction divides by, as a fraction of the slope of half-open fins:
/// almost closed fins have a weak effect, and their lift can cancel the moment of their drag.
const SLOPE_FLOOR: f64 = 0.2;

/// Share of the range between the stops available to pitch and yaw. The rest is reserved for roll:
/// without it a saturated tilt let mk2 roll below its drone at 1.3 rad/s, which the ignition gate
/// forbids.
const FOR_TILT: f64 = 0.85;

/// Less dynamic pressure counts as no air, Pa, because the results would overflow.
const LEAST_PRESSURE_PA: f64 = 1e-6;

/// Commanded moments and drag of the fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinCommand {
    /// Moments about the body axes, at the centre of gravity, N m.
    pub moments_n_m: Vector3<f64>,
    /// Drag area of the four fins together, m^2.
    pub drag_area_m2: f64,
}

/// Allocation of commanded moments and drag to the four fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocation {
    /// The fins.
    pub model: FinModel,
    /// Distance from the centre of gravity forward to the fins, m.
    pub arm_m: f64,
    /// Smallest opening that may be used, rad.
    pub min_rad: f64,
    /// Largest opening that may be used, rad; at most pi/2.
    pub max_rad: f64,
}

/// Sines of the openings as a mean and the amplitudes of the patterns.
#[derive(Clone, Copy, Default)]
struct Patterns {
    mean: f64,
    roll: f64,
    pitch: f64,
    yaw: f64,
}

impl Patterns {
    fn sines(&self) -> [f64; 4] {
        core::array::from_fn(|i| self.mean + self.roll * ROLL[i] + self.pitch * PITCH[i] + self.yaw * YAW[i])
    }

    /// Reduces the amplitudes until the openings fit between the stops.
    fn fit(mut self, lowest: f64, highest: f64) -> Self {
        let room = highest - lowest;
        // The two patterns have every combination of signs, so together they spread by twice the
        // sum.
        let spread = 2.0 * (self.pitch.abs() + self.yaw.abs());
        if spread > FOR_TILT * room {
            self.pitch *= FOR_TILT * room / spread;
            self.yaw *= FOR_TILT * room / spread;
        }
        let tilt = Self { mean: 0.0, roll: 0.0, ..self };
        let roll_max = largest_roll(&tilt.sines(), self.roll.signum(), room);
        self.roll = self.roll.clamp(-roll_max, roll_max);
        let pattern = Self { mean: 0.0, ..self }.sines();
        let (low, high) = extremes(&pattern);
        // Because of rounding the pattern may be slightly wider than the range.
        self.mean = self.mean.min(highest - high).max(lowest - low);
        self
    }
}

/// The largest roll amplitude of this sign that keeps a pattern within `room`, the width of the
/// range: each pair of fins with opposite roll signs may move apart until it fills the range.
fn largest_roll(tilt: &[f64; 4], sign: f64, room: f64) -> f64 {
    let mut largest = room / 2.0;
    for up in 0..4 {
        for down in 0..4 {
            if ROLL[up] * sign > 0.0 && ROLL[down] * sign < 0.0 {
                largest = largest.min((room - (tilt[up] - tilt[down])) / 2.0);
            }
        }
    }
    largest.max(0.0)
}

/// A slope, but at least the smallest slope with the sign of half-open fins.
fn floored(here: f64, half: f64) -> f64 {
    let least = SLOPE_FLOOR * half.abs();
    half.signum() * (here * half.signum()).max(least)
}

fn extremes(values: &[f64; 4]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)))
}

impl Allocation {
    /// Moments about the centre of gravity in a tail-first flow along the axis, N m.
    pub fn moments_n_m(&self, dynamic_pressure_pa: f64, kappa_rad: [f64; 4]) -> Vector3<f64> {
        self.moment_areas(&kappa_rad.map(libm::sin)) * dynamic_pressure_pa
    }

    /// Drag area of the four fins together, m^2.
    pub fn drag_area_m2(&self, kappa_rad: [f64; 4]) -> f64 {
        self.fin_drag_area_m2() * kappa_rad.iter().map(|&kappa| libm::sin(kappa)).sum::<f64>()
    }

    fn fin_drag_area_m2(&self) -> f64 {
        self.model.reference_area_m2 * self.model.drag_coefficient
    }

    fn fin_lift_area_m2(&self) -> f64 {
        self.model.reference_area_m2 * self.model.lift_coefficient
    }

    /// Moments over dynamic pressure, m^3.
    fn moment_areas(&self, sines: &[f64; 4]) -> Vector3<f64> {
        let (drag_m2, lift_m2) = (self.fin_drag_area_m2(), self.fin_lift_area_m2());
        let (sin, cos) = self.model.from_y;
        let mut sum = Vector3::zeros();
        for i in 0..4 {
            let s = sines[i];
            let g_m = self.model.radius_m(s) * s;
            sum.x += ROLL[i] * lift_m2 * g_m;
            sum.y += PITCH[i] * (drag_m2 * sin * g_m - self.arm_m * lift_m2 * cos * s);
            sum.z += YAW[i] * (drag_m2 * cos * g_m + self.arm_m * lift_m2 * sin * s);
        }
        sum
    }

    /// Moment over dynamic pressure for each unit of a pattern's amplitude at a mean opening, m^3.
    fn slopes(&self, mean: f64) -> Vector3<f64> {
        let (sin, cos) = self.model.from_y;
        let at = |s: f64| {
            let (drag_m2, lift_m2) = (self.fin_drag_area_m2(), self.fin_lift_area_m2());
            let g_slope_m = 0.5 * self.model.body_diameter_m + self.model.length_m * s;
            Vector3::new(
                4.0 * lift_m2 * g_slope_m,
                4.0 * (drag_m2 * sin * g_slope_m - self.arm_m * lift_m2 * cos),
                4.0 * (drag_m2 * cos * g_slope_m + self.arm_m * lift_m2 * sin),
            )
        };
        at(mean).zip_map(&at(0.5), floored)
    }

    /// The four opening angles for a command, rad, always inside the range. Without air, or with a
    /// command that is not finite, the fins open fully, as in the passive descent.
    pub fn openings_rad(&self, command: &FinCommand, dynamic_pressure_pa: f64) -> [f64; 4] {
        let Self { min_rad, max_rad, .. } = *self;
        let (lowest, highest) = (libm::sin(min_rad), libm::sin(max_rad));
        let wanted = command.moments_n_m / dynamic_pressure_pa;
        let mean = command.drag_area_m2 / (4.0 * self.fin_drag_area_m2());
        if !(mean.is_finite()
            && wanted.iter().all(|value| value.is_finite())
            && dynamic_pressure_pa > LEAST_PRESSURE_PA)
        {
            return [max_rad; 4];
        }
        let mut patterns = Patterns { mean, ..Patterns::default() }.fit(lowest, highest);
        for _ in 0..ROUNDS {
            let missing = wanted - self.moment_areas(&patterns.sines());
            let more = missing.component_div(&self.slopes(patterns.mean));
            patterns = Patterns {
                mean,
                roll: patterns.roll + more.x,
                pitch: patterns.pitch + more.y,
                yaw: patterns.yaw + more.z,
            }
            .fit(lowest, highest);
        }
        patterns.sines().map(|sine| libm::asin(sine.clamp(lowest, highest)).clamp(min_rad, max_rad))
    }
}
