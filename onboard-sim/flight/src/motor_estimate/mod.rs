//! How strong the burning motor is, how fast it burns, and when it caught, from what the accelerometer feels along the
//! nose.
//!
//! A solid motor's impulse differs from its data sheet's by some 2.5 %, its burn time by some 4 %: with the nominal
//! curve `T0(t)`, the impulse scale `s`, the burn-time stretch `b` and the instant of ignition `t0`,
//! `T(t) = s / b T0((t - t0) / b)`. Along the nose the vehicle feels that and the air:
//! `m f_x = T cos p cos y + d A`, with the gimbal angles `p` and `y`, the air force `A` reckoned with, and its scale
//! `d`. An extended Kalman filter over `(s, b, t0, d)` finds all four; `d` while the vehicle still falls unlit.

mod digest;
mod ignition;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix4, Vector2, Vector4};
use serde::Deserialize;

use self::ignition::Detector;
use crate::thrust_curve::ThrustCurve;

/// The data sheet's thrust over time since ignition, s to N; nil before 0 and after the burn.
pub trait NominalThrust {
    /// Thrust at a time since ignition, N.
    fn thrust_n(&self, time_s: f64) -> f64;
    /// Largest thrust, N.
    fn peak_n(&self) -> f64;
}

impl NominalThrust for ThrustCurve {
    fn thrust_n(&self, time_s: f64) -> f64 {
        self.thrust_at_n(time_s)
    }

    fn peak_n(&self) -> f64 {
        self.peak_thrust_n()
    }
}

/// What one frame tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSample {
    /// End of the frame, s.
    pub time_s: f64,
    /// Specific force along the nose, mean over the frame, bias taken out, m/s^2.
    pub axial_specific_force_m_s2: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Air force along the nose that the vehicle's data say at this speed, N; positive when falling tail-first.
    pub axial_air_force_n: f64,
    /// Gimbal angles, pitch and yaw, rad.
    pub gimbal_rad: [f64; 2],
    /// The igniter has been fired: only then is thrust looked for.
    pub may_burn: bool,
}

/// What is believed before the motor is lit, and of its noise. Standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotorPrior {
    /// Length of a frame, s.
    pub frame_s: f64,
    /// Impulse scale; mass error is in it, because the accelerometer cannot tell them apart.
    pub impulse_sigma: f64,
    /// Burn-time stretch.
    pub burn_time_sigma: f64,
    /// Scale of the air force.
    pub air_sigma: f64,
    /// Accelerometer noise of one frame, m/s^2.
    pub accelerometer_m_s2: f64,
    /// Roughness of the burn around its curve, as a share of the thrust.
    pub roughness_share: f64,
}

impl Default for MotorPrior {
    /// Motor scatter as certified motors show it, 1 % of mass, a hobby accelerometer at 200 Hz.
    fn default() -> Self {
        Self {
            frame_s: 0.005,
            impulse_sigma: 0.027,
            burn_time_sigma: 0.04,
            air_sigma: 0.1,
            accelerometer_m_s2: 0.09,
            roughness_share: 0.02,
        }
    }
}

/// Where the motor is in its life, as far as the accelerometer can tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotorStage {
    /// Not lit.
    Waiting,
    /// Burning.
    Burning,
    /// Its thrust has fallen far below the curve, at this time, s: burnt out early.
    EndedEarly {
        /// When, s.
        at_s: f64,
    },
}

/// Thrust with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedThrust {
    /// N.
    pub thrust_n: f64,
    /// Standard deviation, N.
    pub sigma_n: f64,
}

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorEstimate {
    prior: MotorPrior,
    detector: Detector,
    stage: MotorStage,
    /// Impulse scale, burn-time stretch, ignition, s, air scale.
    mean: Vector4<f64>,
    covariance: Matrix4<f64>,
    /// Frames in a row with far too little thrust.
    starved_frames: u32,
}

const IMPULSE: usize = 0;
const STRETCH: usize = 1;
const IGNITION: usize = 2;
const AIR: usize = 3;

/// The igniter and the first pressure peak are not in the curve: nothing is learnt so long, s.
const SPIKE_S: f64 = 0.06;
/// Roughness and shape errors last about so long, s: samples within it are not independent.
const ROUGHNESS_LASTS_S: f64 = 0.1;
/// Gusts along the nose and a lean against the wind change the air force by this share, and last about so long, s.
const GUST_SHARE: f64 = 0.03;
const GUST_LASTS_S: f64 = 0.5;
/// Wander of the air scale, in one second: the flow changes with speed, lean and exhaust.
const AIR_WALK_SQRT_S: f64 = 0.01;
/// The air teaches nothing below this force, N.
const SMALLEST_AIR_N: f64 = 2.0;
/// Below this share of the peak the tail-off is left alone.
const TAIL_SHARE: f64 = 0.08;
/// A sample further from the expected than this many standard deviations is left out.
const GATE_SIGMAS: f64 = 5.0;
/// Below this share of the predicted thrust, for so many frames in a row, the motor has gone out.
const STARVED_SHARE: f64 = 0.3;
const STARVED_FRAMES: u32 = 16;
/// Half the span over which the curve's slope is taken, s.
const SLOPE_SPAN_S: f64 = 0.02;
/// The scales stay inside these whatever is measured.
const IMPULSE_RANGE: [f64; 2] = [0.7, 1.3];
const STRETCH_RANGE: [f64; 2] = [0.8, 1.25];

impl MotorEstimate {
    /// Before ignition, knowing the prior only.
    pub fn new(prior: &MotorPrior) -> Self {
        let sigmas =
            Vector4::new(prior.impulse_sigma, prior.burn_time_sigma, ignition::SIGMA_S, prior.air_sigma);
        Self {
            prior: *prior,
            detector: Detector::default(),
            stage: MotorStage::Waiting,
            mean: Vector4::new(1.0, 1.0, 0.0, 1.0),
            covariance: Matrix4::from_diagonal(&sigmas.component_mul(&sigmas)),
            starved_frames: 0,
        }
    }

    /// Where the motor is in its life.
    pub fn stage(&self) -> MotorStage {
        self.stage
    }

    /// True impulse over nominal impulse.
    pub fn impulse_scale(&self) -> f64 {
        self.mean[IMPULSE]
    }

    /// True burn time over nominal burn time.
    pub fn burn_time_stretch(&self) -> f64 {
        self.mean[STRETCH]
    }

    /// When the motor caught, s; `None` before.
    pub fn ignition_s(&self) -> Option<f64> {
        (self.stage != MotorStage::Waiting).then_some(self.mean[IGNITION])
    }

    /// Air force over the one reckoned with.
    pub fn air_scale(&self) -> f64 {
        self.mean[AIR]
    }

    /// Standard deviations of impulse scale, burn-time stretch, ignition, s, and air scale.
    pub fn sigmas(&self) -> [f64; 4] {
        core::array::from_fn(|index| self.covariance[(index, index)].max(0.0).sqrt())
    }

    /// Impulse scale and burn-time stretch of the motor that, so many standard deviations from the expected one,
    /// changes a quantity most which has these derivatives by the two; positive deviations raise it.
    pub fn doubted(&self, derivatives: [f64; 2], sigmas: f64) -> [f64; 2] {
        let with = self.covariance.fixed_view::<2, 2>(0, 0) * Vector2::from(derivatives);
        let variance = with.dot(&Vector2::from(derivatives));
        let moved = if variance > 0.0 { with * (sigmas / variance.sqrt()) } else { Vector2::zeros() };
        [
            (self.mean[IMPULSE] + moved.x).clamp(IMPULSE_RANGE[0], IMPULSE_RANGE[1]),
            (self.mean[STRETCH] + moved.y).clamp(STRETCH_RANGE[0], STRETCH_RANGE[1]),
        ]
    }

    /// Takes one frame. A sample that is not finite teaches nothing.
    pub fn update(&mut self, curve: &impl NominalThrust, sample: &MotorSample) {
        let force_n = sample.mass_kg * sample.axial_specific_force_m_s2;
        let cosine = libm::cos(sample.gimbal_rad[0]) * libm::cos(sample.gimbal_rad[1]);
        let finite = [sample.time_s, force_n, sample.axial_air_force_n, cosine];
        if !finite.iter().all(|value| value.is_finite()) {
            return;
        }
        self.covariance[(AIR, AIR)] += AIR_WALK_SQRT_S * AIR_WALK_SQRT_S * self.prior.frame_s;
        match self.stage {
            MotorStage::Waiting => self.wait(curve, sample, force_n),
            MotorStage::Burning => self.follow(curve, sample, force_n, cosine),
            MotorStage::EndedEarly { .. } => {}
        }
    }

    /// Before ignition: the air is learnt, and once the igniter is fired thrust is looked for.
    fn wait(&mut self, curve: &impl NominalThrust, sample: &MotorSample, force_n: f64) {
        let air_n = sample.axial_air_force_n;
        let thrust_n = force_n - self.air_scale() * air_n;
        if sample.may_burn {
            let middle_s = sample.time_s - 0.5 * self.prior.frame_s;
            if let Some(ignition_s) = self.detector.take(curve, middle_s, thrust_n) {
                self.stage = MotorStage::Burning;
                self.mean[IGNITION] = ignition_s;
            }
        }
        // A thrust that rises must not be taken for air.
        if !self.detector.suspects() && air_n.abs() > SMALLEST_AIR_N {
            self.learn(sample, Vector4::new(0.0, 0.0, 0.0, air_n), thrust_n, 0.0);
        }
    }

    /// Thrust at a time on the sample's clock. Before ignition the motor is taken to light at `lights_at_s`.
    pub fn predict(&self, curve: &impl NominalThrust, time_s: f64, lights_at_s: f64) -> PredictedThrust {
        let ignition_s = match self.stage {
            MotorStage::Waiting => lights_at_s,
            MotorStage::EndedEarly { at_s } if time_s >= at_s => {
                return PredictedThrust { thrust_n: 0.0, sigma_n: 0.0 };
            }
            MotorStage::Burning | MotorStage::EndedEarly { .. } => self.mean[IGNITION],
        };
        let (thrust_n, sensitivity) = self.thrust(curve, time_s - ignition_s);
        let variance = sensitivity.dot(&(self.covariance * sensitivity));
        PredictedThrust { thrust_n, sigma_n: variance.max(0.0).sqrt() }
    }

    /// Thrust and its derivatives by the four, at a time since ignition.
    fn thrust(&self, curve: &impl NominalThrust, since_s: f64) -> (f64, Vector4<f64>) {
        let (scale, stretch) = (self.mean[IMPULSE], self.mean[STRETCH]);
        let nominal_s = since_s / stretch;
        let nominal_n = curve.thrust_n(nominal_s);
        let thrust_n = scale / stretch * nominal_n;
        // From inside the burn only: the ends are steps.
        let (from_s, to_s) = ((nominal_s - SLOPE_SPAN_S).max(0.0), nominal_s + SLOPE_SPAN_S);
        let slope_n_s = if nominal_n > 0.0 {
            (curve.thrust_n(to_s) - curve.thrust_n(from_s)) / (to_s - from_s)
        } else {
            0.0
        };
        let by_time = scale / (stretch * stretch) * slope_n_s;
        let sensitivity =
            Vector4::new(nominal_n / stretch, -thrust_n / stretch - by_time * nominal_s, -by_time, 0.0);
        (thrust_n, sensitivity)
    }

    fn follow(&mut self, curve: &impl NominalThrust, sample: &MotorSample, force_n: f64, cosine: f64) {
        let since_s = sample.time_s - 0.5 * self.prior.frame_s - self.mean[IGNITION];
        let (thrust_n, by_motor) = self.thrust(curve, since_s);
        if since_s < SPIKE_S || thrust_n < TAIL_SHARE * curve.peak_n() {
            self.starved_frames = 0;
            return;
        }
        let air_n = sample.axial_air_force_n;
        let starved = force_n - self.air_scale() * air_n < STARVED_SHARE * thrust_n * cosine;
        self.starved_frames = if starved { self.starved_frames + 1 } else { 0 };
        if self.starved_frames >= STARVED_FRAMES {
            let lasted_s = f64::from(STARVED_FRAMES) * self.prior.frame_s;
            self.stage = MotorStage::EndedEarly { at_s: sample.time_s - lasted_s };
            return;
        }
        if starved {
            return;
        }
        let mut sensitivity = by_motor * cosine;
        sensitivity[AIR] = air_n;
        let innovation_n = force_n - thrust_n * cosine - self.air_scale() * air_n;
        self.learn(sample, sensitivity, innovation_n, thrust_n);
    }

    fn learn(&mut self, sample: &MotorSample, sensitivity: Vector4<f64>, innovation_n: f64, thrust_n: f64) {
        let white_n = sample.mass_kg * self.prior.accelerometer_m_s2;
        let frames = |lasts_s: f64| (lasts_s / self.prior.frame_s).max(1.0);
        let rough_n = self.prior.roughness_share * thrust_n;
        let gust_n = GUST_SHARE * sample.axial_air_force_n;
        let noise = white_n * white_n
            + rough_n * rough_n * frames(ROUGHNESS_LASTS_S)
            + gust_n * gust_n * frames(GUST_LASTS_S);
        let with = self.covariance * sensitivity;
        let variance = sensitivity.dot(&with) + noise;
        if innovation_n * innovation_n > GATE_SIGMAS * GATE_SIGMAS * variance {
            return;
        }
        let gain = with / variance;
        self.mean += gain * innovation_n;
        // P h' h P / s is symmetric to the bit; what is left stays so.
        self.covariance -= with * with.transpose() / variance;
        for index in 0..4 {
            self.covariance[(index, index)] = self.covariance[(index, index)].max(1e-12);
        }
        self.mean[IMPULSE] = self.mean[IMPULSE].clamp(IMPULSE_RANGE[0], IMPULSE_RANGE[1]);
        self.mean[STRETCH] = self.mean[STRETCH].clamp(STRETCH_RANGE[0], STRETCH_RANGE[1]);
    }
}
