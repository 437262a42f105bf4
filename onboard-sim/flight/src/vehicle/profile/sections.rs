//! The sections of a profile, one struct each, with their accessors in SI and radians.

use serde::Deserialize;

use super::{FinalBox, ModelKind, SolverLimits};
use crate::vehicle::dynamics::PlanarState;

/// Mass, inertia and shape of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    pub mass_kg: f64,
    /// Moment of inertia about the pitch axis, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    /// Length of the body, m.
    pub length_m: f64,
    /// Diameter of the body, m.
    pub diameter_m: f64,
    /// Reference area of the drag coefficient, m^2.
    pub reference_area_m2: f64,
    /// Axial drag coefficient.
    pub drag_coefficient: f64,
    /// Centre of gravity relative to mid-length, positive towards the nose, m.
    pub cg_from_mid_m: f64,
    /// Nozzle pivot relative to mid-length, positive towards the nose, m.
    pub nozzle_from_mid_m: f64,
}

impl Vehicle {
    /// Distance from the nozzle pivot forward to the centre of gravity, m.
    pub fn thrust_arm_m(&self) -> f64 {
        self.cg_from_mid_m - self.nozzle_from_mid_m
    }
}

/// Gravity and air, both constant over the landing.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    pub gravity_m_s2: f64,
    pub air_density_kg_m3: f64,
}

/// The landing motor: constant thrust for a time, then none.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Thrust while burning, N.
    pub thrust_n: f64,
    /// Burn time from ignition, s.
    pub burn_time_s: f64,
}

impl Motor {
    /// Nominal thrust at a time since ignition, N.
    pub fn thrust_at_n(&self, time_since_ignition_s: f64) -> f64 {
        if (0.0..self.burn_time_s).contains(&time_since_ignition_s) { self.thrust_n } else { 0.0 }
    }

    /// Mean nominal thrust over `[from_s, from_s + duration_s]` since ignition, N. The impulse is right even if the
    /// burn ends inside the interval.
    pub fn mean_thrust_n(&self, from_s: f64, duration_s: f64) -> f64 {
        if duration_s <= 0.0 || duration_s.is_nan() {
            return self.thrust_at_n(from_s);
        }
        let to_s = from_s + duration_s;
        // Sample times are multiples of the sample time except for rounding, so a remainder of rounding size counts as
        // zero.
        let slack_s = 1e-9 * duration_s;
        if from_s >= -slack_s && to_s <= self.burn_time_s + slack_s {
            return self.thrust_n;
        }
        let burning_s = (to_s.min(self.burn_time_s) - from_s.max(0.0)).max(0.0);
        self.thrust_n * burning_s / duration_s
    }
}

/// The thrust-vectoring actuator.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gimbal {
    /// Mechanical stop on either side, degrees.
    pub limit_deg: f64,
    /// Slew rate of the servo, degrees per second; without it the servo is ideal.
    pub rate_limit_deg_s: Option<f64>,
}

impl Gimbal {
    /// Mechanical stop on either side, rad.
    pub fn limit_rad(&self) -> f64 {
        self.limit_deg.to_radians()
    }

    /// Slew rate of the servo, rad/s; `None` is an ideal servo.
    pub fn rate_limit_rad_s(&self) -> Option<f64> {
        self.rate_limit_deg_s.map(f64::to_radians)
    }
}

/// The four fins: opening angle from the body, 0 closed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fins {
    /// Opening angle when closed, degrees.
    pub closed_deg: f64,
    /// Opening angle when deployed, degrees.
    pub deployed_deg: f64,
    /// Slew rate, degrees per second.
    pub rate_limit_deg_s: f64,
}

impl Fins {
    /// Opening angle when closed, rad.
    pub fn closed_rad(&self) -> f64 {
        self.closed_deg.to_radians()
    }

    /// Opening angle when deployed, rad.
    pub fn deployed_rad(&self) -> f64 {
        self.deployed_deg.to_radians()
    }

    /// Slew rate, rad/s.
    pub fn rate_limit_rad_s(&self) -> f64 {
        self.rate_limit_deg_s.to_radians()
    }
}

/// The start of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartPoint {
    /// On the pad, under its own ascent motor.
    Pad,
    /// Released at apogee.
    Apogee,
    /// Hanging below a drone, which lets it go.
    Drone,
    /// Released at the instant of landing-motor ignition.
    Ignition,
}

impl StartPoint {
    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pad => "pad",
            Self::Apogee => "apogee",
            Self::Drone => "drone",
            Self::Ignition => "ignition",
        }
    }
}

impl core::str::FromStr for StartPoint {
    type Err = UnknownStart;

    fn from_str(name: &str) -> Result<Self, UnknownStart> {
        let all = [Self::Pad, Self::Apogee, Self::Drone, Self::Ignition];
        all.into_iter().find(|start| start.name() == name).ok_or(UnknownStart)
    }
}

/// No flight begins there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a start: pad, apogee, drone or ignition is accepted")]
pub struct UnknownStart;

/// The state at the release, and the countdown before it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// The point of the flight at which it begins.
    pub at: StartPoint,
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m, up.
    pub altitude_m: f64,
    /// Pitch from the horizontal, degrees; 90 is upright.
    pub pitch_deg: f64,
    /// Velocity along the body's nose axis, m/s.
    pub u_m_s: f64,
    /// Velocity along the body's second axis, m/s.
    pub w_m_s: f64,
    pub pitch_rate_deg_s: f64,
    /// Countdown between the start command and the release, s.
    pub countdown_s: f64,
}

impl Start {
    /// The planar state at release.
    pub fn planar_state(&self) -> PlanarState {
        PlanarState {
            x_m: self.x_m,
            z_m: self.altitude_m,
            theta_rad: self.pitch_deg.to_radians(),
            u_m_s: self.u_m_s,
            w_m_s: self.w_m_s,
            q_rad_s: self.pitch_rate_deg_s.to_radians(),
        }
    }
}

/// The landing controller.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nmpc {
    /// Its planar equations.
    pub model: ModelKind,
    pub sample_time_s: f64,
    /// Intervals from ignition to touchdown.
    pub horizon_steps: usize,
    /// Samples between the computation and the application of a command; this controller needs one.
    pub actuation_delay_steps: usize,
    /// Diagonal weights of the running cost.
    pub weights: StateWeights,
    /// Limits of the trajectory.
    pub limits: TrajectoryLimits,
    /// Limits of the solver.
    pub solver: SolverLimits,
}

/// Diagonal weights of the running cost, Eq. 28 of the landing paper; SI units and radians.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateWeights {
    /// Horizontal position, 1/m^2.
    pub x: f64,
    /// Altitude, 1/m^2.
    #[serde(default)]
    pub z: f64,
    /// Pitch from upright, 1/rad^2.
    pub theta: f64,
    /// Axial velocity, s^2/m^2.
    #[serde(default)]
    pub u: f64,
    /// Lateral velocity, s^2/m^2.
    #[serde(default)]
    pub w: f64,
    /// Pitch rate, s^2/rad^2.
    #[serde(default)]
    pub q: f64,
    /// Gimbal angle, 1/rad^2 (the paper's P).
    pub delta: f64,
}

impl StateWeights {
    /// The state weights in state order (x, z, theta, u, w, q).
    pub fn state_diagonal(&self) -> [f64; 6] {
        [self.x, self.z, self.theta, self.u, self.w, self.q]
    }
}

/// Limits of the planned trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryLimits {
    /// Largest planned gimbal angle on either side, degrees.
    pub gimbal_deg: f64,
    /// Largest horizontal distance at the end, m.
    pub x_final_m: f64,
    /// Lowest planned altitude before the end, m; without it the path is free.
    pub altitude_min_m: Option<f64>,
    /// Box in which the other states end; without it only the cost decides them.
    #[serde(rename = "final")]
    pub final_box: Option<FinalBox>,
}

impl TrajectoryLimits {
    /// Largest planned gimbal angle on either side, rad.
    pub fn gimbal_rad(&self) -> f64 {
        self.gimbal_deg.to_radians()
    }
}

/// The upright law's tuning.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StabiliserGains {
    /// Decay rate of both closed-loop poles, 1/s.
    pub decay_rate_per_s: f64,
}

impl Default for StabiliserGains {
    fn default() -> Self {
        Self { decay_rate_per_s: 4.0 }
    }
}

/// What counts as a landing (Table 2 of the landing paper).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TouchdownBox {
    /// Largest horizontal distance, m.
    pub x_m: f64,
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Largest pitch error from upright, degrees.
    pub pitch_error_deg: f64,
    /// Largest axial speed, m/s.
    pub u_m_s: f64,
    /// Largest lateral speed, m/s.
    pub w_m_s: f64,
    /// Largest pitch rate, degrees per second.
    pub pitch_rate_deg_s: f64,
}

/// Limits of the pad checks before arming.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ArmingLimits {
    /// Largest tilt from vertical, degrees.
    pub tilt_max_deg: f64,
    /// Largest rotation rate that counts as rest, degrees per second.
    pub rotation_max_deg_s: f64,
    /// Largest speed that counts as rest, m/s.
    pub speed_max_m_s: f64,
    /// Smallest free log space, bytes.
    pub log_space_min_bytes: u64,
    /// Lowest voltage of the battery, V. The default is for two lithium-polymer cells: 3.7 V a cell at light load is
    /// about a seventh of the charge, a quarter of an hour of the simulated vehicle (1 Ah, 0.5 A), and 0.8 V above the 6.6 V
    /// at which common 5 V regulators give up; six moving servos and an igniter take 0.65 V of that (9.2 A through 70 mohm).
    pub battery_min_v: f64,
}

impl Default for ArmingLimits {
    fn default() -> Self {
        Self {
            tilt_max_deg: 5.0,
            rotation_max_deg_s: 2.0,
            speed_max_m_s: 0.2,
            log_space_min_bytes: 64 << 20,
            battery_min_v: 7.4,
        }
    }
}

/// Limits of the checks before ignition.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GateLimits {
    /// Largest tilt from vertical, degrees.
    pub tilt_max_deg: f64,
    /// Largest pitch rate, degrees per second.
    pub pitch_rate_max_deg_s: f64,
    /// Largest difference from the predicted speed, as a fraction of it.
    pub speed_error_max_fraction: f64,
    /// Largest disagreement of two height sources, m.
    pub height_disagreement_max_m: f64,
    /// Radius of the fence that must contain the predicted touchdown, m.
    pub fence_radius_m: f64,
}

/// How the true vehicle differs from the controller's model.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plant {
    /// True thrust divided by nominal thrust.
    pub thrust_scale: f64,
}

impl Default for Plant {
    fn default() -> Self {
        Self { thrust_scale: 1.0 }
    }
}

/// One-sigma scatter for a campaign; zero means no scatter.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Dispersion {
    /// Thrust, as a fraction of nominal.
    pub thrust_fraction: f64,
    /// Axial velocity at release, m/s.
    pub u_m_s: f64,
    /// Lateral velocity at release, m/s.
    pub w_m_s: f64,
    /// Pitch at release, degrees.
    pub pitch_deg: f64,
    /// Pitch rate at release, degrees per second.
    pub pitch_rate_deg_s: f64,
    /// Altitude at release, m.
    pub altitude_m: f64,
}
