//! A vehicle that hangs tail-down below a drone: a stiff pendulum on a hook that wanders about its
//! place.
//!
//! Rope and vehicle are one line. The swing is that of a mathematical pendulum with small angles
//! (L. D. Landau and E. M. Lifshitz, Mechanics, 3rd edition, section 21), without damping: the
//! vehicle follows it until the drone releases it.

use core::f64::consts::TAU;

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::rigid::{RigidState, upright};
use nalgebra::{UnitQuaternion, Vector3};

/// Time in which the drone wanders out and back, s.
const WANDERS_S: f64 = 20.0;

/// How a vehicle hangs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hanging {
    /// Mean height of the centre of gravity, m.
    pub height_m: f64,
    /// Fastest drift of the drone, world x and y, m/s.
    pub drift_m_s: [f64; 2],
    /// Distance from the hook to the centre of gravity, m.
    pub length_m: f64,
    /// Largest angle of the swing, rad.
    pub swing_rad: f64,
    /// Direction of the swing, from world x towards y, rad.
    pub towards_rad: f64,
    /// Phase of the swing at time zero, rad.
    pub phase_rad: f64,
}

impl Hanging {
    /// The state at a time, s, and the specific force in body axes, m/s^2. At time zero the drone
    /// drifts fastest.
    pub fn at(&self, time_s: f64) -> (RigidState, Vector3<f64>) {
        let (sin, cos) = libm::sincos(self.towards_rad);
        let (across, axis) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let own_rad_s = libm::sqrt(STANDARD_GRAVITY_M_S2 / self.length_m);
        let (swing_sin, swing_cos) = libm::sincos(own_rad_s * time_s + self.phase_rad);
        let (angle, rate, turn) = (
            self.swing_rad * swing_sin,
            self.swing_rad * own_rad_s * swing_cos,
            -self.swing_rad * own_rad_s * own_rad_s * swing_sin,
        );
        // The nose leans by the angle, so the weight swings the other way.
        let (lean_sin, lean_cos) = libm::sincos(angle);
        let nose = across * lean_sin + Vector3::z() * lean_cos;
        let nose_by_angle = across * lean_cos - Vector3::z() * lean_sin;
        let wander_rad_s = TAU / WANDERS_S;
        let (wander_sin, wander_cos) = libm::sincos(wander_rad_s * time_s);
        let drift = Vector3::new(self.drift_m_s[0], self.drift_m_s[1], 0.0);
        let hook_m = drift * (wander_sin / wander_rad_s) + Vector3::z() * (self.height_m + self.length_m);
        let world_from_body = UnitQuaternion::from_scaled_axis(axis * angle) * upright();
        let acceleration = drift * (-wander_sin * wander_rad_s)
            - (nose_by_angle * turn - nose * (rate * rate)) * self.length_m;
        let specific_force = acceleration + Vector3::z() * STANDARD_GRAVITY_M_S2;
        let state = RigidState {
            position_m: hook_m - nose * self.length_m,
            velocity_m_s: drift * wander_cos - nose_by_angle * (rate * self.length_m),
            world_from_body,
            rate_rad_s: world_from_body.inverse_transform_vector(&(axis * rate)),
        };
        (state, world_from_body.inverse_transform_vector(&specific_force))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_difference_quotients_of_the_swing() {
        let hanging = Hanging {
            height_m: 30.0,
            drift_m_s: [1.0, -0.5],
            length_m: 2.0,
            swing_rad: 0.1,
            towards_rad: 0.7,
            phase_rad: 1.1,
        };
        let step_s = 1e-4;
        for time_s in [0.0, 0.8, 3.1] {
            let [before, now, after] = [-step_s, 0.0, step_s].map(|by_s| hanging.at(time_s + by_s));
            let velocity = (after.0.position_m - before.0.position_m) / (2.0 * step_s);
            assert!((velocity - now.0.velocity_m_s).norm() < 1e-6);
            let acceleration = (after.0.velocity_m_s - before.0.velocity_m_s) / (2.0 * step_s);
            let by_sensor = now.0.world_from_body * now.1 - Vector3::z() * STANDARD_GRAVITY_M_S2;
            assert!((acceleration - by_sensor).norm() < 1e-6);
            let turned = (before.0.world_from_body.inverse() * after.0.world_from_body).scaled_axis();
            assert!((turned / (2.0 * step_s) - now.0.rate_rad_s).norm() < 1e-6);
            // The rope carries only the weight's component along itself, and the swing's force:
            // nothing pulls sideways but the drone's acceleration.
            let sideways = now.1 - Vector3::x() * now.1.x;
            assert!(sideways.norm() < 0.36, "{}", now.1);
        }
    }
}
