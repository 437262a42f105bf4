//! The horizontal wind, from the sideways specific force while the vehicle falls.
//!
//! In free fall only the air exerts a force: the sideways specific force is the fins' drag along
//! the relative wind plus the body's cross-flow drag (Hoerner, "Fluid-Dynamic Drag", 1965,
//! cross-flow principle). It corrects the estimated wind alone, because a wrong drag coefficient
//! must not tilt the attitude.

use nalgebra::{Matrix2, Matrix2x3, Rotation3, Vector2, Vector3};
use serde::Serialize;

use super::Estimator;
use super::covariance::{ACCELEROMETER_BIAS, ATTITUDE, VELOCITY, WIND};
use crate::vehicle::airframe::{Airframe, MassProperties};
use crate::vehicle::fins::ROLL;
use crate::vehicle::mission::{Exhaust, LeverArms};

/// Frames averaged for one update: 20 ms, in which a gust hardly changes.
const FRAMES: u32 = 4;
/// Dynamic pressure below which the force is not used, Pa: at 6 m/s it is small beside the
/// accelerometer's errors.
const SMALLEST_DYNAMIC_PRESSURE_PA: f64 = 20.0;
/// An error of the drag coefficients does not average out. It counts as noise with this correlation
/// time, s.
const COEFFICIENT_ERROR_LASTS_S: f64 = 2.0;

/// The running mean of the sideways specific force, body y and z.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct Sideways {
    sum_m_s2: Vector2<f64>,
    frames: u32,
}

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

/// Sideways specific force of the air, body y and z, m/s^2, and its derivative by the sideways
/// relative wind, 1/s.
fn sensed_sideways(
    vehicle: &VehicleNow,
    through_air_m_s: &Vector3<f64>,
    rate_rad_s: &Vector3<f64>,
) -> (Vector2<f64>, Matrix2<f64>) {
    let sensed = vehicle.air_force_n(through_air_m_s, rate_rad_s).yz() / vehicle.mass_kg;
    let sideways = through_air_m_s.yz();
    let speed_sideways = sideways.norm();
    let body = vehicle.crossflow_area_m2;
    let fins = vehicle.fin_drag_area_m2 * through_air_m_s.norm();
    // Without sideways wind its direction is undefined, and this term is zero.
    let along = sideways * sideways.transpose() / speed_sideways.max(1e-6);
    let slope = Matrix2::identity() * (fins + body * speed_sideways) + along * body;
    (sensed, slope * (-0.5 * vehicle.air_density_kg_m3 / vehicle.mass_kg))
}

impl Estimator {
    /// Corrects the wind with one frame.
    pub(super) fn update_wind(&mut self, vehicle: &VehicleNow) {
        let through_air = self.velocity_through_air_m_s();
        let dynamic_pressure_pa = 0.5 * vehicle.air_density_kg_m3 * through_air.norm_squared();
        let sensed = dynamic_pressure_pa > SMALLEST_DYNAMIC_PRESSURE_PA;
        if vehicle.motor_burning || !sensed {
            self.sideways.clear();
            return;
        }
        let Some(mean) = self.sideways.take(&self.specific_force_m_s2) else { return };
        let body_from_world = self.nominal.world_from_body.inverse().to_rotation_matrix();
        let mean_over_s = f64::from(FRAMES) * self.config.frame_s;
        let at_m_s = self.linearised_at_m_s(vehicle, &mean, &body_from_world, mean_over_s);
        let through_air = self.nominal.velocity_m_s - at_m_s.push(0.0);
        let in_body = body_from_world * through_air;
        let (sensed, slope) = sensed_sideways(vehicle, &in_body, &self.rate_rad_s);
        let by_velocity: Matrix2x3<f64> = slope * body_from_world.matrix().fixed_rows::<2>(1);
        let by_attitude = by_velocity * through_air.cross_matrix();
        let noise = self.sideways_variance(&sensed, mean_over_s);
        // At the estimated wind, on the line through the point where the force was linearised.
        let sensed = sensed - by_velocity.fixed_columns::<2>(0) * (self.nominal.wind_m_s - at_m_s);
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
            let correction = self.correct(&sensitivity, mean[axis] - sensed[axis], noise, |index| {
                (WIND..WIND + 2).contains(&index)
            });
            self.aids.wind.take(&correction);
        }
    }

    /// Variance of the mean sideways specific force, (m/s^2)^2.
    fn sideways_variance(&self, sensed_m_s2: &Vector2<f64>, mean_over_s: f64) -> f64 {
        let noise_m_s2_sqrt_hz = self.noise.accelerometer_m_s2_sqrt_hz;
        let white = noise_m_s2_sqrt_hz * noise_m_s2_sqrt_hz / mean_over_s;
        let share = self.config.sideways_force_share * sensed_m_s2.norm();
        white + share * share * COEFFICIENT_ERROR_LASTS_S / mean_over_s
    }

    /// The wind at which the sideways force is linearised: the estimated wind, or with more passes
    /// the most likely wind by Gauss-Newton steps (the iterated filter; Bell and Cathey, IEEE
    /// Trans. Automatic Control 38, 1993). The body's cross-flow force grows with the square of the
    /// wind and has no slope in still air. Linearised there, a first force is attributed to the
    /// fins alone, and the wind comes out up to three times too strong, or the force is rejected.
    fn linearised_at_m_s(
        &mut self,
        vehicle: &VehicleNow,
        mean_m_s2: &Vector2<f64>,
        body_from_world: &Rotation3<f64>,
        mean_over_s: f64,
    ) -> Vector2<f64> {
        let estimated_m_s = self.nominal.wind_m_s;
        if self.config.wind_passes <= 1 {
            return estimated_m_s;
        }
        self.catch_up();
        let prior = Matrix2::from_fn(|row, column| {
            self.covariance.between(&[(WIND + row, 1.0)], &[(WIND + column, 1.0)])
        });
        let mut at_m_s = estimated_m_s;
        for _ in 1..self.config.wind_passes {
            let in_body = body_from_world * (self.nominal.velocity_m_s - at_m_s.push(0.0));
            let (sensed, slope) = sensed_sideways(vehicle, &in_body, &self.rate_rad_s);
            let by_wind = -slope * body_from_world.matrix().fixed_view::<2, 2>(1, 0);
            let noise = Matrix2::identity() * self.sideways_variance(&sensed, mean_over_s);
            let seen = by_wind * prior * by_wind.transpose() + noise;
            let missed = mean_m_s2 - sensed - by_wind * (estimated_m_s - at_m_s);
            let Some(inverse) = seen.try_inverse() else { break };
            at_m_s = estimated_m_s + prior * by_wind.transpose() * inverse * missed;
        }
        if at_m_s.iter().all(|wind| wind.is_finite()) { at_m_s } else { estimated_m_s }
    }
}

// Vehicle data of one frame, and the aerodynamic force that follows from them.

/// The data of the vehicle that the estimator needs in this frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleNow {
    pub mass_kg: f64,
    pub air_density_kg_m3: f64,
    /// Axial drag coefficient of the body times its area, m^2.
    pub body_drag_area_m2: f64,
    /// Drag area of the legs, m^2. Their drag is along the relative wind, too; the contribution of
    /// rotation is neglected.
    pub leg_drag_area_m2: f64,
    /// Sum over the fins of drag coefficient times area at their present openings, m^2. Their drag
    /// is along the relative wind, so this counts sideways as well.
    pub fin_drag_area_m2: f64,
    /// Sum over the fins of lift coefficient times area times the direction from the axis to the
    /// fin, body y and z, m^2, each with the sign of its roll moment: zero while the openings are
    /// equal.
    pub fin_lift_area_m2: Vector2<f64>,
    /// Distance of the fins ahead of the centre of gravity, m.
    pub fin_ahead_of_cg_m: f64,
    /// Cross-flow drag coefficient of the body times its side area, m^2: the force sideways is that
    /// times the dynamic pressure of the sideways wind alone.
    pub crossflow_area_m2: f64,
    /// The igniter has been fired, so the landing motor may burn. The wind is then not estimated
    /// from the sideways force, because the motor's sideways force is too uncertain.
    pub motor_burning: bool,
    /// Lever arms of the sensors.
    pub levers: LeverArms,
}

impl VehicleNow {
    /// The data from an airframe, its masses, the air density, kg/m^3, the present fin openings,
    /// rad, and the sensors' lever arms.
    pub fn of(
        airframe: &Airframe,
        mass: &MassProperties,
        air_density_kg_m3: f64,
        fins_rad: [f64; 4],
        motor_burning: bool,
        levers: LeverArms,
    ) -> Self {
        let body = &airframe.body;
        let sines = fins_rad.map(libm::sin);
        let lift_area_m2 = body.reference_area_m2 * airframe.fins.lift_coefficient;
        let (fins, mut fin_lift_area_m2) = (airframe.fin_model(), Vector2::zeros());
        for fin in 0..4 {
            fin_lift_area_m2 += Vector2::from(fins.outward(fin)) * (lift_area_m2 * sines[fin] * ROLL[fin]);
        }
        Self {
            mass_kg: mass.mass_kg,
            air_density_kg_m3,
            body_drag_area_m2: body.reference_area_m2 * body.axial_drag_coefficient,
            leg_drag_area_m2: airframe.legs.drag_area_m2,
            fin_drag_area_m2: body.reference_area_m2
                * airframe.fins.drag_coefficient
                * sines.iter().sum::<f64>(),
            fin_lift_area_m2,
            fin_ahead_of_cg_m: airframe.fins.station_m - mass.cg_station_m,
            crossflow_area_m2: body.crossflow_area_m2(),
            motor_burning,
            levers,
        }
    }

    /// The vehicle with the drag of body and fins reduced by the exhaust.
    #[must_use]
    pub fn in_exhaust(self, exhaust: &Exhaust) -> Self {
        let fins = 1.0 - exhaust.fin_loss;
        Self {
            body_drag_area_m2: self.body_drag_area_m2 * (1.0 - exhaust.body_loss),
            fin_drag_area_m2: self.fin_drag_area_m2 * fins,
            fin_lift_area_m2: self.fin_lift_area_m2 * fins,
            ..self
        }
    }

    /// Aerodynamic force in body axes, N, for a velocity through the air in body axes, m/s, and a
    /// rotation rate, rad/s: drag of the body along its axis (Eq. 8 of the landing paper) and
    /// across it, drag and lift of the fins.
    pub fn air_force_n(&self, through_air_m_s: &Vector3<f64>, rate_rad_s: &Vector3<f64>) -> Vector3<f64> {
        let velocity = through_air_m_s;
        let at_fins = velocity + rate_rad_s.cross(&Vector3::new(self.fin_ahead_of_cg_m, 0.0, 0.0));
        let sideways = Vector3::new(0.0, velocity.y, velocity.z);
        let (speed, speed_at_fins) = (velocity.norm(), at_fins.norm());
        let body = Vector3::new(self.body_drag_area_m2 * speed * velocity.x, 0.0, 0.0)
            + sideways * (self.crossflow_area_m2 * sideways.norm());
        let lift = at_fins.cross(&self.fin_lift_area_m2.insert_row(0, 0.0)) * speed_at_fins;
        let fins = at_fins * (self.fin_drag_area_m2 * speed_at_fins) + lift;
        let legs = velocity * (self.leg_drag_area_m2 * speed);
        (body + fins + legs) * (-0.5 * self.air_density_kg_m3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::estimator::tests::VEHICLE;
    use crate::estimation::estimator::{EstimatorConfig, ImuSample, Measurements, StartUncertainty};
    use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
    use crate::vehicle::rigid::RigidState;

    /// The wind estimated for a body with small fins after a fifth of a second of a fall through a
    /// wind of 8 m/s.
    fn sensed_wind_of_8_m_s(wind_passes: u32) -> Vector2<f64> {
        const FRAME_S: f64 = 0.005;
        let vehicle = VehicleNow { mass_kg: 1.2, fin_drag_area_m2: 0.003, ..VEHICLE };
        let mut state = RigidState::upright(25.0);
        state.velocity_m_s.z = -8.0;
        let config = EstimatorConfig { wind_passes, ..EstimatorConfig::default() };
        let mut estimator = Estimator::new(&config, &StartUncertainty::at_apogee(), 0.0, &state);
        for _ in 0..40 {
            let through_air = state.velocity_m_s - Vector3::new(8.0, 0.0, 0.0);
            let in_body = state.world_from_body.inverse_transform_vector(&through_air);
            let sensed_m_s2 = vehicle.air_force_n(&in_body, &Vector3::zeros()) / vehicle.mass_kg;
            state.velocity_m_s +=
                FRAME_S * (state.world_from_body * sensed_m_s2 - Vector3::z() * STANDARD_GRAVITY_M_S2);
            let imu = ImuSample { gyro_rad_s: Vector3::zeros(), specific_force_m_s2: sensed_m_s2 };
            estimator.step(&Measurements::of_imu(imu), &vehicle);
        }
        estimator.estimate().wind_m_s
    }

    #[test]
    fn a_body_with_small_fins_needs_several_passes() {
        let once = sensed_wind_of_8_m_s(1);
        assert!((once.x - 8.0).abs() > 3.0, "{once}");
        let often = sensed_wind_of_8_m_s(6);
        // The prior of still air still has some weight.
        assert!((often - Vector2::new(8.0, 0.0)).norm() < 1.0, "{often}");
    }

    #[test]
    fn the_slope_is_the_difference_quotient() {
        let rate = Vector3::zeros();
        let at = Vector3::new(-40.0, 2.0, -1.5);
        let (_, slope) = sensed_sideways(&VEHICLE, &at, &rate);
        let step = 1e-6;
        for axis in 0..2 {
            let mut ahead = at;
            ahead[axis + 1] += step;
            let mut behind = at;
            behind[axis + 1] -= step;
            let quotient = (sensed_sideways(&VEHICLE, &ahead, &rate).0
                - sensed_sideways(&VEHICLE, &behind, &rate).0)
                / (2.0 * step);
            // The change of the speed is neglected: it is of the order of (sideways wind / speed)
            // squared.
            assert!((quotient - slope.column(axis)).norm() < 0.005 * slope.norm(), "{quotient} {slope}");
        }
    }

    #[test]
    fn val_hand_air_force() {
        let vehicle = VehicleNow { fin_lift_area_m2: Vector2::new(0.0, 0.002), ..VEHICLE };
        // 40 m/s down the axis and 3 m/s sideways: V = 40.112342. Body: 0.0043 V 40 along, 0.09 * 9
        // sideways. Fins: 0.031 V (40, 3); lift: v x G with G = (0, 0, 0.002) is (3 * 0.002, 40 *
        // 0.002, 0), times V.
        let force = vehicle.air_force_n(&Vector3::new(-40.0, 3.0, 0.0), &Vector3::zeros());
        // -0.6 (-6.899323 - 49.739304 + 0.240674, 0.81 + 3.730448 + 3.208987, 0)
        assert!((force - Vector3::new(33.838_772, -4.649_661, 0.0)).norm() < 1e-5, "{force}");
        // A yaw rate of half a radian per second moves only the fins, at 0.055 m/s sideways.
        let turning = vehicle.air_force_n(&Vector3::new(-40.0, 3.0, 0.0), &Vector3::new(0.0, 0.0, 0.5));
        assert!((turning.y - force.y + 0.6 * 0.031 * 40.1165 * 0.055).abs() < 1e-3, "{turning}");
    }

    #[test]
    fn equal_openings_have_the_airframes_drag_and_no_side_force() {
        let airframe = crate::vehicles::mission::builtin_airframe("mk2").unwrap();
        let mass = crate::vehicle::airframe::MassModel::new(&airframe.mass, 0.2).at(0.0);
        let opening_rad = 1.2;
        let vehicle = VehicleNow::of(&airframe, &mass, 1.2, [opening_rad; 4], false, LeverArms::default());
        let area_m2 = vehicle.body_drag_area_m2 + vehicle.fin_drag_area_m2;
        assert!((area_m2 - airframe.drag_area_m2(opening_rad)).abs() < 1e-12);
        assert!(vehicle.fin_lift_area_m2.norm() < 1e-15, "{vehicle:?}");
        let steered =
            VehicleNow::of(&airframe, &mass, 1.2, [1.3, 1.1, 1.1, 1.3], false, LeverArms::default());
        assert!(steered.fin_lift_area_m2.norm() > 1e-4, "{steered:?}");
    }
}
