//! The landing burn in one dimension: what heights a landing can begin from.
//!
//! The vehicle has no throttle, but two things take vertical thrust away or add to the drag: its tilt, and its fins.
//! Both are bounded, so at every instant the deceleration lies between a soft and a hard one. A landing must arrive
//! with both height and sinking speed near zero, not before the thrust falls through the weight, or it would lift off
//! again. For a bounded double integrator the extremes are bang-bang: the highest start decelerates softly first and
//! hard later, the lowest start hard first and softly later, but never so that the vehicle rises. Braking evenly lies
//! in between. The heights that these begin at span the band of feasible heights ([`Column::band`]), and where in it
//! the vehicle is says how hard to brake ([`Band::place`]). The last moments are flown upright, to arrive settled.
//!
//! Tilting at speed costs nothing in deceleration: the body lies across the air and its own drag makes up for the
//! lost thrust. The model has that drag, `1/2 rho V^2 S_n sin^3`, so it knows that fins are the early throttle and
//! tilt the late one.

use crate::burn::Burn;

/// Intervals of the outlook.
const INTERVALS: usize = 40;
/// End times tried between thrust falling through weight and the latest.
const END_TIMES: usize = 4;
/// Halvings of a switching time: to a millionth of the burn.
const HALVINGS: usize = 20;
/// Faster upwards than this, a vehicle rises, m/s.
const RISING_M_S: f64 = 0.05;

/// How hard the vehicle brakes: its tilt and its fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Braking {
    /// Tilt from the vertical, rad.
    pub tilt_rad: f64,
    /// Drag area of the fins together, `C S`, m^2.
    pub fin_drag_area_m2: f64,
}

/// What the vertical motion depends on, besides the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Mass before ignition, kg.
    pub mass_at_ignition_kg: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
    /// Air density, kg/m^3.
    pub air_density_kg_m3: f64,
    /// Drag area of the body along its axis, m^2.
    pub body_drag_area_m2: f64,
    /// Drag area of the body across its axis, m^2.
    pub crossflow_area_m2: f64,
    /// The softest braking that is still controllable.
    pub soft: Braking,
    /// The hardest braking.
    pub hard: Braking,
    /// Vertical velocity at touchdown, m/s, up positive (so below zero).
    pub touchdown_m_s: f64,
    /// How long after thrust has fallen through the weight the touchdown may come at the latest, s.
    pub latest_after_s: f64,
    /// How long before touchdown the vehicle is upright already, s.
    pub settle_s: f64,
}

/// Heights from which a landing exists, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Band {
    /// Lowest start.
    pub low_m: f64,
    /// Highest start.
    pub high_m: f64,
}

impl Band {
    /// Where in the band a height lies: 0 at its low end, 1 at its high end, outside beyond.
    pub fn place(&self, height_m: f64) -> f64 {
        (height_m - self.low_m) / (self.high_m - self.low_m).max(1e-3)
    }

    /// The part common to both; `None` if there is none.
    pub fn and(&self, other: &Self) -> Option<Self> {
        let both = Self { low_m: self.low_m.max(other.low_m), high_m: self.high_m.min(other.high_m) };
        (both.low_m <= both.high_m).then_some(both)
    }

    /// Whether a height lies inside.
    pub fn contains(&self, height_m: f64) -> bool {
        (self.low_m..=self.high_m).contains(&height_m)
    }
}

/// Thrust and mass ahead, in equal intervals up to an end time.
struct Outlook {
    step_s: f64,
    thrust_n: [f64; INTERVALS],
    mass_kg: [f64; INTERVALS],
}

impl Outlook {
    fn new(burn: &Burn<'_>, mass_at_ignition_kg: f64, from_s: f64, to_s: f64) -> Self {
        let step_s = (to_s - from_s) / INTERVALS as f64;
        let mut outlook = Self { step_s, thrust_n: [0.0; INTERVALS], mass_kg: [0.0; INTERVALS] };
        for (k, (thrust_n, mass_kg)) in outlook.thrust_n.iter_mut().zip(&mut outlook.mass_kg).enumerate() {
            let at_s = from_s + k as f64 * step_s;
            *thrust_n = burn.mean_thrust_n(at_s, step_s);
            *mass_kg = mass_at_ignition_kg - burn.burnt_kg(at_s + 0.5 * step_s);
        }
        outlook
    }
}

/// Thrust and drag of braking.
struct Share {
    thrust: f64,
    drag_per_v2: f64,
}

/// A family of ways to brake, with one parameter between 0 and 1.
enum Way<'a> {
    /// One first, then the other; the parameter is the share of the time.
    Switch(&'a Share, &'a Share),
    /// A mixture of both throughout; the parameter is the second's share.
    Even(&'a Share, &'a Share),
}

impl Way<'_> {
    /// Braking in interval `k`.
    fn at(&self, k: f64, parameter: f64) -> Share {
        let (first, then, share) = match self {
            Self::Switch(first, then) => (first, then, (parameter * INTERVALS as f64 - k).clamp(0.0, 1.0)),
            Self::Even(first, then) => (first, then, 1.0 - parameter),
        };
        Share {
            thrust: share * first.thrust + (1.0 - share) * then.thrust,
            drag_per_v2: share * first.drag_per_v2 + (1.0 - share) * then.drag_per_v2,
        }
    }
}

/// How a fall ends.
struct Fall {
    fallen_m: f64,
    vertical_m_s: f64,
    highest_m_s: f64,
}

impl Column {
    fn share(&self, braking: &Braking) -> Share {
        let (sin, cos) = libm::sincos(braking.tilt_rad);
        let area_m2 = self.body_drag_area_m2 * cos * cos
            + braking.fin_drag_area_m2
            + self.crossflow_area_m2 * sin * sin * sin;
        Share { thrust: cos, drag_per_v2: 0.5 * self.air_density_kg_m3 * area_m2 }
    }

    /// Heights from which a landing exists, burning since `burning_s` (0 for an ignition now) and moving vertically at
    /// `vertical_m_s` (up positive); `None` if none does.
    pub fn band(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> Option<Band> {
        let carried_until_s = burn.falls_through_weight_s(self.mass_at_ignition_kg, self.gravity_m_s2)?;
        let soonest_s = carried_until_s.max(burning_s + 0.02);
        let mut band: Option<Band> = None;
        for i in 0..END_TIMES {
            let end_s = soonest_s + self.latest_after_s * i as f64 / (END_TIMES - 1) as f64;
            let outlook = Outlook::new(burn, self.mass_at_ignition_kg, burning_s, end_s);
            let (soft, hard) = (self.share(&self.soft), self.share(&self.hard));
            let ways = [Way::Switch(&soft, &hard), Way::Switch(&hard, &soft), Way::Even(&soft, &hard)];
            for height_m in ways.iter().filter_map(|way| self.height_of(&outlook, vertical_m_s, way)) {
                band = Some(band.map_or(Band { low_m: height_m, high_m: height_m }, |band| Band {
                    low_m: band.low_m.min(height_m),
                    high_m: band.high_m.max(height_m),
                }));
            }
        }
        band
    }

    /// The height that a way of braking begins at; `None` if it cannot arrive at the touchdown speed however it is
    /// divided, or rises on the way.
    fn height_of(&self, outlook: &Outlook, vertical_m_s: f64, way: &Way<'_>) -> Option<f64> {
        let end = |parameter: f64| self.fall(outlook, vertical_m_s, way, parameter);
        let (mut low, mut high) = (0.0, 1.0);
        let rises = end(high).vertical_m_s > end(low).vertical_m_s;
        let reached = |parameter: f64| (end(parameter).vertical_m_s > self.touchdown_m_s) == rises;
        if reached(low) || !reached(high) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if reached(middle) { high = middle } else { low = middle }
        }
        let end = end(high);
        (end.highest_m_s <= RISING_M_S).then_some(end.fallen_m)
    }

    /// Falls along the outlook.
    fn fall(&self, outlook: &Outlook, vertical_m_s: f64, way: &Way<'_>, parameter: f64) -> Fall {
        let step_s = outlook.step_s;
        let settled = self.settle_s / step_s;
        let upright = self.share(&Braking { tilt_rad: 0.0, ..self.soft });
        let mut fall = Fall { fallen_m: 0.0, vertical_m_s, highest_m_s: f64::NEG_INFINITY };
        for (k, (thrust_n, mass_kg)) in outlook.thrust_n.iter().zip(&outlook.mass_kg).enumerate() {
            let braking = way.at(k as f64, parameter);
            // Upright from the settling on.
            let leaning = (INTERVALS as f64 - settled - k as f64).clamp(0.0, 1.0);
            let cosine = leaning * braking.thrust + (1.0 - leaning) * upright.thrust;
            let drag_per_v2 = leaning * braking.drag_per_v2 + (1.0 - leaning) * upright.drag_per_v2;
            let acceleration = |speed_m_s: f64| {
                (thrust_n * cosine - drag_per_v2 * speed_m_s * speed_m_s.abs()) / mass_kg - self.gravity_m_s2
            };
            // Midpoint rule.
            let midway_m_s = fall.vertical_m_s + 0.5 * step_s * acceleration(fall.vertical_m_s);
            fall.fallen_m -= step_s * midway_m_s;
            fall.vertical_m_s += step_s * acceleration(midway_m_s);
            fall.highest_m_s = fall.highest_m_s.max(fall.vertical_m_s);
        }
        fall
    }

    /// Height, m, and vertical velocity, m/s, after falling without thrust for a time.
    pub fn fallen(&self, height_m: f64, vertical_m_s: f64, fin_drag_area_m2: f64, time_s: f64) -> (f64, f64) {
        /// Short enough for the midpoint rule at any speed a fall has.
        const STEP_S: f64 = 0.05;
        let steps = libm::ceil(time_s / STEP_S).max(1.0);
        let step_s = time_s / steps;
        let area_m2 = self.body_drag_area_m2 + fin_drag_area_m2;
        let drag_per_v2 = 0.5 * self.air_density_kg_m3 * area_m2 / self.mass_at_ignition_kg;
        let acceleration = |speed_m_s: f64| -self.gravity_m_s2 - drag_per_v2 * speed_m_s * speed_m_s.abs();
        let (mut height_m, mut vertical_m_s) = (height_m, vertical_m_s);
        for _ in 0..steps as u32 {
            let midway_m_s = vertical_m_s + 0.5 * step_s * acceleration(vertical_m_s);
            height_m += step_s * midway_m_s;
            vertical_m_s += step_s * acceleration(midway_m_s);
        }
        (height_m, vertical_m_s)
    }

    /// How much of the fins to open, 0 to 1, to stay at a place in the band, from the height the vehicle has.
    ///
    /// Without a band the vehicle is too fast or too slow for any landing, and the answer is an end of the range.
    pub fn fin_share(
        &self,
        burn: &Burn<'_>,
        burning_s: f64,
        vertical_m_s: f64,
        height_m: f64,
        place: f64,
    ) -> f64 {
        /// Share of the fins per share of the band.
        const GAIN: f64 = 1.5;
        /// A band is taken to be at least this wide, in time at the present speed, s: above a narrow band lies hardly
        /// a landing, but closing the fins would only make the vehicle faster.
        const NARROW_S: f64 = 0.25;
        match self.band(burn, burning_s, vertical_m_s) {
            Some(band) => {
                let at_least = Band { high_m: band.high_m.max(band.low_m - NARROW_S * vertical_m_s), ..band };
                (0.5 + GAIN * (place - at_least.place(height_m))).clamp(0.0, 1.0)
            }
            // Falling slower than a landing would: let it fall.
            None if vertical_m_s > -1.0 || self.stops_too_soon(burn, burning_s, vertical_m_s) => 0.0,
            None => 1.0,
        }
    }

    /// Whether even the softest braking stops the vehicle before the thrust falls through the weight.
    fn stops_too_soon(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> bool {
        let carried_until_s = burn.falls_through_weight_s(self.mass_at_ignition_kg, self.gravity_m_s2);
        carried_until_s.filter(|end_s| *end_s > burning_s).is_some_and(|end_s| {
            let soft = self.share(&self.soft);
            let outlook = Outlook::new(burn, self.mass_at_ignition_kg, burning_s, end_s);
            let fall = self.fall(&outlook, vertical_m_s, &Way::Even(&soft, &soft), 0.0);
            fall.vertical_m_s > self.touchdown_m_s
        })
    }

    /// Vertical speed of the unpowered fall, m/s, falling positive, that would not change any more.
    pub fn terminal_speed_m_s(&self, fin_drag_area_m2: f64) -> f64 {
        let area_m2 = self.body_drag_area_m2 + fin_drag_area_m2;
        (2.0 * self.mass_at_ignition_kg * self.gravity_m_s2 / (self.air_density_kg_m3 * area_m2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motors;

    fn column() -> Column {
        Column {
            mass_at_ignition_kg: 3.13,
            gravity_m_s2: 9.80665,
            air_density_kg_m3: 1.2,
            body_drag_area_m2: 0.0043,
            crossflow_area_m2: 0.0622,
            soft: Braking { tilt_rad: 40_f64.to_radians(), fin_drag_area_m2: 0.0 },
            hard: Braking { tilt_rad: 0.0, fin_drag_area_m2: 0.0267 },
            touchdown_m_s: -0.15,
            latest_after_s: 0.5,
            settle_s: 0.3,
        }
    }

    #[test]
    fn a_weak_motor_narrows_the_band_and_a_hopeless_one_closes_it() {
        let curve = motors::builtin("H45W").expect("built in");
        let column = column();
        let speed_m_s = -column.terminal_speed_m_s(0.0267);
        let band = |impulse_scale| {
            column.band(&Burn { curve: &curve, impulse_scale, time_scale: 1.0 }, 0.0, speed_m_s)
        };
        let (nominal, weak) = (band(1.0).expect("lands"), band(0.92).expect("lands"));
        assert!(nominal.low_m < 58.0 && nominal.high_m > 72.0, "{nominal:?}");
        assert!(weak.high_m - weak.low_m < 0.5 * (nominal.high_m - nominal.low_m), "{weak:?}");
        assert_eq!(nominal.and(&weak), Some(weak), "a start that suits the weak motor suits the nominal one");
        assert_eq!(band(0.8), None);
    }

    #[test]
    fn every_way_of_braking_begins_inside_the_band_and_arrives_at_the_touchdown_speed() {
        let curve = motors::builtin("H45W").expect("built in");
        let column = column();
        let burn = Burn::nominal(&curve);
        let band = column.band(&burn, 1.0, -25.0).expect("lands");
        let end_s = burn.falls_through_weight_s(3.13, 9.80665).expect("carried");
        let outlook = Outlook::new(&burn, 3.13, 1.0, end_s);
        let (soft, hard) = (column.share(&column.soft), column.share(&column.hard));
        let mut found = 0;
        for way in [Way::Switch(&soft, &hard), Way::Switch(&hard, &soft), Way::Even(&soft, &hard)] {
            if let Some(height_m) = column.height_of(&outlook, -25.0, &way) {
                assert!(band.contains(height_m), "{height_m} in {band:?}");
                found += 1;
            }
        }
        assert!(found >= 2, "{found}");
        assert!((band.place(band.low_m), band.place(band.high_m)) == (0.0, 1.0));
    }
}
