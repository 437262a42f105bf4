//! The horizontal wind, from the sideways specific force while the vehicle falls.
//!
//! In free fall only the air exerts a force: the sideways specific force is the fins' drag along the relative wind plus
//! the body's cross-flow drag (Hoerner, "Fluid-Dynamic Drag", 1965, cross-flow principle). It corrects only the
//! estimated wind, because a wrong drag coefficient must not tilt the attitude.

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::covariance::{ACCELEROMETER_BIAS, ATTITUDE, VELOCITY, WIND};
use super::{Estimator, VehicleNow};
use crate::computer::memory::remembers;

/// Frames whose sideways force is averaged for one update.
const FRAMES: u32 = 4;
/// Below this dynamic pressure the force is not used, Pa.
const SMALLEST_DYNAMIC_PRESSURE_PA: f64 = 20.0;
/// An error of the drag coefficients does not average out. It counts as noise with this correlation time, s.
const COEFFICIENT_ERROR_LASTS_S: f64 = 2.0;

/// The running mean of the sideways specific force, body y and z.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sideways {
    sum_m_s2: Vector2<f64>,
    frames: u32,
}

remembers!(Sideways { sum_m_s2, frames });

impl Sideways {
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes one frame's specific force; returns the mean when there are enough.
    fn take(&mut self, specific_force_m_s2: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.sum_m_s2 += specific_force_m_s2.yz();
        self.frames += 1;
        (self.frames == FRAMES).then(|| {
            let mean = self.sum_m_s2 / f64::from(FRAMES);
            self.clear();
            mean
        })
    }
}

/// Sideways specific force of the air, body y and z, m/s^2, and its derivative by the sideways relative wind, 1/s.
fn felt_sideways(
    vehicle: &VehicleNow,
    through_air_m_s: &Vector3<f64>,
    rate_rad_s: &Vector3<f64>,
) -> (Vector2<f64>, Matrix2<f64>) {
    let felt = vehicle.air_force_n(through_air_m_s, rate_rad_s).yz() / vehicle.mass_kg;
    let sideways = through_air_m_s.yz();
    let speed_sideways = sideways.norm();
    let body = vehicle.crossflow_area_m2;
    let fins = vehicle.fin_drag_area_m2 * through_air_m_s.norm();
    // Without sideways wind its direction is undefined, and this term is zero.
    let along = sideways * sideways.transpose() / speed_sideways.max(1e-6);
    let slope = Matrix2::identity() * (fins + body * speed_sideways) + along * body;
    (felt, slope * (-0.5 * vehicle.air_density_kg_m3 / vehicle.mass_kg))
}

impl Estimator {
    /// Corrects the wind with one frame.
    pub(super) fn feel_wind(&mut self, vehicle: &VehicleNow) {
        let through_air = self.velocity_through_air_m_s();
        let dynamic_pressure_pa = 0.5 * vehicle.air_density_kg_m3 * through_air.norm_squared();
        let felt = dynamic_pressure_pa > SMALLEST_DYNAMIC_PRESSURE_PA;
        if vehicle.motor_burning || !felt {
            self.sideways.clear();
            return;
        }
        let Some(mean) = self.sideways.take(&self.specific_force_m_s2) else { return };
        let body_from_world = self.nominal.world_from_body.inverse().to_rotation_matrix();
        let in_body = body_from_world * through_air;
        let (felt, slope) = felt_sideways(vehicle, &in_body, &self.rate_rad_s);
        let by_velocity: Matrix2x3<f64> = slope * body_from_world.matrix().fixed_rows::<2>(1);
        let by_attitude = by_velocity * through_air.cross_matrix();
        let mean_over_s = f64::from(FRAMES) * self.config.frame_s;
        let noise_m_s2_sqrt_hz = self.noise.accelerometer_m_s2_sqrt_hz;
        let white = noise_m_s2_sqrt_hz * noise_m_s2_sqrt_hz / mean_over_s;
        let share = self.config.sideways_force_share * felt.norm();
        let noise = white + share * share * COEFFICIENT_ERROR_LASTS_S / mean_over_s;
        for axis in 0..2 {
            let sensitivity = [
                (VELOCITY, by_velocity[(axis, 0)]),
                (VELOCITY + 1, by_velocity[(axis, 1)]),
                (VELOCITY + 2, by_velocity[(axis, 2)]),
                (ATTITUDE, by_attitude[(axis, 0)]),
                (ATTITUDE + 1, by_attitude[(axis, 1)]),
                (ATTITUDE + 2, by_attitude[(axis, 2)]),
                (ACCELEROMETER_BIAS + 1 + axis, 1.0),
                (WIND, -by_velocity[(axis, 0)]),
                (WIND + 1, -by_velocity[(axis, 1)]),
            ];
            let correction = self.correct(&sensitivity, mean[axis] - felt[axis], noise, |index| {
                (WIND..WIND + 2).contains(&index)
            });
            self.gates.wind.count(correction.accepted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::VEHICLE;
    use super::*;

    #[test]
    fn the_slope_is_the_difference_quotient() {
        let rate = Vector3::zeros();
        let at = Vector3::new(-40.0, 2.0, -1.5);
        let (_, slope) = felt_sideways(&VEHICLE, &at, &rate);
        let step = 1e-6;
        for axis in 0..2 {
            let mut ahead = at;
            ahead[axis + 1] += step;
            let mut behind = at;
            behind[axis + 1] -= step;
            let quotient = (felt_sideways(&VEHICLE, &ahead, &rate).0
                - felt_sideways(&VEHICLE, &behind, &rate).0)
                / (2.0 * step);
            // The change of the speed is neglected: it is of the order of (sideways wind / speed) squared.
            assert!((quotient - slope.column(axis)).norm() < 0.005 * slope.norm(), "{quotient} {slope}");
        }
    }
}
