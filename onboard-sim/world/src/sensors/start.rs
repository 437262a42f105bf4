//! The estimator's initial state for a flight that does not begin on the pad.

use flight::estimation::estimator::StartUncertainty;
use flight::vehicle::rigid::RigidState;
use nalgebra::{UnitQuaternion, Vector3};

use super::noise::Normal;

/// The random stream after those of the sensors.
const STREAM: u64 = 4;

/// The true state with errors drawn from the stated uncertainty. The rotation rate has no error, because the gyro
/// replaces it in the first frame.
pub fn believed_start(truth: &RigidState, uncertainty: &StartUncertainty, seed: u64) -> RigidState {
    let mut normal = Normal::new(seed, STREAM);
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
