//! The true landing motor: `T(t) = s/b T0(t/b) (1 + sum of a_k cos(k pi i))` for impulse scale s,
//! burn-time scale b and the fraction i of the impulse that `T0` has delivered by then. The cosines
//! have no mean over the impulse, so a shape preserves it.
//!
//! Burn rate and pressure change thrust and time against each other at the same impulse (G. P.
//! Sutton and O. Biblarz, Rocket Propulsion Elements, 9th edition, chapter 12).

use core::f64::consts::PI;

use flight::vehicle::thrust_curve::ThrustCurve;

use crate::world::truth::{Fault, SHAPE_TERMS, Truth};

/// The true burn over the time since the thrust began.
#[derive(Debug, Clone)]
pub struct TrueBurn {
    curve: ThrustCurve,
    impulse_scale: f64,
    burn_time_scale: f64,
    shape: [f64; SHAPE_TERMS],
}

impl TrueBurn {
    /// The burn of a motor file's curve as the truth changes it.
    pub fn new(curve: &ThrustCurve, truth: &Truth) -> Self {
        Self {
            curve: curve.clone(),
            impulse_scale: truth.impulse_scale,
            burn_time_scale: truth.burn_time_scale,
            shape: truth.thrust_shape,
        }
    }

    /// Thrust, N; zero before and after the burn.
    pub fn thrust_n(&self, burning_s: f64) -> f64 {
        let curve_s = burning_s / self.burn_time_scale;
        let curve_n = self.curve.thrust_at_n(curve_s);
        if curve_n == 0.0 {
            return 0.0;
        }
        self.impulse_scale / self.burn_time_scale * curve_n * self.shape_at(curve_s).0
    }

    /// Propellant burnt so far, kg.
    pub fn burnt_kg(&self, burning_s: f64) -> f64 {
        if burning_s <= 0.0 {
            return 0.0;
        }
        if burning_s >= self.lasts_s() {
            return self.curve.propellant_mass_kg();
        }
        let curve_s = burning_s / self.burn_time_scale;
        let more_kg = self.shape_at(curve_s).1 * self.curve.propellant_mass_kg();
        self.curve.propellant_burnt_kg(curve_s) + more_kg
    }

    /// How long the motor burns, s.
    pub fn lasts_s(&self) -> f64 {
        self.curve.burn_time_s() * self.burn_time_scale
    }

    /// Propellant burnt for each newton second, kg: the mass flow divided by the thrust.
    fn flow_kg_n_s(&self) -> f64 {
        self.curve.propellant_mass_kg() / (self.curve.total_impulse_n_s() * self.impulse_scale)
    }

    /// Factor of the shape on the thrust at a time on the file's curve, and the resulting change of
    /// the delivered impulse, as a fraction.
    fn shape_at(&self, curve_s: f64) -> (f64, f64) {
        if self.shape.iter().all(|amplitude| *amplitude == 0.0) {
            return (1.0, 0.0);
        }
        let given = self.curve.propellant_burnt_kg(curve_s) / self.curve.propellant_mass_kg();
        let (sin, cos) = libm::sincos(PI * given);
        // cos and sin of k times the angle, k from 1.
        let (mut sin_k, mut cos_k) = (sin, cos);
        let (mut factor, mut more) = (1.0, 0.0);
        for (k, amplitude) in (1..).zip(self.shape) {
            factor += amplitude * cos_k;
            more += amplitude * sin_k / (PI * f64::from(k));
            (sin_k, cos_k) = (sin_k * cos + cos_k * sin, cos_k * cos - sin_k * sin);
        }
        (factor, more)
    }
}

/// The true motor with its igniter.
#[derive(Debug, Clone)]
pub(crate) struct Motor {
    burn: TrueBurn,
    /// How long current must flow through the igniter, s.
    ignition_delay_s: f64,
    /// How long the thrust hangs behind a fired igniter, s.
    hang_fire_s: f64,
    chuff_s: [f64; 2],
    thrust_rise_s: f64,
    /// Since when current flows through the igniter, s; once it has fired, since when it did.
    current_since_s: Option<f64>,
    no_light: bool,
    out_after_s: f64,
}

impl Motor {
    pub(crate) fn new(curve: &ThrustCurve, truth: &Truth) -> Self {
        Self {
            burn: TrueBurn::new(curve, truth),
            ignition_delay_s: truth.ignition_delay_s,
            hang_fire_s: 0.0,
            chuff_s: truth.chuff_s,
            thrust_rise_s: truth.thrust_rise_s,
            current_since_s: None,
            no_light: false,
            out_after_s: f64::INFINITY,
        }
    }

    /// This motor with the curve and scales of `after`; `before` is the truth that it was built
    /// from. Faults stay, with the same factor and delay.
    pub(crate) fn changed(&self, after: &Self, before: &Truth) -> Self {
        // Unchanged values are bit-identical.
        let (own_scale, new_scale) = (self.burn.impulse_scale, after.burn.impulse_scale);
        let impulse_scale = if new_scale.to_bits() == before.impulse_scale.to_bits() {
            own_scale
        } else {
            new_scale * (own_scale / before.impulse_scale)
        };
        let burn = TrueBurn { impulse_scale, ..after.burn.clone() };
        Self {
            burn,
            ignition_delay_s: after.ignition_delay_s,
            chuff_s: after.chuff_s,
            thrust_rise_s: after.thrust_rise_s,
            ..self.clone()
        }
    }

    /// Whether current flows through the igniter from this time on, s. It fires when the current
    /// has flowed for its delay without a break, and then nothing stops it.
    pub(crate) fn current(&mut self, flows: bool, time_s: f64) {
        let fired = self.current_since_s.is_some_and(|since_s| time_s >= since_s + self.ignition_delay_s);
        if flows {
            self.current_since_s.get_or_insert(time_s);
        } else if !fired {
            self.current_since_s = None;
        }
    }

    /// When the thrust begins, s, if the current stays on until the igniter has fired; `None`
    /// without current, and for a motor that does not light.
    pub(crate) fn thrust_begins_s(&self) -> Option<f64> {
        let delay_s = self.ignition_delay_s + self.hang_fire_s;
        self.current_since_s.filter(|_| !self.no_light).map(|since_s| since_s + delay_s)
    }

    /// Time since the thrust began, s; negative before that.
    fn burning_s(&self, time_s: f64) -> f64 {
        self.thrust_begins_s().map_or(-1.0, |begins_s| time_s - begins_s)
    }

    /// Thrust at a time, N.
    pub(crate) fn thrust_n(&self, time_s: f64) -> f64 {
        let burning_s = self.burning_s(time_s);
        if burning_s >= self.out_after_s {
            return 0.0;
        }
        let (curve_s, rate) = self.on_the_curve(burning_s);
        rate * self.burn.thrust_n(curve_s)
    }

    /// Mean thrust from a time on, over a length of time, s, by so many equal parts, N.
    pub(crate) fn mean_thrust_n(&self, from_s: f64, over_s: f64, parts: usize) -> f64 {
        let part_s = over_s / parts as f64;
        let each_n = (0..parts).map(|part| self.thrust_n(from_s + part_s * (part as f64 + 0.5)));
        each_n.sum::<f64>() / parts as f64
    }

    /// A chuff and a slow rise burn the propellant later, without loss: the position of the burn on
    /// its curve, s, and its rate.
    fn on_the_curve(&self, burning_s: f64) -> (f64, f64) {
        let [burns_s, out_s] = self.chuff_s;
        if (burns_s..burns_s + out_s).contains(&burning_s) {
            return (self.risen(burns_s).0, 0.0);
        }
        self.risen(if burning_s < burns_s { burning_s } else { burning_s - out_s })
    }

    fn risen(&self, burning_s: f64) -> (f64, f64) {
        let rise_s = self.thrust_rise_s;
        if burning_s <= 0.0 || burning_s >= rise_s {
            return (if burning_s <= 0.0 { burning_s } else { burning_s - 0.5 * rise_s }, 1.0);
        }
        (0.5 * burning_s * burning_s / rise_s, burning_s / rise_s)
    }

    /// Propellant burnt up to a time, kg. After an early burn-out the unburnt rest is not counted.
    pub(crate) fn burnt_kg(&self, time_s: f64) -> f64 {
        self.burn.burnt_kg(self.on_the_curve(self.burning_s(time_s).min(self.out_after_s)).0)
    }

    /// Propellant burnt for each newton second, kg.
    pub(crate) fn flow_kg_n_s(&self) -> f64 {
        self.burn.flow_kg_n_s()
    }

    pub(crate) fn break_down(&mut self, fault: &Fault) {
        match *fault {
            Fault::NoLight => self.no_light = true,
            Fault::LateLight { delay_s } => self.hang_fire_s += delay_s.max(0.0),
            Fault::WeakMotor { scale } => self.burn.impulse_scale *= scale.clamp(0.01, 1.0),
            Fault::EarlyBurnout { after_s } => self.out_after_s = after_s.max(0.0),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 s up to 40 N, 2 s level, 1 s down: 120 N s, 0.12 kg.
    fn curve() -> ThrustCurve {
        flight::vehicles::thrust_curve::from_rasp("T 38 200 0 0.12 0.3 M\n1 40\n3 40\n4 0").unwrap()
    }

    fn motor(truth: &Truth) -> Motor {
        let mut motor = Motor::new(&curve(), truth);
        motor.current(true, 10.0);
        motor
    }

    #[test]
    fn impulse_and_burn_time_scale_the_curve() {
        let truth =
            Truth { impulse_scale: 1.1, burn_time_scale: 0.8, ignition_delay_s: 0.2, ..Truth::default() };
        let motor = motor(&truth);
        assert!(motor.thrust_n(10.19).abs() < 1e-15);
        assert!((motor.thrust_n(10.2 + 1.6) - 40.0 * 1.1 / 0.8).abs() < 1e-9);
        let impulse_n_s: f64 = (0..5000).map(|i| motor.thrust_n(10.0 + 1e-3 * f64::from(i)) * 1e-3).sum();
        assert!((impulse_n_s - 1.1 * 120.0).abs() < 1e-3, "{impulse_n_s}");
        assert!((motor.burnt_kg(20.0) - 0.12).abs() < 1e-12);
        assert!((motor.flow_kg_n_s() * 1.1 * 120.0 - 0.12).abs() < 1e-12);
    }

    /// A motor that chuffs for 0.1 s and is out for 0.2 s, and one whose thrust rises in 0.25 s.
    #[test]
    fn val_hand_a_bad_start_delays_the_burn_and_loses_no_impulse() {
        let begun = |truth: Truth| motor(&Truth { ignition_delay_s: 0.0, ..truth });
        let (good, chuffs, rises) = (
            begun(Truth::default()),
            begun(Truth { chuff_s: [0.1, 0.2], ..Truth::default() }),
            begun(Truth { thrust_rise_s: 0.25, ..Truth::default() }),
        );
        for since_s in [0.05, 0.0999] {
            assert!((chuffs.thrust_n(10.0 + since_s) - good.thrust_n(10.0 + since_s)).abs() < 1e-12);
        }
        assert!(chuffs.thrust_n(10.2) == 0.0 && (chuffs.burnt_kg(10.2) - good.burnt_kg(10.1)).abs() < 1e-12);
        for since_s in [0.31, 1.0, 3.5] {
            assert!((chuffs.thrust_n(10.0 + since_s) - good.thrust_n(9.8 + since_s)).abs() < 1e-9);
            assert!((rises.thrust_n(10.0 + since_s) - good.thrust_n(9.875 + since_s)).abs() < 1e-9);
        }
        for motor in [&good, &chuffs, &rises] {
            let impulse_n_s: f64 =
                (0..5000).map(|i| motor.thrust_n(10.0005 + 1e-3 * f64::from(i)) * 1e-3).sum();
            assert!((impulse_n_s - 120.0).abs() < 0.02, "{impulse_n_s}");
            assert!((motor.burnt_kg(20.0) - 0.12).abs() < 1e-12);
        }
    }

    #[test]
    fn val_hand_a_shape_changes_the_thrust_and_not_the_impulse() {
        let truth =
            Truth { thrust_shape: [0.1, -0.05, 0.0, 0.02, 0.0], ignition_delay_s: 0.0, ..Truth::default() };
        let motor = motor(&truth);
        // The curve gives 20 N s up to 1 s, 80 N s to 3 s, 20 N s to 4 s. At 2 s half of the
        // impulse is given: the cosines are 0, -1, 0, 1.
        assert!((motor.thrust_n(12.0) - 40.0 * (1.0 + 0.05 + 0.02)).abs() < 1e-9);
        let thrusts_n = (0..40_000).map(|i| motor.thrust_n(10.0 + 1e-4 * (f64::from(i) + 0.5)));
        let impulse_n_s: f64 = thrusts_n.map(|thrust_n| thrust_n * 1e-4).sum();
        assert!((impulse_n_s - 120.0).abs() < 1e-4, "{impulse_n_s}");
        // Half of the propellant, and 0.1 sin(pi/2) / pi + 0 + 0 - 0 of it more.
        assert!((motor.burnt_kg(12.0) - 0.12 * (0.5 + 0.1 / PI)).abs() < 1e-12);
        assert!((motor.burnt_kg(20.0) - 0.12).abs() < 1e-12);
    }

    #[test]
    fn a_motor_switched_off_before_ignition_does_not_light() {
        let mut burning = motor(&Truth::default());
        burning.current(true, 11.0);
        assert_eq!(burning.thrust_begins_s(), Some(10.24));
        burning.current(false, 10.241);
        assert_eq!(burning.thrust_begins_s(), Some(10.24), "nothing stops it any more");

        let mut off = motor(&Truth::default());
        off.current(false, 10.239);
        assert!(off.thrust_begins_s().is_none() && off.thrust_n(12.0).abs() < 1e-15);
        off.current(true, 20.0);
        assert_eq!(off.thrust_begins_s(), Some(20.24), "the delay restarts");

        // A motor that hangs fire ignites late, with or without current.
        let mut hangs = motor(&Truth::default());
        hangs.break_down(&Fault::LateLight { delay_s: 1.0 });
        hangs.current(false, 10.5);
        assert_eq!(hangs.thrust_begins_s(), Some(11.24));
    }

    #[test]
    fn faults() {
        let broken = |fault: Fault| {
            let mut motor = motor(&Truth { ignition_delay_s: 0.0, ..Truth::default() });
            motor.break_down(&fault);
            motor
        };
        assert!(broken(Fault::NoLight).thrust_n(12.0).abs() < 1e-15);
        let late = broken(Fault::LateLight { delay_s: 1.0 });
        assert!((late.thrust_n(11.5) - 20.0).abs() < 1e-9 && late.thrust_n(10.9).abs() < 1e-15);
        assert!((broken(Fault::WeakMotor { scale: 0.5 }).thrust_n(12.0) - 20.0).abs() < 1e-9);
        let out = broken(Fault::EarlyBurnout { after_s: 2.0 });
        assert!((out.thrust_n(11.9) - 40.0).abs() < 1e-9 && out.thrust_n(12.1).abs() < 1e-15);
        assert!((out.burnt_kg(20.0) - 0.06).abs() < 1e-12);
    }
}
