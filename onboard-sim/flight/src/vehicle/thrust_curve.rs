//! A solid motor's thrust over time.
//!
//! Thrust is linear between the points and zero outside them, so impulse and mean thrust are exact.
//! Propellant burns in proportion to the delivered impulse (a constant exhaust velocity: G. P.
//! Sutton and O. Biblarz, Rocket Propulsion Elements, 9th edition, chapter 2).

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// One point of a thrust curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustPoint {
    /// Time since the thrust began, s.
    pub time_s: f64,
    pub thrust_n: f64,
}

/// A motor: its thrust curve, masses and size.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ThrustCurve {
    data: MotorData,
    /// Impulse up to each point, N s.
    impulse_n_s: Vec<f64>,
}

/// The data of a motor file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotorData {
    /// Its name ("H45W").
    pub name: String,
    pub manufacturer: String,
    /// Diameter of the casing, m.
    pub diameter_m: f64,
    /// Length of the casing, m.
    pub length_m: f64,
    /// Mass of the propellant before ignition, kg.
    pub propellant_mass_kg: f64,
    /// Mass of the motor before ignition, kg.
    pub total_mass_kg: f64,
    /// Thrust over time. Times are finite and increase; thrusts are finite and not negative.
    pub points: Vec<ThrustPoint>,
}

impl ThrustCurve {
    /// The motor from this data; `None` if it has no thrust after its first point.
    pub fn new(data: MotorData) -> Option<Self> {
        let points = &data.points;
        let mut impulse_n_s = Vec::with_capacity(points.len());
        let mut sum_n_s = 0.0;
        impulse_n_s.push(sum_n_s);
        for pair in points.windows(2) {
            if let [from, to] = pair {
                sum_n_s += 0.5 * (from.thrust_n + to.thrust_n) * (to.time_s - from.time_s);
                impulse_n_s.push(sum_n_s);
            }
        }
        if points.len() < 2 || !(sum_n_s.is_finite() && sum_n_s > 0.0) {
            return None;
        }
        Some(Self { data, impulse_n_s })
    }

    /// This motor with another impulse in another time, as factors.
    #[must_use]
    pub fn scaled(&self, impulse: f64, burn_time: f64) -> Self {
        let point = |point: &ThrustPoint| ThrustPoint {
            time_s: point.time_s * burn_time,
            thrust_n: point.thrust_n * impulse / burn_time,
        };
        Self {
            data: MotorData { points: self.points().iter().map(point).collect(), ..self.data.clone() },
            impulse_n_s: self.impulse_n_s.iter().map(|before_n_s| before_n_s * impulse).collect(),
        }
    }

    /// The motor whose thrust and masses lie this share of the way from this one's to another's,
    /// named after both.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |here: f64, there: f64| here + share * (there - here);
        let mut times_s: Vec<f64> =
            [self.points(), other.points()].into_iter().flatten().map(|p| p.time_s).collect();
        times_s.sort_by(f64::total_cmp);
        times_s.dedup();
        let points = times_s.into_iter().map(|time_s| ThrustPoint {
            time_s,
            thrust_n: between(self.thrust_at_n(time_s), other.thrust_at_n(time_s)),
        });
        let data = MotorData {
            name: format!("{} towards {}", self.name(), other.name()),
            propellant_mass_kg: between(self.propellant_mass_kg(), other.propellant_mass_kg()),
            total_mass_kg: between(self.total_mass_kg(), other.total_mass_kg()),
            points: points.collect(),
            ..self.data.clone()
        };
        Self::new(data).unwrap_or_else(|| self.clone())
    }

    /// This motor with another mass before ignition, kg; the propellant stays.
    #[must_use]
    pub fn weighing(self, total_mass_kg: f64) -> Self {
        Self { data: MotorData { total_mass_kg, ..self.data }, ..self }
    }

    /// The motor's name as its file has it ("H45W").
    pub fn name(&self) -> &str {
        &self.data.name
    }

    /// The manufacturer as the file has it ("AT").
    pub fn manufacturer(&self) -> &str {
        &self.data.manufacturer
    }

    /// Diameter of the casing, m.
    pub fn diameter_m(&self) -> f64 {
        self.data.diameter_m
    }

    /// Length of the casing, m.
    pub fn length_m(&self) -> f64 {
        self.data.length_m
    }

    /// Mass of the propellant before ignition, kg.
    pub fn propellant_mass_kg(&self) -> f64 {
        self.data.propellant_mass_kg
    }

    /// Mass of the motor before ignition, kg.
    pub fn total_mass_kg(&self) -> f64 {
        self.data.total_mass_kg
    }

    /// The square of the casing's radius of gyration across its axis, m^2, taken as a full
    /// cylinder.
    pub fn gyration_m2(&self) -> f64 {
        self.data.length_m * self.data.length_m / 12.0 + self.data.diameter_m * self.data.diameter_m / 16.0
    }

    /// The points, in order of time; at least two.
    pub fn points(&self) -> &[ThrustPoint] {
        &self.data.points
    }

    /// Time of the last point, s.
    pub fn burn_time_s(&self) -> f64 {
        self.data.points.last().map_or(0.0, |point| point.time_s)
    }

    /// Impulse of the whole burn, N s.
    pub fn total_impulse_n_s(&self) -> f64 {
        self.impulse_n_s.last().copied().unwrap_or(0.0)
    }

    /// Highest thrust, N.
    pub fn peak_thrust_n(&self) -> f64 {
        self.data.points.iter().fold(0.0, |peak: f64, point| peak.max(point.thrust_n))
    }

    /// The segment that contains a time: its ends and the impulse before it. `None` outside the
    /// burn.
    fn segment(&self, time_s: f64) -> Option<(ThrustPoint, ThrustPoint, f64)> {
        let after = self.data.points.partition_point(|point| point.time_s <= time_s);
        let from = *self.data.points.get(after.checked_sub(1)?)?;
        Some((from, *self.data.points.get(after)?, *self.impulse_n_s.get(after - 1)?))
    }

    /// Thrust at a time since it began, N; zero before and after the burn.
    pub fn thrust_at_n(&self, time_s: f64) -> f64 {
        self.segment(time_s).map_or(0.0, |(from, to, _)| interpolate_n(from, to, time_s))
    }

    /// Impulse delivered up to a time since the thrust began, N s.
    pub fn impulse_to_n_s(&self, time_s: f64) -> f64 {
        match self.segment(time_s) {
            Some((from, to, before_n_s)) => {
                let now_n = interpolate_n(from, to, time_s);
                before_n_s + 0.5 * (from.thrust_n + now_n) * (time_s - from.time_s)
            }
            None if time_s >= self.burn_time_s() => self.total_impulse_n_s(),
            None => 0.0,
        }
    }

    /// Mean thrust over `[from_s, from_s + duration_s]`, N; the thrust itself for a duration that
    /// is not positive.
    pub fn mean_thrust_n(&self, from_s: f64, duration_s: f64) -> f64 {
        if duration_s > 0.0 {
            (self.impulse_to_n_s(from_s + duration_s) - self.impulse_to_n_s(from_s)) / duration_s
        } else {
            self.thrust_at_n(from_s)
        }
    }

    /// Propellant burnt up to a time since the thrust began, kg.
    pub fn propellant_burnt_kg(&self, time_s: f64) -> f64 {
        self.data.propellant_mass_kg * self.impulse_to_n_s(time_s) / self.total_impulse_n_s()
    }

    /// When the thrust falls through a value for the last time, s; `None` if it never exceeds the
    /// value.
    pub fn falls_through_s(&self, thrust_n: f64) -> Option<f64> {
        let last_above = self.data.points.iter().rposition(|point| point.thrust_n > thrust_n)?;
        let from = self.data.points.get(last_above)?;
        let Some(to) = self.data.points.get(last_above + 1) else { return Some(from.time_s) };
        let share = (from.thrust_n - thrust_n) / (from.thrust_n - to.thrust_n);
        Some(from.time_s + share.min(1.0) * (to.time_s - from.time_s))
    }
}

fn interpolate_n(from: ThrustPoint, to: ThrustPoint, time_s: f64) -> f64 {
    let share = (time_s - from.time_s) / (to.time_s - from.time_s);
    from.thrust_n + share * (to.thrust_n - from.thrust_n)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicles::thrust_curve::from_rasp;

    /// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down.
    const TRAPEZIUM: &str =
        "; a comment\r\nT40 38 200 6-10 0.12 0.3 Some Maker\n1 40 ; inline\n3 40\n4 0\n;\n";

    fn trapezium() -> ThrustCurve {
        from_rasp(TRAPEZIUM).unwrap()
    }

    #[test]
    fn thrust_impulse_and_mass_of_a_trapezium() {
        let motor = trapezium();
        for (time_s, thrust_n, impulse_n_s) in [
            (-1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            (0.5, 20.0, 5.0),
            (1.0, 40.0, 20.0),
            (2.0, 40.0, 60.0),
            (3.5, 20.0, 115.0),
            (4.0, 0.0, 120.0),
            (9.0, 0.0, 120.0),
        ] {
            assert!((motor.thrust_at_n(time_s) - thrust_n).abs() < 1e-12, "{time_s}");
            assert!((motor.impulse_to_n_s(time_s) - impulse_n_s).abs() < 1e-12, "{time_s}");
            assert!((motor.propellant_burnt_kg(time_s) - 0.12 * impulse_n_s / 120.0).abs() < 1e-12);
        }
        assert!((motor.mean_thrust_n(0.5, 3.0) - 110.0 / 3.0).abs() < 1e-12);
        assert!((motor.mean_thrust_n(2.0, 0.0) - 40.0).abs() < 1e-12);
        assert!((motor.burn_time_s() - 4.0).abs() < 1e-15);
        assert!((motor.peak_thrust_n() - 40.0).abs() < 1e-15);
    }

    #[test]
    fn the_last_fall_of_the_thrust_through_a_value_is_found() {
        let motor = trapezium();
        assert!((motor.falls_through_s(10.0).unwrap() - 3.75).abs() < 1e-12);
        assert!((motor.falls_through_s(0.0).unwrap() - 4.0).abs() < 1e-12);
        assert_eq!(motor.falls_through_s(40.0), None);
        let two_humps = from_rasp("T 38 200 0 0.1 0.2 M\n1 30\n2 10\n3 30\n4 0").unwrap();
        assert!((two_humps.falls_through_s(20.0).unwrap() - 10.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn val_hand_a_scaled_motor() {
        let found = from_rasp("T40 38 200 P 0.12 0.3 M\n1 40\n3 40\n4 0\n").unwrap().scaled(1.1, 2.0);
        assert!(
            (found.total_impulse_n_s() - 132.0).abs() < 1e-9 && (found.burn_time_s() - 8.0).abs() < 1e-12
        );
        assert!((found.thrust_at_n(4.0) - 22.0).abs() < 1e-12);
        assert!((found.mean_thrust_n(0.0, 8.0) - 16.5).abs() < 1e-12);
        assert!((found.propellant_mass_kg() - 0.12).abs() < 1e-12);
    }

    #[test]
    fn val_hand_a_motor_half_way_has_the_mean_of_both_at_every_time() {
        let (here, there) = (trapezium(), from_rasp("S 38 200 P 0.06 0.5 M\n0.1 60\n2 60\n2.1 0\n").unwrap());
        let middle = here.towards(&there, 0.5);
        for (time_s, thrust_n) in
            [(0.05, 16.0), (0.1, 32.0), (1.0, 50.0), (2.05, 35.0), (3.5, 10.0), (4.0, 0.0)]
        {
            assert!((middle.thrust_at_n(time_s) - thrust_n).abs() < 1e-9, "{time_s}");
        }
        // 120 N s, and 60 N over 2.1 s less twice half a tenth of a second: 120 N s.
        assert!((middle.total_impulse_n_s() - 120.0).abs() < 1e-9);
        assert!(
            (middle.propellant_mass_kg() - 0.09).abs() < 1e-12
                && (middle.total_mass_kg() - 0.4).abs() < 1e-12
        );
        assert_eq!(middle.name(), "T40 towards S");
        let stays = here.towards(&there, 0.0);
        assert!((stays.impulse_to_n_s(3.0) - here.impulse_to_n_s(3.0)).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn a_curve_that_parses_has_sound_numbers(
            rows in proptest::collection::vec((-1.0..9.0_f64, -1.0..99.0_f64), 0..8),
            times in proptest::collection::vec(proptest::num::f64::ANY, 4),
        ) {
            let rows = rows.iter().map(|(time_s, thrust_n)| format!("{time_s} {thrust_n}\n"));
            let text: String = core::iter::once("T 38 100 0 0.1 0.2 M\n".to_owned()).chain(rows).collect();
            if let Ok(motor) = from_rasp(&text) {
                for time_s in times {
                    let thrust_n = motor.thrust_at_n(time_s);
                    prop_assert!((0.0..=motor.peak_thrust_n() * (1.0 + 1e-12)).contains(&thrust_n));
                    let impulse_n_s = motor.impulse_to_n_s(time_s);
                    prop_assert!((0.0..=motor.total_impulse_n_s() * (1.0 + 1e-12)).contains(&impulse_n_s));
                }
            }
        }
    }
}
