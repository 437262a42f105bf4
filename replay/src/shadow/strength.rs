//! Finds a weak motor in the strength that the vehicle estimates and sends.
//!
//! The vehicle's filter ([`flight::estimation::motor_estimate`]) begins with a strength of 1 and a standard deviation
//! `s0` (`motor.impulse_sigma`, 0.027: 2.5 % of impulse and 1 % of mass) and learns. How much it knows at a time depends on
//! the certified curve, not on the flight, so the shadow runs the same filter on the certified burn and reads its standard
//! deviation `s(t)`. The estimates of such a filter are a martingale: between two times an estimate of a motor as certified
//! changes by a normal number with mean zero and variance `s(t1)^2 - s(t2)^2`. Two tests follow.
//!
//! * Weak from the light: when the thrust falls below the weight, the estimate has the deviation `e = sqrt(s0^2 - s^2)`
//!   around 1 (0.026 for an F15, whose peak shows its impulse within a second; 0.023 for an H45, whose curve is flat). The
//!   bound is `1 - 2.5 e`, 0.935 and 0.942: a motor of the certified scatter ends below it with a probability of 0.6 %, and
//!   is ever below it with at most twice that (reflection). A motor of 0.90 of its impulse ends at 0.91 or below, three
//!   deviations of the estimate beyond the bound. Where the 10 % come on top of the scatter, the scatter itself is the
//!   limit: of such motors one in 15 is no weaker than the weakest in 100 of the certified ones, whatever is measured.
//! * Weaker all at once: a fall between any two frames by more than five of its deviations. A flight has some 400 pairs of
//!   frames: a false flag in 1 of 10,000 flights. It must also be more than 2 %, so that the filter's rounding and its gates,
//!   which the martingale does not know, do not count, and begin 0.75 s after the light: from then on the largest fall of 100
//!   nominal burns of an F15 is 1.3 %, and the smallest of 24 motors that lose 10 % in the burn 2.9 %.

use flight::estimation::motor_estimate::{MotorEstimate, MotorPrior, MotorSample};
use flight::vehicle::airframe::MassModel;
use flight::vehicle::atmosphere::Air;
use flight::vehicle::burn::Burn;
use flight::vehicle::mission::Mission;

/// The bound of a motor that was weak from the light on, standard deviations of the estimate at the end.
const WEAK_SIGMAS: f64 = 2.5;
/// The bounds of a fall: in its standard deviations, and in strength.
const FALL_SIGMAS: f64 = 5.0;
const FALL_LEAST: f64 = 0.02;
/// Before this time since the thrust began the filter tells impulse, burn time and instant of ignition apart, and moves
/// more than its deviation says, s.
const SETTLED_S: f64 = 0.75;
/// The filter's deviation is kept at this spacing, s.
const STEP_S: f64 = 0.05;
/// The fall before the burn in which the filter learns the drag, s.
const FALL_S: f64 = 3.0;

/// The filter's standard deviation of the strength over time since the thrust began.
#[derive(Debug, Clone, PartialEq)]
struct Knowledge {
    prior_sigma: f64,
    /// When the certified thrust falls below the weight, s since it began.
    carries_until_s: f64,
    sigma: Vec<f64>,
}

impl Knowledge {
    /// The mission's filter on the certified burn, begun in a fall at a speed, m/s, which the burn takes off evenly. The
    /// gusts of a fast fall hide the thrust for longer: a rocket from apogee falls at 40 m/s, one below a drone at 13 m/s.
    fn of(mission: &Mission, falls_m_s: f64) -> Self {
        let frame_s = mission.estimator.frame_s;
        let curve = &mission.motor_curve;
        let mut filter = MotorEstimate::new(&MotorPrior { frame_s, ..mission.motor });
        let mass = MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg());
        let airframe = &mission.airframe;
        let area_m2 = airframe.drag_area_m2(airframe.fins.open_rad());
        let density_kg_m3 = Air::at_height_m(mission.pad_altitude_m).density_kg_m3;
        let falling_n = 0.5 * density_kg_m3 * area_m2 * falls_m_s * falls_m_s;
        let burn = Burn::nominal(curve);
        let burns_s = curve.burn_time_s();
        let mut sigma = Vec::new();
        for frame in 1..=((FALL_S + burns_s) / frame_s) as u64 {
            let time_s = frame as f64 * frame_s;
            let burning_s = time_s - FALL_S;
            let thrust_n = if burning_s > 0.0 {
                burn.mean_thrust_n((burning_s - frame_s).max(0.0), frame_s)
            } else {
                0.0
            };
            let slower = 1.0 - (burning_s / burns_s).clamp(0.0, 1.0);
            let air_n = falling_n * slower * slower;
            let mass_kg = mass.at(burn.burnt_kg(burning_s.max(0.0))).mass_kg;
            filter.update(
                curve,
                &MotorSample {
                    time_s,
                    axial_specific_force_m_s2: (thrust_n + air_n) / mass_kg,
                    mass_kg,
                    axial_air_force_n: air_n,
                    gimbal_rad: [0.0; 2],
                    may_burn: burning_s > 0.0,
                },
            );
            if burning_s >= sigma.len() as f64 * STEP_S {
                sigma.push(filter.sigmas()[0]);
            }
        }
        let falls_s = burn.falls_through_weight_s(mass.at(0.0).mass_kg, mission.gravity_m_s2);
        let carries_until_s = falls_s.unwrap_or(burns_s);
        Self { prior_sigma: mission.motor.impulse_sigma, carries_until_s, sigma }
    }

    /// Variance that the estimate has got rid of by a time since the thrust began.
    fn gained(&self, since_s: f64) -> f64 {
        let last = self.sigma.last().copied().unwrap_or(self.prior_sigma);
        let sigma = match since_s {
            early_s if early_s <= 0.0 => self.prior_sigma,
            _ => self.sigma.get((since_s / STEP_S) as usize).copied().unwrap_or(last),
        };
        self.prior_sigma * self.prior_sigma - sigma * sigma
    }
}

/// A strength that is too low.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Weak {
    /// From the light on: the strength and the lowest one of the certified scatter.
    FromTheLight { found: f64, lowest: f64 },
    /// All at once: the strength now and before.
    AllAtOnce { found: f64, before: f64 },
}

/// The test of one flight.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StrengthWatch {
    knowledge: Knowledge,
    /// Time since the thrust began, s, and strength.
    heard: Vec<(f64, f64)>,
    flagged: bool,
}

impl StrengthWatch {
    /// The test of a burn that begins in a fall at this speed, m/s.
    pub(super) fn new(mission: &Mission, falls_m_s: f64) -> Self {
        Self { knowledge: Knowledge::of(mission, falls_m_s), heard: vec![(0.0, 1.0)], flagged: false }
    }

    /// The lowest strength of the certified scatter.
    pub(super) fn lowest(&self) -> f64 {
        1.0 - WEAK_SIGMAS * libm::sqrt(self.knowledge.gained(self.knowledge.carries_until_s))
    }

    /// Takes a strength that was sent at a time since the thrust began.
    pub(super) fn take(&mut self, since_s: f64, strength: f64) -> Option<Weak> {
        if self.flagged || !strength.is_finite() {
            return None;
        }
        let gained = self.knowledge.gained(since_s);
        let lowest = self.lowest();
        let before = self.heard.iter().find(|(then_s, then)| {
            let variance = gained - self.knowledge.gained(*then_s);
            let fall = then - strength;
            *then_s >= SETTLED_S && fall > FALL_LEAST && fall * fall > FALL_SIGMAS * FALL_SIGMAS * variance
        });
        let weak = match before {
            _ if strength < lowest => Some(Weak::FromTheLight { found: strength, lowest }),
            Some((_, before)) => Some(Weak::AllAtOnce { found: strength, before: *before }),
            None => None,
        };
        self.heard.push((since_s, strength));
        self.flagged = weak.is_some();
        weak
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch(mission: &str) -> StrengthWatch {
        let (name, text) =
            vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == mission).expect("built in");
        let falls_m_s = if mission == "mk2" { 40.0 } else { 13.0 };
        StrengthWatch::new(&vehicles::mission::from_toml(text, name).unwrap(), falls_m_s)
    }

    /// The shape of an F15 shows its impulse within a second; that of an H45, which is flat for two seconds, does not.
    #[test]
    fn the_curve_s_shape_says_when_the_strength_is_known() {
        let share = |mission: &str, since_s: f64| {
            let knowledge = watch(mission).knowledge;
            knowledge.gained(since_s) / (knowledge.prior_sigma * knowledge.prior_sigma)
        };
        assert!(share("vlr-f15", 1.0) > 0.6, "{}", share("vlr-f15", 1.0));
        assert!((0.1..0.6).contains(&share("mk2", 1.0)), "{}", share("mk2", 1.0));
        assert!(share("mk2", 3.5) > share("mk2", 2.0), "{}", share("mk2", 3.5));
    }

    #[test]
    fn the_bound_lies_between_the_certified_scatter_and_a_tenth() {
        for (mission, lowest) in [("mk2", 0.942), ("vlr-f15", 0.935)] {
            assert!(
                (watch(mission).lowest() - lowest).abs() < 0.006,
                "{mission}: {}",
                watch(mission).lowest()
            );
        }
    }

    #[test]
    fn scatter_is_no_flag_and_a_tenth_is() {
        let mut within = watch("vlr-f15");
        assert_eq!(within.take(2.0, 1.0 - 0.05), None);
        let mut weak = watch("vlr-f15");
        assert!(matches!(weak.take(2.0, 0.9), Some(Weak::FromTheLight { .. })));
        assert_eq!(weak.take(2.1, 0.9), None, "one flag in a flight");
    }

    #[test]
    fn a_fall_that_the_filter_cannot_make_by_itself_is_a_flag() {
        let mut motor = watch("vlr-f15");
        assert_eq!(motor.take(1.5, 1.05), None);
        assert_eq!(motor.take(1.75, 1.049), None);
        assert!(matches!(motor.take(2.0, 0.99), Some(Weak::AllAtOnce { before, .. }) if before > 1.04));
    }
}
