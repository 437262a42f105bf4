//! A fall during the burn to a given end, and ways of braking it.

use super::{Braking, Column};
use crate::vehicle::burn::Burn;

/// Intervals of the burn ahead.
const INTERVALS: usize = 40;
/// The touchdown speed is met this closely, m/s: a millimetre of height.
const MET_M_S: f64 = 1e-4;
/// Largest number of falls tried for a way of braking; about six are usual.
const MOST_FALLS: usize = 24;
/// A vehicle that moves upwards faster than this rises, m/s. Halved and doubled: 144, 144.
const RISING_M_S: f64 = 0.05;

/// The fraction of the thrust and the drag of one way of braking.
#[derive(Clone, Copy)]
struct Share {
    thrust: f64,
    drag_per_v2: f64,
}

impl Share {
    fn new(column: &Column, braking: &Braking) -> Self {
        let (sin, cos) = libm::sincos(braking.tilt_rad);
        let area_m2 = column.burning_body_drag_area_m2 * cos * cos
            + braking.fin_drag_area_m2
            + column.crossflow_area_m2 * sin * sin * sin;
        Self { thrust: cos, drag_per_v2: 0.5 * column.air_density_kg_m3 * area_m2 }
    }

    /// A mixture of two ways of braking.
    fn mixed(&self, share: f64, other: &Self) -> Self {
        Self {
            thrust: share * self.thrust + (1.0 - share) * other.thrust,
            drag_per_v2: share * self.drag_per_v2 + (1.0 - share) * other.drag_per_v2,
        }
    }
}

/// A family of ways to brake, with one parameter between 0 (all hard) and 1 (all soft).
#[derive(Clone, Copy)]
enum Way {
    /// Soft braking first, for that fraction of the time.
    SoftFirst,
    /// Hard braking first, then soft braking for that fraction of the time.
    HardFirst,
    /// A mixture of both throughout.
    Even,
}

/// How a fall ends.
#[derive(Clone, Copy)]
struct Ended {
    fallen_m: f64,
    vertical_m_s: f64,
    highest_m_s: f64,
}

/// The rest of the burn until a given end, in equal intervals.
pub(super) struct Fall {
    step_s: f64,
    gravity_m_s2: f64,
    vertical_m_s: f64,
    touchdown_m_s: f64,
    soft: Share,
    hard: Share,
    upright: Share,
    /// Thrust over mass, m/s^2, one over the mass, 1/kg, and the fraction of the interval in which the vehicle may
    /// lean.
    ahead: [(f64, f64, f64); INTERVALS],
}

impl Fall {
    /// A fall from `from_s` to `to_s` of the burn that begins with a vertical velocity, m/s.
    pub(super) fn new(column: &Column, burn: &Burn<'_>, from_s: f64, to_s: f64, vertical_m_s: f64) -> Self {
        let step_s = (to_s - from_s) / INTERVALS as f64;
        let settled = column.settle_s / step_s;
        let ahead = core::array::from_fn(|k| {
            let at_s = from_s + k as f64 * step_s;
            let per_kg = 1.0 / (column.mass_at_ignition_kg - burn.burnt_kg(at_s + 0.5 * step_s));
            // The vehicle is upright once it settles.
            let leaning = ((INTERVALS - k) as f64 - settled).clamp(0.0, 1.0);
            (burn.mean_thrust_n(at_s, step_s) * per_kg, per_kg, leaning)
        });
        Self {
            step_s,
            gravity_m_s2: column.gravity_m_s2,
            vertical_m_s,
            touchdown_m_s: column.touchdown_m_s,
            soft: Share::new(column, &column.soft),
            hard: Share::new(column, &column.hard),
            upright: Share::new(column, &Braking { tilt_rad: 0.0, ..column.soft }),
            ahead,
        }
    }

    /// Vertical velocity at the end with the softest braking, m/s.
    pub(super) fn softest_m_s(&self) -> f64 {
        self.along(Way::Even, 1.0).vertical_m_s
    }

    /// The heights from which landings begin, one for each way of braking that reaches the touchdown speed without
    /// rising before.
    pub(super) fn heights_m(&self) -> [Option<f64>; 3] {
        // All ways have the same two extremes.
        let ends = [self.along(Way::Even, 0.0), self.along(Way::Even, 1.0)];
        [Way::SoftFirst, Way::HardFirst, Way::Even].map(|way| self.height_m(way, ends))
    }

    /// Finds the parameter that gives the touchdown speed, by false position. The value of an end that stays twice is
    /// halved (the Illinois rule; Dowell and Jarratt, BIT 11, 1971).
    fn height_m(&self, way: Way, ends: [Ended; 2]) -> Option<f64> {
        let missed = |ended: &Ended| ended.vertical_m_s - self.touchdown_m_s;
        let [mut one, mut other] = [(0.0, missed(&ends[0])), (1.0, missed(&ends[1]))];
        if one.1 * other.1 > 0.0 {
            return None;
        }
        for _ in 0..MOST_FALLS {
            let span_m_s = other.1 - one.1;
            let parameter =
                if span_m_s.abs() > 0.0 { one.0 - one.1 * (other.0 - one.0) / span_m_s } else { other.0 };
            let ended = self.along(way, parameter);
            let miss_m_s = missed(&ended);
            if miss_m_s.abs() < MET_M_S {
                return (ended.highest_m_s <= RISING_M_S).then_some(ended.fallen_m);
            }
            // `other` is the newest point.
            if miss_m_s * other.1 < 0.0 {
                one = other;
            } else {
                one.1 *= 0.5;
            }
            other = (parameter, miss_m_s);
        }
        None
    }

    fn along(&self, way: Way, parameter: f64) -> Ended {
        let step_s = self.step_s;
        let soft_intervals = parameter * INTERVALS as f64;
        let mut end =
            Ended { fallen_m: 0.0, vertical_m_s: self.vertical_m_s, highest_m_s: f64::NEG_INFINITY };
        for (k, (thrust_m_s2, per_kg, leaning)) in self.ahead.iter().enumerate() {
            let softly = match way {
                Way::SoftFirst => (soft_intervals - k as f64).clamp(0.0, 1.0),
                Way::HardFirst => (soft_intervals - (INTERVALS - 1 - k) as f64).clamp(0.0, 1.0),
                Way::Even => parameter,
            };
            let braking = self.soft.mixed(softly, &self.hard).mixed(*leaning, &self.upright);
            let pushed_m_s2 = thrust_m_s2 * braking.thrust - self.gravity_m_s2;
            let drag_per_m = braking.drag_per_v2 * per_kg;
            let acceleration = |speed_m_s: f64| pushed_m_s2 - drag_per_m * speed_m_s * speed_m_s.abs();
            // Midpoint rule.
            let midway_m_s = end.vertical_m_s + 0.5 * step_s * acceleration(end.vertical_m_s);
            end.fallen_m -= step_s * midway_m_s;
            end.vertical_m_s += step_s * acceleration(midway_m_s);
            end.highest_m_s = end.highest_m_s.max(end.vertical_m_s);
        }
        end
    }
}
