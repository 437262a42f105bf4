//! Identifies the thrust curve of a burning motor among its certified curves.
//!
//! Two motors can share one name, and the certified curves of one motor can differ by more than its
//! scatter. The scales of a wrong curve fit the present thrust, and mispredict the rest. So one
//! filter for each other curve of the mission processes the same samples, and [`COMPARED_S`]
//! after ignition the most likely one continues.

use alloc::vec::Vec;

use serde::Serialize;

use super::motor_estimate::{COMPARED_S, MotorEstimate, MotorPrior, MotorSample, MotorStage};
use crate::vehicle::mission::Mission;
use crate::vehicle::thrust_curve::ThrustCurve;

/// Smallest advantage in misfit for which another curve is chosen. Over the 88 compared frames it
/// makes that curve 80 times as likely as the expected one, so a motor of the expected curve is
/// hardly ever misidentified.
const CLEARLY: f64 = 0.1;

/// The filters of the other curves until the decision, and the chosen curve.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct OtherCurves {
    filters: Vec<MotorEstimate>,
    chosen: Option<usize>,
}

impl OtherCurves {
    /// Before the ignition, with this number of other curves.
    pub fn new(curves: usize, prior: &MotorPrior) -> Self {
        Self { filters: alloc::vec![MotorEstimate::new(prior); curves], chosen: None }
    }

    /// After a restart with an earlier decision: no more comparison.
    pub fn chosen_before(chosen: Option<usize>) -> Self {
        Self { filters: Vec::new(), chosen }
    }

    /// Index of the motor's curve among the others; `None` for the expected one.
    pub fn chosen(&self) -> Option<usize> {
        self.chosen
    }

    /// The curve assumed for the motor.
    pub fn flown<'a>(&self, mission: &'a Mission) -> &'a ThrustCurve {
        let other = self.chosen.and_then(|index| mission.other_curves.get(index));
        other.unwrap_or(&mission.motor_curve)
    }

    /// Takes the sample that `motor` has just taken under the expected curve, and replaces `motor`
    /// if it has another one.
    pub fn update(&mut self, motor: &mut MotorEstimate, curves: &[ThrustCurve], sample: &MotorSample) {
        if self.filters.is_empty() {
            return;
        }
        for (filter, curve) in self.filters.iter_mut().zip(curves) {
            filter.update(curve, sample);
        }
        let lit_s = motor.ignition_s().filter(|_| motor.stage() == MotorStage::Burning);
        if lit_s.is_none_or(|lit_s| sample.time_s - lit_s < COMPARED_S) {
            return;
        }
        let mut least = motor.misfit() - CLEARLY;
        for (index, filter) in self.filters.iter().enumerate() {
            if filter.stage() == MotorStage::Burning && filter.misfit() < least {
                least = filter.misfit();
                self.chosen = Some(index);
            }
        }
        if let Some(chosen) = self.chosen.and_then(|index| self.filters.get(index)) {
            *motor = *chosen;
        }
        self.filters.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::burn::Burn;
    use crate::vehicles::mission::builtin;

    const IGNITED_S: f64 = 2.0;

    /// The identified curve for a motor of this curve and these scales, in a vehicle of 3.3 kg, and
    /// the estimate after a second.
    fn taken_for(curve: &ThrustCurve, impulse_scale: f64, time_scale: f64) -> (Option<usize>, MotorEstimate) {
        let mission = builtin("mk3").unwrap().unwrap();
        let mut motor = MotorEstimate::new(&mission.motor);
        let mut others = OtherCurves::new(mission.other_curves.len(), &mission.unknown_motor());
        let burn = Burn { impulse_scale, time_scale, ..Burn::nominal(curve) };
        let frame_s = mission.motor.frame_s;
        for frame in 1..=600 {
            let time_s = f64::from(frame) * frame_s;
            let (mass_kg, axial_air_force_n) = (3.3, 20.0);
            let thrust_n = burn.mean_thrust_n(time_s - frame_s - IGNITED_S, frame_s);
            // Vibration of a twentieth of gravity, with a period of three frames.
            let shaken_m_s2 = if thrust_n > 0.0 { [0.6, -0.6, 0.0][frame as usize % 3] } else { 0.0 };
            let sample = MotorSample {
                time_s,
                axial_specific_force_m_s2: (thrust_n + axial_air_force_n) / mass_kg + shaken_m_s2,
                mass_kg,
                axial_air_force_n,
                gimbal_rad: [0.0; 2],
                may_burn: time_s > IGNITED_S - 0.2,
            };
            motor.update(others.flown(&mission), &sample);
            others.update(&mut motor, &mission.other_curves, &sample);
            let since_s = time_s - IGNITED_S;
            assert!(since_s > COMPARED_S - 0.02 || others.filters.len() == 2, "{since_s}");
            // The first thrust of another curve looks like a rise, which delays the ignition.
            assert!(since_s < COMPARED_S + 0.06 || others.filters.is_empty(), "{since_s}");
        }
        (others.chosen(), motor)
    }

    #[test]
    fn a_motor_of_another_curve_is_found_out() {
        let mission = builtin("mk3").unwrap().unwrap();
        for (index, curve) in mission.other_curves.iter().enumerate() {
            let (chosen, motor) = taken_for(curve, 1.0, 1.0);
            assert_eq!(chosen, Some(index), "{}", curve.name());
            assert!((motor.impulse_scale() - 1.0).abs() < 0.03, "{}: {motor:?}", curve.name());
        }
    }

    /// Up to two deviations of impulse and burn time, in all directions.
    #[test]
    fn a_motor_of_the_expected_curve_is_not_mistaken() {
        let mission = builtin("mk3").unwrap().unwrap();
        for impulse_scale in [0.95, 1.0, 1.05] {
            for time_scale in [0.92, 1.0, 1.08] {
                let (chosen, _) = taken_for(&mission.motor_curve, impulse_scale, time_scale);
                assert_eq!(chosen, None, "{impulse_scale} {time_scale}");
            }
        }
    }
}
