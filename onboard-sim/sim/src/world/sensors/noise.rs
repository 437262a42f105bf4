//! The random part of one flight's sensors: white noise and slow wander, flaws, and the initial
//! state of the estimator. All from a seed.

use flight::estimation::estimator::{GRAVITY_M_S2, StartUncertainty};
use flight::vehicle::rigid::RigidState;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{SensorParams, Sensors};
use crate::world::normal::Normal;

/// A stationary first-order Gauss-Markov process: its correlation decays exponentially (J. A.
/// Farrell, Aided Navigation, 2008, chapter 4).
#[derive(Debug, Clone, Copy)]
pub(super) struct Wander {
    pub(super) value: f64,
    sigma: f64,
    correlation_s: f64,
}

impl Wander {
    /// Starts from its stationary distribution.
    pub(super) fn new(sigma: f64, correlation_s: f64, normal: &mut Normal) -> Self {
        Self { value: sigma * normal.next(), sigma, correlation_s }
    }

    /// Advances over an interval of any length, exactly: the retained share of the variance, `k^2`,
    /// and the new share, `1 - k^2`, add up to one.
    pub(super) fn advance(&mut self, interval_s: f64, normal: &mut Normal) {
        let decay = libm::exp(-interval_s / self.correlation_s);
        self.value = self.value * decay + self.sigma * libm::sqrt(1.0 - decay * decay) * normal.next();
    }
}

// Errors of one flight's sensors beyond noise and bias: mounting, vibration, time errors, dropouts,
// outliers, and feedback offsets. The numbers come from separate random streams, so the noise of a
// flight is the same with and without flaws.

/// The random streams after those of the sensors and of the start.
const DRAWN_STREAM: u64 = 5;
const VIBRATION_STREAM: u64 = 6;
const GNSS_STREAM: u64 = 7;
const LIDAR_STREAM: u64 = 8;
const SATELLITE_STREAM: u64 = 9;

/// How fast the pressure of the ejection charge leaks out through the vents, s.
pub(super) const EJECTION_LASTS_S: f64 = 0.3;

/// Fate of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    Arrives,
    Lost,
    Outlier,
}

/// One flight's flaws.
#[derive(Debug, Clone)]
pub(super) struct Flaws {
    /// From the vehicle's axes to those of the inertial unit.
    pub(super) unit_from_body: Rotation3<f64>,
    /// Place of the inertial unit from the centre of gravity, body axes, m.
    pub(super) unit_m: Vector3<f64>,
    /// Accelerometer bias while the motor burns, m/s^2.
    pub(super) burning_bias_m_s2: Vector3<f64>,
    /// Gyro bias while the motor burns, rad/s.
    pub(super) burning_bias_rad_s: Vector3<f64>,
    pub(super) gnss_tag_s: f64,
    pub(super) barometer_late_s: f64,
    pub(super) barometer_scale: f64,
    pub(super) barometer_plume_m: f64,
    pub(super) barometer_ejection_m: f64,
    pub(super) lidar_late_s: f64,
    pub(super) continuity_lost: bool,
    pub(super) fin_feedback_rad: [f64; 4],
    /// Cross-axis sensitivity of the accelerometer.
    pub(super) cross_axis: Matrix3<f64>,
    /// Suction of the flow across the axis, divided by its dynamic pressure.
    pub(super) barometer_crossflow: f64,
    /// From the vehicle's axes to those of the lidar's beam.
    pub(super) beam: UnitQuaternion<f64>,
    pub(super) grass_m: f64,
    pub(super) velocity_wander: [Wander; 3],
    pub(super) vibration: Normal,
    /// The vibration's last numbers: of angle and velocity.
    pub(super) shaken: [Vector3<f64>; 2],
    pub(super) gnss: Normal,
    pub(super) lidar: Normal,
    pub(super) satellites: Normal,
}

impl Flaws {
    pub(super) fn draw(params: &SensorParams, seed: u64, share: f64) -> Self {
        let mut drawn = Normal::new(seed, DRAWN_STREAM, share);
        let mut satellites = Normal::new(seed, SATELLITE_STREAM, share);
        let (imu, barometer, gnss) = (&params.imu, &params.barometer, &params.gnss);
        let lidar = &params.lidar;
        let between = |[least, most]: [f64; 2], share: f64| least + (most - least) * share;
        Self {
            unit_from_body: Rotation3::from_scaled_axis(drawn.next3() * imu.mounting_deg.to_radians()),
            unit_m: drawn.next3() * imu.off_cg_m,
            burning_bias_m_s2: drawn.next3() * (imu.vibration_bias_mg * 1e-3 * GRAVITY_M_S2),
            gnss_tag_s: params.gnss.time_tag_s * drawn.next(),
            barometer_late_s: barometer.late_s * drawn.next(),
            barometer_plume_m: barometer.plume_m * drawn.next(),
            barometer_ejection_m: barometer.ejection_m * drawn.next(),
            lidar_late_s: params.lidar.late_s * drawn.next(),
            continuity_lost: drawn.unit() < params.switches.continuity_lost_share,
            fin_feedback_rad: core::array::from_fn(|_| {
                params.switches.fin_feedback_deg.to_radians() * drawn.next()
            }),
            cross_axis: Matrix3::from_fn(|row, column| {
                let share = imu.accelerometer_cross_axis_share * drawn.next();
                if row == column { 0.0 } else { share }
            }),
            barometer_crossflow: between(barometer.crossflow, drawn.unit()),
            beam: UnitQuaternion::from_scaled_axis(
                Vector3::new(0.0, drawn.next(), drawn.next()) * lidar.beam_deg.to_radians(),
            ),
            grass_m: between(lidar.grass_m, drawn.unit()),
            burning_bias_rad_s: drawn.next3() * imu.vibration_bias_deg_s.to_radians(),
            velocity_wander: [(); 3].map(|()| {
                Wander::new(gnss.velocity_wander_m_s, gnss.velocity_wander_correlation_s, &mut satellites)
            }),
            barometer_scale: 1.0 + barometer.scale_share * drawn.next(),
            vibration: Normal::new(seed, VIBRATION_STREAM, share),
            shaken: [Vector3::zeros(); 2],
            gnss: Normal::new(seed, GNSS_STREAM, share),
            lidar: Normal::new(seed, LIDAR_STREAM, share),
            satellites,
        }
    }
}

pub(super) fn fate(chance: f64, lost: f64, outlier: f64) -> Fate {
    if chance < lost {
        Fate::Lost
    } else if chance < lost + outlier {
        Fate::Outlier
    } else {
        Fate::Arrives
    }
}

// The estimator's initial state for a flight that does not begin on the pad.

/// The random stream after those of the sensors.
const STREAM: u64 = 4;

/// The true state with errors drawn from the stated uncertainty. The rotation rate has no error,
/// because the gyro replaces it in the first frame.
pub fn start_with_errors(truth: &RigidState, uncertainty: &StartUncertainty, seed: u64) -> RigidState {
    let mut normal = Normal::new(seed, STREAM, 1.0);
    let position_m = Vector3::new(uncertainty.horizontal_m, uncertainty.horizontal_m, uncertainty.height_m);
    let turn_rad = Vector3::new(uncertainty.tilt_deg, uncertainty.tilt_deg, uncertainty.heading_deg)
        .map(f64::to_radians);
    RigidState {
        position_m: truth.position_m + normal.next3().component_mul(&position_m),
        velocity_m_s: truth.velocity_m_s + normal.next3() * uncertainty.velocity_m_s,
        world_from_body: UnitQuaternion::from_scaled_axis(normal.next3().component_mul(&turn_rad))
            * truth.world_from_body,
        rate_rad_s: truth.rate_rad_s,
    }
}

impl Sensors {
    /// The estimate of a vehicle that has levelled itself on its pad: the attitude is that of the
    /// inertial unit, with its accelerometer's error at rest, and has the heading of the estimate.
    pub(crate) fn levelled(&self, truth: &RigidState, estimate: &RigidState) -> RigidState {
        let unit_from_body = UnitQuaternion::from_rotation_matrix(&self.flaws.unit_from_body);
        let world_from_unit = truth.world_from_body * unit_from_body.inverse();
        let up_m_s2 = world_from_unit.inverse_transform_vector(&Vector3::z()) * GRAVITY_M_S2;
        let measured_m_s2 = up_m_s2.component_mul(&self.accelerometer_scale)
            + self.flaws.cross_axis * up_m_s2
            + self.errors.accelerometer_bias_m_s2;
        let lean = UnitQuaternion::rotation_between(&(world_from_unit * measured_m_s2), &Vector3::z());
        let turned = (estimate.world_from_body * truth.world_from_body.inverse()).scaled_axis();
        let heading = UnitQuaternion::from_scaled_axis(Vector3::z() * turned.z);
        let world_from_body = heading * lean.unwrap_or_default() * world_from_unit;
        RigidState { world_from_body, ..*estimate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut normal = Normal::new(3, 0, 1.0);
        let n = 40_000;
        let draws: Vec<f64> = (0..n).map(|_| normal.next()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // Four standard errors.
        assert!(mean.abs() < 4.0 / 200.0, "{mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0f64 / f64::from(n)).sqrt(), "{variance}");
    }

    #[test]
    fn the_wander_is_stationary_and_its_correlation_decays_at_the_stated_rate() {
        let mut normal = Normal::new(5, 1, 1.0);
        let (mut squares, mut products) = (0.0, 0.0);
        let n = 20_000;
        for _ in 0..n {
            let mut wander = Wander::new(2.0, 10.0, &mut normal);
            let before = wander.value;
            wander.advance(5.0, &mut normal);
            squares += wander.value * wander.value;
            products += wander.value * before;
        }
        let n = f64::from(n);
        assert!((squares / n / 4.0 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", squares / n);
        // exp(-1/2); the product's standard deviation is below 1.2.
        assert!((products / n / 4.0 - 0.606_530_66).abs() < 4.0 * 1.2 / n.sqrt(), "{}", products / n);
    }
}
