//! Estimates the impulse, the burn time and the instant of ignition of the motor from the specific
//! force along the nose.
//!
//! A solid motor's impulse differs from its data sheet by about 2.5 %, its burn time by about 4 %.
//! With the nominal curve `T0(t)`, the impulse scale `s`, the burn-time stretch `b` and the instant
//! of ignition `t0`, the thrust is `T(t) = (1 + n) s / b T0((t - t0) / b)`. The deviation `n` from
//! the certified shape wanders: it is a first-order Gauss-Markov process with mean zero. Without it
//! a shape error would be taken for an error of impulse and burn time, with ever-growing
//! confidence. The specific force along the nose contains the thrust and the air force: `m f_x = T
//! cos p cos y + d A`, with the gimbal angles `p` and `y`, the modelled air force `A` and its scale
//! `d`. An extended Kalman filter over `(s, b, t0, d, n)` estimates all five; it estimates `d`
//! before ignition, while the vehicle falls.
//!
//! The thrust needs time to rise to its curve. A slow rise burns the propellant later and loses
//! none, so the measured impulse gives the time on the curve, and `t0` is shifted until the thrust
//! is that of the curve. Only then does the filter estimate impulse and burn time.
//!
//! The process and the filter are those of A. Gelb (editor), Applied Optimal Estimation, 1974,
//! chapters 3 and 6.

#[cfg(test)]
mod tests;

use nalgebra::{Matrix5, Vector2, Vector5};
use serde::{Deserialize, Serialize};

use crate::vehicle::burn::{Burn, Deviation};
use crate::vehicle::thrust_curve::ThrustCurve;

/// The input of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSample {
    /// End of the frame, s.
    pub time_s: f64,
    /// Specific force along the nose without its bias, mean over the frame, m/s^2.
    pub axial_specific_force_m_s2: f64,
    pub mass_kg: f64,
    /// Modelled air force along the nose at this speed, N; positive in a tail-first fall.
    pub axial_air_force_n: f64,
    /// Gimbal angles, pitch and yaw, rad.
    pub gimbal_rad: [f64; 2],
    /// The igniter has been fired; ignition is searched for only after that.
    pub may_burn: bool,
}

with_defaults! {
    /// The prior of the motor before ignition, and the noise, as standard deviations. The defaults
    /// are the scatter of certified motors, 1 % of mass, and a hobby accelerometer at 200 Hz.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct MotorPrior {
        /// Length of a frame, s.
        pub frame_s: f64 = 0.005,
        /// Impulse scale. It includes the mass error, because the accelerometer cannot tell the two
        /// apart.
        pub impulse_sigma: f64 = 0.027,
        /// Burn-time stretch.
        pub burn_time_sigma: f64 = 0.04,
        /// Scale of the air force.
        pub air_sigma: f64 = 0.1,
        /// Accelerometer noise of one frame, m/s^2.
        pub accelerometer_m_s2: f64 = 0.09,
        /// Roughness of the burn around its curve, as a fraction of the thrust.
        pub roughness_share: f64 = 0.02,
        /// Deviation of the thrust from the certified shape, as a fraction of the thrust; 0 trusts
        /// the shape.
        pub shape_sigma: f64 = 0.0,
        /// Correlation time of that deviation, s.
        pub shape_lasts_s: f64 = 1.0,
        /// Change of the air force by the exhaust beyond the assumed one, as a fraction of the air
        /// force.
        pub exhaust_sigma: f64 = 0.0,
    }
}

/// State of the motor according to the accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum MotorStage {
    /// No thrust yet, with or without current through the igniter.
    Waiting,
    /// There is thrust, but less than that of the curve.
    Rising,
    /// The thrust is that of the scaled curve.
    Burning,
    /// The thrust fell far below the curve at this time, s: the motor burned out early.
    EndedEarly { at_s: f64 },
}

/// Thrust with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedThrust {
    pub thrust_n: f64,
    /// Standard deviation, N.
    pub sigma_n: f64,
}

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotorEstimate {
    prior: MotorPrior,
    detector: Detector,
    stage: MotorStage,
    /// Impulse scale, burn-time stretch, ignition, s, air scale, deviation from the shape.
    mean: Vector5<f64>,
    covariance: Matrix5<f64>,
    /// Time of the last update of the deviation from the shape, s.
    updated_at_s: f64,
    /// Frames in a row with far too little thrust.
    starved_frames: u32,
    rise: Rise,
}

// The prior is constant; everything that changes is in the mean and the covariance.
const IMPULSE: usize = 0;
const STRETCH: usize = 1;
const IGNITION: usize = 2;
const AIR: usize = 3;
const SHAPE: usize = 4;

/// The igniter and the first pressure peak are not in the curve, so samples within this time after
/// ignition are not used, s.
const SPIKE_S: f64 = 0.06;
/// Correlation time of roughness and shape errors, s: samples within it are not independent.
const ROUGHNESS_LASTS_S: f64 = 0.1;
/// Gusts along the nose and a lean against the wind change the air force by this fraction.
const GUST_SHARE: f64 = 0.03;
/// Correlation time of that change, s.
const GUST_LASTS_S: f64 = 0.5;
/// Wander of the air scale in one second: the flow changes with speed, lean and exhaust.
const AIR_WALK_SQRT_S: f64 = 0.01;
/// Air force below which its scale is not estimated, N: the accelerometer's noise is as large.
const SMALLEST_AIR_N: f64 = 2.0;
/// Fraction of the peak below which samples of the tail-off are not used.
const TAIL_SHARE: f64 = 0.08;
/// A sample that differs from its prediction by more than this many standard deviations is
/// rejected.
const GATE_SIGMAS: f64 = 5.0;
/// Fraction of the predicted thrust below which, for [`STARVED_FRAMES`] in a row, the motor has
/// burned out: no motor is so weak.
const STARVED_SHARE: f64 = 0.3;
/// 80 ms: a dip of the thrust is shorter.
const STARVED_FRAMES: u32 = 16;
/// A motor that stops within this time of its first thrust has chuffed, and reignites, s: its
/// propellant did not burn yet where the igniter did not reach.
const CHUFF_S: f64 = 0.4;
/// Half the span over which the curve's slope is taken, s.
const SLOPE_SPAN_S: f64 = 0.02;
/// Limits of the scales.
const IMPULSE_RANGE: [f64; 2] = [0.7, 1.3];
const STRETCH_RANGE: [f64; 2] = [0.8, 1.25];

impl MotorEstimate {
    /// The filter before ignition, with the prior only.
    pub fn new(prior: &MotorPrior) -> Self {
        let sigmas = Vector5::new(
            prior.impulse_sigma,
            prior.burn_time_sigma,
            IGNITION_SIGMA_S,
            prior.air_sigma,
            prior.shape_sigma,
        );
        Self {
            prior: *prior,
            detector: Detector::default(),
            stage: MotorStage::Waiting,
            mean: Vector5::new(1.0, 1.0, 0.0, 1.0, 0.0),
            covariance: Matrix5::from_diagonal(&sigmas.component_mul(&sigmas)),
            updated_at_s: 0.0,
            starved_frames: 0,
            rise: Rise::default(),
        }
    }

    /// State of the motor.
    pub fn stage(&self) -> MotorStage {
        self.stage
    }

    /// Whether there is thrust.
    pub fn burns(&self) -> bool {
        matches!(self.stage, MotorStage::Rising | MotorStage::Burning)
    }

    /// True impulse over nominal impulse.
    pub fn impulse_scale(&self) -> f64 {
        self.mean[IMPULSE]
    }

    /// True burn time over nominal burn time.
    pub fn burn_time_stretch(&self) -> f64 {
        self.mean[STRETCH]
    }

    /// Instant of ignition, s; `None` before it.
    pub fn ignition_s(&self) -> Option<f64> {
        (self.stage != MotorStage::Waiting).then_some(self.mean[IGNITION])
    }

    /// True air force divided by modelled air force, at least a tenth. Around a tumbling apogee the
    /// estimate may pass through zero, and a vehicle without drag has no terminal speed. Of 1,050
    /// flights of mk2, mk3 and vlr in four sets of dispersions two fell below a third, both in
    /// `real-harsh`.
    pub fn air_scale(&self) -> f64 {
        self.mean[AIR].max(0.1)
    }

    /// True thrust over that of the scaled curve at this moment, less 1.
    pub fn shape_deviation(&self) -> f64 {
        self.mean[SHAPE]
    }

    /// Standard deviations of impulse scale, burn-time stretch, ignition, s, air scale and shape.
    pub fn sigmas(&self) -> [f64; 5] {
        core::array::from_fn(|index| libm::sqrt(self.covariance[(index, index)].max(0.0)))
    }

    /// The burn as estimated.
    pub fn burn<'a>(&self, curve: &'a ThrustCurve) -> Burn<'a> {
        Burn {
            curve,
            impulse_scale: self.impulse_scale(),
            time_scale: self.burn_time_stretch(),
            deviation: self.deviation(self.mean[SHAPE]),
        }
    }

    fn deviation(&self, share: f64) -> Deviation {
        if self.stage == MotorStage::Waiting {
            return Deviation::NONE;
        }
        Deviation { share, at_s: self.updated_at_s - self.mean[IGNITION], lasts_s: self.prior.shape_lasts_s }
    }

    /// The worst burn at this many standard deviations: the one that changes a quantity most, given
    /// the quantity's derivatives by impulse scale, burn-time stretch and deviation from the shape.
    /// A positive number of deviations raises the quantity.
    pub fn dispersed<'a>(&self, curve: &'a ThrustCurve, derivatives: [f64; 3], sigmas: f64) -> Burn<'a> {
        let [by_impulse, by_stretch, by_shape] = derivatives;
        let by_scales = Vector2::new(by_impulse, by_stretch);
        let covariance = &self.covariance;
        let with_shape = Vector2::new(covariance[(IMPULSE, SHAPE)], covariance[(STRETCH, SHAPE)]);
        let with = covariance.fixed_view::<2, 2>(0, 0) * by_scales + with_shape * by_shape;
        let shape_with = with_shape.dot(&by_scales) + covariance[(SHAPE, SHAPE)] * by_shape;
        let variance = with.dot(&by_scales) + shape_with * by_shape;
        let share = if variance > 0.0 { sigmas / libm::sqrt(variance) } else { 0.0 };
        let moved = with * share;
        Burn {
            curve,
            impulse_scale: (self.mean[IMPULSE] + moved.x).clamp(IMPULSE_RANGE[0], IMPULSE_RANGE[1]),
            time_scale: (self.mean[STRETCH] + moved.y).clamp(STRETCH_RANGE[0], STRETCH_RANGE[1]),
            deviation: self.deviation(self.mean[SHAPE] + shape_with * share),
        }
    }

    /// Takes one frame. A sample that is not finite is ignored.
    pub fn update(&mut self, curve: &ThrustCurve, sample: &MotorSample) {
        let force_n = sample.mass_kg * sample.axial_specific_force_m_s2;
        let cosine = libm::cos(sample.gimbal_rad[0]) * libm::cos(sample.gimbal_rad[1]);
        let finite = [sample.time_s, force_n, sample.axial_air_force_n, cosine];
        if !finite.iter().all(|value| value.is_finite()) {
            return;
        }
        self.covariance[(AIR, AIR)] += AIR_WALK_SQRT_S * AIR_WALK_SQRT_S * self.prior.frame_s;
        match self.stage {
            MotorStage::Waiting => self.wait(curve, sample, force_n),
            MotorStage::Rising | MotorStage::Burning => self.follow(curve, sample, force_n, cosine),
            MotorStage::EndedEarly { .. } => {}
        }
    }

    /// Before ignition: estimates the air scale, and searches for thrust once the igniter is fired.
    fn wait(&mut self, curve: &ThrustCurve, sample: &MotorSample, force_n: f64) {
        let air_n = sample.axial_air_force_n;
        let thrust_n = force_n - self.mean[AIR] * air_n;
        if sample.may_burn {
            // Without thrust the noise of the accelerometer adds up to no impulse.
            self.rise.take(curve, thrust_n - NO_THRUST_SHARE * curve.peak_thrust_n(), self.prior.frame_s);
            let middle_s = sample.time_s - 0.5 * self.prior.frame_s;
            let mark_n = CAUGHT_SHARE * curve.peak_thrust_n();
            if let Some(crossed_s) = self.detector.take(mark_n, middle_s, thrust_n) {
                self.stage = MotorStage::Rising;
                // A motor that chuffed continues along its curve.
                let begun_s = curve_rise_s(curve, mark_n).max(self.rise.chuffed_s);
                self.rise.flame_s = crossed_s - begun_s;
                self.mean[IGNITION] = self.rise.flame_s;
                self.covariance[(AIR, AIR)] += self.prior.exhaust_sigma * self.prior.exhaust_sigma;
            }
        }
        // Rising thrust must not be taken for air force.
        if self.detector.crossed_s.is_none() && air_n.abs() > SMALLEST_AIR_N {
            self.learn(sample, Vector5::new(0.0, 0.0, 0.0, air_n, 0.0), thrust_n, 0.0);
        }
    }

    /// Thrust at a time on the sample's clock. Before ignition the motor is assumed to light at
    /// `lights_at_s`.
    pub fn predict(&self, curve: &ThrustCurve, time_s: f64, lights_at_s: f64) -> PredictedThrust {
        let ignition_s = match self.stage {
            MotorStage::Waiting => lights_at_s,
            MotorStage::EndedEarly { at_s } if time_s >= at_s => {
                return PredictedThrust { thrust_n: 0.0, sigma_n: 0.0 };
            }
            _ => self.mean[IGNITION],
        };
        // After the last sample the deviation from the shape decays.
        let decay = match self.stage {
            MotorStage::Waiting => 0.0,
            _ => libm::exp(-(time_s - self.updated_at_s).max(0.0) / self.prior.shape_lasts_s),
        };
        let then = Self { mean: self.mean.component_mul(&Vector5::new(1.0, 1.0, 1.0, 1.0, decay)), ..*self };
        let (thrust_n, mut sensitivity) = then.thrust(curve, time_s - ignition_s);
        let by_shape_n = sensitivity[SHAPE];
        sensitivity[SHAPE] *= decay;
        let wandered = self.prior.shape_sigma * self.prior.shape_sigma * (1.0 - decay * decay);
        let variance =
            product(&sensitivity, &(self.covariance * sensitivity)) + by_shape_n * by_shape_n * wandered;
        PredictedThrust { thrust_n, sigma_n: libm::sqrt(variance.max(0.0)) }
    }

    /// Normalised estimation error squared of impulse scale and burn-time stretch against the
    /// truth. In a consistent filter it is chi-square with 2 degrees of freedom. `None` if the
    /// covariance has lost rank.
    pub fn nees_of_scales(&self, impulse_scale: f64, burn_time_stretch: f64) -> Option<f64> {
        let error = Vector2::new(impulse_scale, burn_time_stretch) - self.mean.fixed_rows::<2>(0);
        let covariance = self.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        Some(error.dot(&covariance.cholesky()?.solve(&error)))
    }

    /// Thrust and its derivatives by the four, at a time since ignition.
    fn thrust(&self, curve: &ThrustCurve, since_s: f64) -> (f64, Vector5<f64>) {
        let (scale, stretch) = (self.mean[IMPULSE], self.mean[STRETCH]);
        let nominal_s = since_s / stretch;
        let nominal_n = curve.thrust_at_n(nominal_s);
        let as_certified_n = scale / stretch * nominal_n;
        let shape = 1.0 + self.mean[SHAPE];
        let thrust_n = as_certified_n * shape;
        // Only points inside the burn are used, because the curve has steps at its ends.
        let (from_s, to_s) = ((nominal_s - SLOPE_SPAN_S).max(0.0), nominal_s + SLOPE_SPAN_S);
        let slope_n_s = if nominal_n > 0.0 {
            (curve.thrust_at_n(to_s) - curve.thrust_at_n(from_s)) / (to_s - from_s)
        } else {
            0.0
        };
        let by_time = scale / (stretch * stretch) * slope_n_s * shape;
        let sensitivity = Vector5::new(
            nominal_n / stretch * shape,
            -thrust_n / stretch - by_time * nominal_s,
            -by_time,
            0.0,
            as_certified_n,
        );
        (thrust_n, sensitivity)
    }

    fn follow(&mut self, curve: &ThrustCurve, sample: &MotorSample, force_n: f64, cosine: f64) {
        self.wander();
        self.updated_at_s = sample.time_s;
        let middle_s = sample.time_s - 0.5 * self.prior.frame_s;
        let air_n = sample.axial_air_force_n;
        let measured_n = force_n - self.mean[AIR] * air_n;
        if self.stage == MotorStage::Rising && self.is_rising(curve, measured_n / cosine, middle_s) {
            return;
        }
        let since_s = middle_s - self.mean[IGNITION];
        let (thrust_n, by_motor) = self.thrust(curve, since_s);
        if since_s < SPIKE_S || thrust_n < TAIL_SHARE * curve.peak_thrust_n() {
            self.starved_frames = 0;
            return;
        }
        let starved = measured_n < STARVED_SHARE * thrust_n * cosine;
        self.starved_frames = if starved { self.starved_frames + 1 } else { 0 };
        if self.starved_frames >= STARVED_FRAMES {
            let lasted_s = f64::from(STARVED_FRAMES) * self.prior.frame_s;
            if since_s < CHUFF_S {
                self.chuff((since_s - lasted_s).max(0.0));
            } else {
                self.stage = MotorStage::EndedEarly { at_s: sample.time_s - lasted_s };
            }
        }
        if starved {
            return;
        }
        let mut sensitivity = by_motor * cosine;
        sensitivity[AIR] = air_n;
        let innovation_n = force_n - thrust_n * cosine - self.mean[AIR] * air_n;
        self.learn(sample, sensitivity, innovation_n, thrust_n);
    }

    /// Follows the thrust to its curve, and shifts the ignition to where the impulse so far lies on
    /// the curve: a slow rise burns the propellant later, and loses none. Returns whether the
    /// thrust still rises.
    fn is_rising(&mut self, curve: &ThrustCurve, measured_n: f64, middle_s: f64) -> bool {
        let share_now = self.rise.take(curve, measured_n, self.prior.frame_s);
        let since_s = middle_s - self.rise.flame_s;
        let Rise { share, earlier_share, .. } = self.rise;
        if share < FLAME_SHARE && since_s >= SPIKE_S {
            self.chuff(self.rise.along_s);
        }
        if since_s < SPIKE_S || share_now < 0.5 * share || self.stage == MotorStage::Waiting {
            return true;
        }
        let weak = share - earlier_share < STILL_RISING || since_s > RISE_MAX_S;
        let risen = weak || share >= RISEN_SHARE;
        if weak && share < RISEN_SHARE {
            self.rise.given_n_s /= share;
            self.rise.advance(curve);
            // Certified motors do not scatter so far, so the prior of the impulse does not hold.
            let missing_share = RISEN_SHARE - share;
            self.covariance[(IMPULSE, IMPULSE)] += missing_share * missing_share;
        }
        let along_s = self.rise.along_s;
        // A linear rise to a share r in a time t has advanced by r t / 2 along the curve, and is
        // delayed by t (1 - r)^2 / (2 r) more.
        let missing = if risen { 0.0 } else { (1.0 - share) / share };
        let ignition_s = middle_s + 0.5 * self.prior.frame_s - along_s + missing * missing * along_s;
        let slow = ignition_s - self.rise.flame_s > SLOW_RISE_S;
        self.mean[IGNITION] = if slow { ignition_s } else { self.rise.flame_s };
        if risen {
            self.stage = MotorStage::Burning;
            let sigma_s = if slow { self.prior.burn_time_sigma * along_s } else { 0.0 };
            self.covariance[(IGNITION, IGNITION)] += sigma_s * sigma_s;
        }
        !risen
    }

    /// Waits for the thrust again after the motor has gone out at this time on its curve, s.
    fn chuff(&mut self, along_s: f64) {
        self.rise = Rise { along_s, chuffed_s: along_s, ..Rise::default() };
        self.stage = MotorStage::Waiting;
        self.detector = Detector::default();
        self.starved_frames = 0;
    }

    /// The deviation from the shape over one frame.
    fn wander(&mut self) {
        let sigma = self.prior.shape_sigma;
        if sigma <= 0.0 {
            return;
        }
        let decay = libm::exp(-self.prior.frame_s / self.prior.shape_lasts_s);
        self.mean[SHAPE] *= decay;
        for index in 0..SHAPE {
            self.covariance[(SHAPE, index)] *= decay;
            self.covariance[(index, SHAPE)] *= decay;
        }
        let variance = &mut self.covariance[(SHAPE, SHAPE)];
        *variance = decay * decay * *variance + (1.0 - decay * decay) * sigma * sigma;
    }

    fn learn(&mut self, sample: &MotorSample, sensitivity: Vector5<f64>, innovation_n: f64, thrust_n: f64) {
        let white_n = sample.mass_kg * self.prior.accelerometer_m_s2;
        let frames = |lasts_s: f64| (lasts_s / self.prior.frame_s).max(1.0);
        let rough_n = self.prior.roughness_share * thrust_n;
        let gust_n = GUST_SHARE * sample.axial_air_force_n;
        let noise = white_n * white_n
            + rough_n * rough_n * frames(ROUGHNESS_LASTS_S)
            + gust_n * gust_n * frames(GUST_LASTS_S);
        let with = self.covariance * sensitivity;
        let variance = product(&sensitivity, &with) + noise;
        if innovation_n * innovation_n > GATE_SIGMAS * GATE_SIGMAS * variance {
            return;
        }
        let gain = with / variance;
        self.mean += gain * innovation_n;
        // P h' h P / s is exactly symmetric, so the difference stays symmetric.
        self.covariance -= with * with.transpose() / variance;
        for index in 0..SHAPE {
            self.covariance[(index, index)] = self.covariance[(index, index)].max(1e-12);
        }
        self.mean[IMPULSE] = self.mean[IMPULSE].clamp(IMPULSE_RANGE[0], IMPULSE_RANGE[1]);
        self.mean[STRETCH] = self.mean[STRETCH].clamp(STRETCH_RANGE[0], STRETCH_RANGE[1]);
    }
}

/// The scalar product. The first four terms are added as in a product of four, so that a filter
/// that trusts the shape gives the same bits as one without a fifth state: logs of that filter
/// still verify.
fn product(one: &Vector5<f64>, other: &Vector5<f64>) -> f64 {
    one.fixed_rows::<4>(0).dot(&other.fixed_rows::<4>(0)) + one[SHAPE] * other[SHAPE]
}

// Finds the instant of ignition with a resolution finer than a frame.

/// The motor burns when the thrust is above this fraction of the peak in two frames in a row.
const CAUGHT_SHARE: f64 = 0.1;
/// Below this fraction of the peak the motor does not burn.
const NO_THRUST_SHARE: f64 = 0.02;
/// Standard deviation of the instant, s: about a frame.
const IGNITION_SIGMA_S: f64 = 0.004;
/// The curve's own rise to that fraction is searched up to this time, and in steps of this length,
/// s.
const RISE_S: f64 = 0.3;
const RISE_STEP_S: f64 = 0.0005;

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Detector {
    /// Middle of the last frame, s, and its thrust, N.
    last: Option<(f64, f64)>,
    /// When the thrust rose through the threshold, if the last frame was above it, s.
    crossed_s: Option<f64>,
}

impl Detector {
    /// Takes a frame's mean thrust. Returns when the thrust rose through the threshold, s, if this
    /// is the second frame above it.
    fn take(&mut self, mark_n: f64, middle_s: f64, thrust_n: f64) -> Option<f64> {
        let before = self.last.replace((middle_s, thrust_n));
        if thrust_n <= mark_n {
            self.crossed_s = None;
            return None;
        }
        if self.crossed_s.is_some() {
            return self.crossed_s;
        }
        self.crossed_s = Some(match before {
            Some((before_s, before_n)) if thrust_n > before_n && before_n <= mark_n => {
                before_s + (middle_s - before_s) * (mark_n - before_n) / (thrust_n - before_n)
            }
            _ => middle_s,
        });
        None
    }
}

// Follows the thrust from the flame to the curve.

/// Time constants of the filters of the share of the curve's thrust, s: longer than the noise of
/// the accelerometer, shorter than a slow rise.
const SHARE_S: f64 = 0.02;
const EARLIER_SHARE_S: f64 = 0.06;
/// The rise has ended at this share of the curve's thrust; that of a weaker motor when the two
/// filtered shares differ by less than this, or after this time, s.
const RISEN_SHARE: f64 = 0.9;
const STILL_RISING: f64 = 0.02;
const RISE_MAX_S: f64 = 1.0;
/// Below this share of the curve's thrust a rising motor has gone out.
const FLAME_SHARE: f64 = 0.05;
/// A rise that delays the burn by less than this, s, cannot be distinguished from that of the
/// curve: the first pressure peak and the noise shift the ignition as much.
const SLOW_RISE_S: f64 = 0.01;

/// The rise of the thrust.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Rise {
    /// Instant of ignition by the first thrust, s.
    flame_s: f64,
    /// Time on the curve at which the measured impulse is reached, s; and the impulse, N s.
    along_s: f64,
    given_n_s: f64,
    /// Measured thrust over that of the curve there, with two time constants.
    share: f64,
    earlier_share: f64,
    /// Time on the curve at which the motor chuffed, s; 0 if it did not.
    chuffed_s: f64,
}

impl Rise {
    /// Takes a frame's mean thrust, N. Returns its share of the curve's thrust.
    fn take(&mut self, curve: &ThrustCurve, thrust_n: f64, frame_s: f64) -> f64 {
        self.given_n_s = (self.given_n_s + frame_s * thrust_n).max(curve.impulse_to_n_s(self.chuffed_s));
        self.advance(curve);
        let share = thrust_n / curve.thrust_at_n(self.along_s).max(CAUGHT_SHARE * curve.peak_thrust_n());
        self.share += (share - self.share) * (frame_s / SHARE_S).min(1.0);
        self.earlier_share += (share - self.earlier_share) * (frame_s / EARLIER_SHARE_S).min(1.0);
        share
    }

    /// Moves along the curve to the measured impulse.
    fn advance(&mut self, curve: &ThrustCurve) {
        while curve.impulse_to_n_s(self.along_s) < self.given_n_s && self.along_s < curve.burn_time_s() {
            self.along_s += RISE_STEP_S;
        }
    }
}

/// How long the curve itself takes to rise to the threshold, s.
fn curve_rise_s(curve: &ThrustCurve, mark_n: f64) -> f64 {
    let steps = (RISE_S / RISE_STEP_S) as u32;
    (0..steps)
        .map(|step| f64::from(step) * RISE_STEP_S)
        .find(|time_s| curve.thrust_at_n(*time_s) >= mark_n)
        .unwrap_or(0.0)
}
