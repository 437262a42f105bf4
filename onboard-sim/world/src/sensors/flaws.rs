//! What is wrong with one flight's sensors beyond noise and bias: mounting, vibration, time errors, dropouts, outliers,
//! and feedback that is off. The numbers come from random streams of their own, so the noise of a flight stays the same
//! whether there are flaws or not.

use flight::estimation::estimator::GRAVITY_M_S2;
use nalgebra::{Rotation3, Vector3};

use super::SensorParams;
use super::noise::Normal;

/// The random streams after those of the sensors and of the start.
const DRAWN_STREAM: u64 = 5;
const VIBRATION_STREAM: u64 = 6;
const GNSS_STREAM: u64 = 7;
const LIDAR_STREAM: u64 = 8;

/// How fast the pressure of the ejection charge leaks out through the vents, s.
pub(super) const EJECTION_LASTS_S: f64 = 0.3;

/// What a measurement goes through on its way.
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
    pub(super) gnss_tag_s: f64,
    pub(super) barometer_late_s: f64,
    pub(super) barometer_plume_m: f64,
    pub(super) barometer_ejection_m: f64,
    pub(super) lidar_late_s: f64,
    pub(super) continuity_lost: bool,
    pub(super) fin_feedback_rad: [f64; 4],
    vibration: Normal,
    gnss: Normal,
    lidar: Normal,
}

impl Flaws {
    pub(super) fn draw(params: &SensorParams, seed: u64) -> Self {
        let mut drawn = Normal::new(seed, DRAWN_STREAM);
        let (imu, barometer) = (&params.imu, &params.barometer);
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
            vibration: Normal::new(seed, VIBRATION_STREAM),
            gnss: Normal::new(seed, GNSS_STREAM),
            lidar: Normal::new(seed, LIDAR_STREAM),
        }
    }

    /// Vibration of one frame's sample: rotation rate, rad/s, and specific force, m/s^2.
    pub(super) fn vibration(&mut self, params: &SensorParams) -> (Vector3<f64>, Vector3<f64>) {
        let imu = &params.imu;
        let rate = self.vibration.next3() * imu.vibration_deg_s.to_radians();
        (rate, self.vibration.next3() * (imu.vibration_g * GRAVITY_M_S2))
    }

    /// What becomes of a fix, and how far an outlier is off, m.
    pub(super) fn of_fix(&mut self, params: &SensorParams) -> (Fate, Vector3<f64>) {
        let fate = fate(self.gnss.unit(), params.gnss.dropout_share, params.gnss.outlier_share);
        (fate, self.gnss.next3() * params.gnss.outlier_m)
    }

    /// What becomes of a range, and where an outlier lies between the sensor's limits, 0 to 1.
    pub(super) fn of_range(&mut self, params: &SensorParams) -> (Fate, f64) {
        let fate = fate(self.lidar.unit(), params.lidar.dropout_share, params.lidar.outlier_share);
        (fate, self.lidar.unit())
    }
}

fn fate(chance: f64, lost: f64, outlier: f64) -> Fate {
    if chance < lost {
        Fate::Lost
    } else if chance < lost + outlier {
        Fate::Outlier
    } else {
        Fate::Arrives
    }
}
