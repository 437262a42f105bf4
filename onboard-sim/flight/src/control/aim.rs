//! The commanded direction of the nose, and the loop that turns the nose there with the gimbal.
//!
//! The landing planner runs every tenth of a second; this loop runs at every frame. It is a
//! second-order law on the angle between the nose and its aim, in body axes, so roll does not
//! matter. A real nozzle needs three additions:
//!
//! * The effect of commands that have not moved the vehicle yet is predicted (O. J. M. Smith,
//!   "Closer control of loops with dead time", Chemical Engineering Progress 53, 1957; with the
//!   latency of servo and linkage in frames). Without it the loop would have to be several times
//!   softer.
//! * The acceleration that the model does not explain (air, a crooked nozzle, a shifted centre of
//!   gravity) is estimated and compensated (a disturbance observer: W.-H. Chen et al., IEEE Trans.
//!   Industrial Electronics 63, 2016).
//! * The linkage has play. At each reversal the horn must cross it before the nozzle moves, so the
//!   command crosses it at once (G. Tao and P. V. Kokotovic, Automatica 29, 1993).

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Most frames of latency that are predicted.
const MAX_LATENCY_FRAMES: usize = 24;

/// Change of the commanded nozzle angle below which it is not a reversal, rad: it is noise, and
/// much smaller than the play.
const REVERSAL_RAD: f64 = 2e-4;

/// Commanded direction and rotation of the nose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// The nose's direction in the world, of length 1.
    pub nose_in_world: Vector3<f64>,
    /// Its rotation rate in the world, rad/s.
    pub rate_in_world_rad_s: Vector3<f64>,
    /// Its rotational acceleration in the world, rad/s^2.
    pub acceleration_in_world_rad_s2: Vector3<f64>,
}

impl Aim {
    /// Straight up, at rest.
    pub fn upright() -> Self {
        Self::at(Vector3::z())
    }

    /// At rest in a direction, or in the nearest one that leans from the vertical by no more than
    /// an angle, rad.
    pub fn leaning_at_most(direction: &Vector3<f64>, lean_rad: f64) -> Self {
        let level = libm::hypot(direction.x, direction.y);
        let (sin, cos) = libm::sincos(lean_rad);
        if level <= sin && direction.z > 0.0 {
            return Self::at(*direction);
        }
        if level == 0.0 {
            return Self::upright();
        }
        Self::at(Vector3::new(direction.x * sin / level, direction.y * sin / level, cos))
    }

    /// An aim at rest in a direction of the world.
    pub fn at(nose_in_world: Vector3<f64>) -> Self {
        Self {
            nose_in_world,
            rate_in_world_rad_s: Vector3::zeros(),
            acceleration_in_world_rad_s2: Vector3::zeros(),
        }
    }
}

/// The shortest rotation that turns the nose to its aim, in body axes, rad.
pub fn turn_to_aim_rad(world_from_body: &UnitQuaternion<f64>, nose_in_world: &Vector3<f64>) -> Vector3<f64> {
    let aim_in_body = world_from_body.inverse_transform_vector(nose_in_world);
    let across = libm::hypot(aim_in_body.y, aim_in_body.z);
    let angle_rad = libm::atan2(across, aim_in_body.x);
    if across < 1e-12 {
        // The aim is exactly ahead or exactly behind, so every rotation axis is equally short.
        return Vector3::new(0.0, angle_rad, 0.0);
    }
    Vector3::new(0.0, -aim_in_body.z, aim_in_body.y) * (angle_rad / across)
}

/// Tuning of the gimbal loop.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AimGains {
    /// Natural frequency of the closed loop, rad/s.
    pub natural_frequency_rad_s: f64,
    pub damping: f64,
    /// Time from a command to the motion it causes, s.
    #[serde(default)]
    pub latency_s: f64,
    /// Time constant of the disturbance estimate, s.
    pub disturbance_time_s: f64,
    /// Limit of the disturbance estimate, rad/s^2.
    pub disturbance_max_rad_s2: f64,
    /// Play of the linkage that the command crosses at a reversal, degrees.
    #[serde(default)]
    pub play_deg: f64,
}

/// The loop with its memory.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AimLoop {
    // Skipped fields are constants of the mission.
    #[serde(skip)]
    gains: AimGains,
    #[serde(skip)]
    frame_s: f64,
    #[serde(skip)]
    latency_frames: usize,
    /// Angular accelerations that were commanded but have not acted yet, about body y and z, oldest
    /// first, rad/s^2.
    under_way_rad_s2: [[f64; 2]; MAX_LATENCY_FRAMES],
    rate_before_rad_s: Option<[f64; 2]>,
    /// The angular acceleration about body y and z that the model does not explain, rad/s^2: the
    /// sum of the effects of a crooked nozzle, a centre of gravity off the axis and the air.
    disturbance_rad_s2: [f64; 2],
    /// The commanded nozzle angle, and the side of the play on which the horn is.
    nozzle_rad: [f64; 2],
    side: [f64; 2],
}

// Gains and lengths come from the mission.
impl AimLoop {
    /// A loop at rest, called every `frame_s`.
    pub fn new(gains: AimGains, frame_s: f64) -> Self {
        let latency_frames =
            libm::round(gains.latency_s / frame_s).clamp(0.0, MAX_LATENCY_FRAMES as f64) as usize;
        Self {
            gains,
            frame_s,
            latency_frames,
            under_way_rad_s2: [[0.0; 2]; MAX_LATENCY_FRAMES],
            rate_before_rad_s: None,
            disturbance_rad_s2: [0.0; 2],
            nozzle_rad: [0.0; 2],
            side: [0.0; 2],
        }
    }

    /// The same memory with other gains. Pending commands are retained up to the new latency.
    #[must_use]
    pub fn reconfigured(&self, gains: AimGains) -> Self {
        let other = Self::new(gains, self.frame_s);
        let mut changed = Self { gains, ..self.clone() };
        if other.latency_frames != self.latency_frames {
            (changed.latency_frames, changed.under_way_rad_s2) =
                (other.latency_frames, other.under_way_rad_s2);
        }
        changed
    }

    /// Gimbal angles (pitch, yaw), rad, for one frame.
    ///
    /// `turning_rad_s2` is the rotational acceleration of a unit sine of the gimbal angle, `T
    /// (X_CG - X_THR) / I`; without thrust the nozzle is centred.
    pub fn command_rad(
        &mut self,
        world_from_body: &UnitQuaternion<f64>,
        rate_rad_s: &Vector3<f64>,
        turning_rad_s2: f64,
        aim: &Aim,
        limit_rad: f64,
    ) -> [f64; 2] {
        let rate = [rate_rad_s.y, rate_rad_s.z];
        let sensed_rad_s2 = if self.latency_frames == 0 { [0.0; 2] } else { self.under_way_rad_s2[0] };
        self.observe(rate, sensed_rad_s2);

        let error = turn_to_aim_rad(world_from_body, &aim.nose_in_world).yz();
        let wanted_rate = world_from_body.inverse_transform_vector(&aim.rate_in_world_rad_s).yz();
        let feed_forward = world_from_body.inverse_transform_vector(&aim.acceleration_in_world_rad_s2).yz();

        let frequency = self.gains.natural_frequency_rad_s;
        let mut command = [0.0; 2];
        let mut commanded_rad_s2 = [0.0; 2];
        for axis in 0..2 {
            // The state when this command acts.
            let (mut turned_rad, mut rate_then) = (0.0, rate[axis]);
            for under_way in &self.under_way_rad_s2[..self.latency_frames] {
                let acceleration = under_way[axis] + self.disturbance_rad_s2[axis];
                turned_rad += self.frame_s * (rate_then + 0.5 * self.frame_s * acceleration);
                rate_then += self.frame_s * acceleration;
            }
            let ahead_s = self.latency_frames as f64 * self.frame_s;
            let aim_turned_rad = wanted_rate[axis] * ahead_s;
            let aim_rate = wanted_rate[axis] + feed_forward[axis] * ahead_s;
            let wanted_rad_s2 = frequency * frequency * (error[axis] + aim_turned_rad - turned_rad)
                + 2.0 * self.gains.damping * frequency * (aim_rate - rate_then)
                + feed_forward[axis]
                - self.disturbance_rad_s2[axis];
            if turning_rad_s2 > 0.0 {
                let sine = (-wanted_rad_s2 / turning_rad_s2).clamp(-1.0, 1.0);
                command[axis] = libm::asin(sine).clamp(-limit_rad, limit_rad);
                commanded_rad_s2[axis] = -turning_rad_s2 * libm::sin(command[axis]);
                command[axis] = self.across_the_play_rad(axis, command[axis]).clamp(-limit_rad, limit_rad);
            }
        }
        self.remember(commanded_rad_s2);
        command
    }

    /// The horn's angle that brings the nozzle to an angle, with the play on the side that pushes.
    fn across_the_play_rad(&mut self, axis: usize, nozzle_rad: f64) -> f64 {
        let moved_rad = nozzle_rad - self.nozzle_rad[axis];
        if moved_rad.abs() > REVERSAL_RAD {
            self.side[axis] = moved_rad.signum();
            self.nozzle_rad[axis] = nozzle_rad;
        }
        nozzle_rad + 0.5 * self.gains.play_deg.to_radians() * self.side[axis]
    }

    /// Compares the measured acceleration with the one commanded for that time.
    fn observe(&mut self, rate_rad_s: [f64; 2], sensed_rad_s2: [f64; 2]) {
        if let Some(before) = self.rate_before_rad_s {
            let share = self.frame_s / (self.frame_s + self.gains.disturbance_time_s);
            let most = self.gains.disturbance_max_rad_s2;
            for axis in 0..2 {
                let unexplained = (rate_rad_s[axis] - before[axis]) / self.frame_s - sensed_rad_s2[axis];
                let disturbance = &mut self.disturbance_rad_s2[axis];
                *disturbance = (*disturbance + share * (unexplained - *disturbance)).clamp(-most, most);
            }
        }
        self.rate_before_rad_s = Some(rate_rad_s);
    }

    fn remember(&mut self, commanded_rad_s2: [f64; 2]) {
        if self.latency_frames > 0 {
            self.under_way_rad_s2.copy_within(1..self.latency_frames, 0);
            self.under_way_rad_s2[self.latency_frames - 1] = commanded_rad_s2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::rigid::upright;

    const GAINS: AimGains = AimGains {
        natural_frequency_rad_s: 8.0,
        damping: 0.8,
        latency_s: 0.03,
        disturbance_time_s: 0.1,
        disturbance_max_rad_s2: 20.0,
        play_deg: 0.0,
    };

    #[test]
    fn a_limited_lean_stays_on_its_side() {
        let leaning = |lean_deg: f64| {
            let (sin, cos) = libm::sincos(lean_deg.to_radians());
            Vector3::new(0.6 * sin, -0.8 * sin, cos)
        };
        let limited = |lean_deg: f64| Aim::leaning_at_most(&leaning(lean_deg), 5.0_f64.to_radians());
        assert_eq!(limited(3.0), Aim::at(leaning(3.0)));
        for lean_deg in [8.0, 90.0, 170.0] {
            let nose = limited(lean_deg).nose_in_world;
            assert!((nose - leaning(5.0)).norm() < 1e-12, "{nose} for a lean of {lean_deg} degrees");
        }
        assert_eq!(Aim::leaning_at_most(&-Vector3::z(), 0.1), Aim::upright());
    }

    #[test]
    fn the_shortest_rotation_is_right_handed() {
        // Upright, aimed at world +x: the nose goes down, so q is negative.
        let turn = turn_to_aim_rad(&upright(), &Vector3::x());
        assert!((turn - Vector3::new(0.0, -core::f64::consts::FRAC_PI_2, 0.0)).norm() < 1e-12, "{turn}");
        let aim = Vector3::new(0.3, -0.2, 0.9).normalize();
        let body = upright() * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.7);
        let turn = turn_to_aim_rad(&body, &aim);
        let turned = body * UnitQuaternion::from_scaled_axis(turn) * Vector3::x();
        assert!((turned - aim).norm() < 1e-12, "{turned}");
    }

    /// A body that turns as commanded some frames ago, with a constant disturbance.
    fn fly(disturbance_rad_s2: f64) -> (f64, f64, f64) {
        let (frame_s, turning) = (0.005, 200.0);
        let mut aim_loop = AimLoop::new(GAINS, frame_s);
        let mut attitude = upright() * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.3);
        let mut rate = Vector3::zeros();
        let mut pipe = std::collections::VecDeque::from(vec![[0.0; 2]; 6]);
        let mut overshoot: f64 = 0.0;
        for _ in 0..800 {
            let command = aim_loop.command_rad(&attitude, &rate, turning, &Aim::upright(), 0.12);
            pipe.push_back(command);
            let applied = pipe.pop_front().expect("the queue is never empty");
            let acceleration = Vector3::new(
                0.0,
                disturbance_rad_s2 - turning * libm::sin(applied[0]),
                -turning * libm::sin(applied[1]),
            );
            attitude *=
                UnitQuaternion::from_scaled_axis(rate * frame_s + acceleration * (0.5 * frame_s * frame_s));
            rate += acceleration * frame_s;
            overshoot = overshoot.max(-turn_to_aim_rad(&attitude, &Vector3::z()).y * -1.0);
        }
        let error = turn_to_aim_rad(&attitude, &Vector3::z()).norm();
        (error, overshoot, aim_loop.disturbance_rad_s2[0])
    }

    #[test]
    fn the_loop_settles_despite_latency_and_disturbance() {
        for disturbance in [0.0, 3.0, -3.0] {
            let (error, _, found) = fly(disturbance);
            assert!((found - disturbance).abs() < 0.1, "{found} rad/s^2 found of {disturbance}");
            assert!(error < 2e-3, "{error} rad left under {disturbance} rad/s^2");
        }
        let (_, overshoot, _) = fly(0.0);
        assert!(overshoot < 0.03, "{overshoot} rad");
    }

    #[test]
    fn the_command_crosses_the_play_only_at_a_reversal() {
        let mut aim_loop = AimLoop::new(AimGains { play_deg: 0.5, ..GAINS }, 0.005);
        let half_rad = 0.25_f64.to_radians();
        let mut horn_rad = |nozzle_rad| aim_loop.across_the_play_rad(0, nozzle_rad);
        assert!((horn_rad(0.010) - (0.010 + half_rad)).abs() < 1e-15);
        assert!((horn_rad(0.012) - (0.012 + half_rad)).abs() < 1e-15);
        assert!((horn_rad(0.0119) - (0.0119 + half_rad)).abs() < 1e-15, "too little to be a reversal");
        assert!((horn_rad(0.008) - (0.008 - half_rad)).abs() < 1e-15);
    }
}
