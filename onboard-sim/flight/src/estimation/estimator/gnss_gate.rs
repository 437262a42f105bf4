//! Admission of satellite fixes: the change between fixes must match the integrated specific force.
//!
//! Receivers that lose track under boost may keep reporting their last state as valid fixes. From
//! one fix to the next the inertial unit is far more accurate than over a flight. So the change
//! between two fixes shows a receiver that does not follow the motion, whatever the estimate.

use nalgebra::Vector3;
use serde::Serialize;

use super::covariance::{POSITION, VELOCITY};
use super::health::BRIDGED_FRAMES;
use super::{Estimator, GnssFix};
use crate::estimation::sensor_watch::FROZEN_IMU;

/// Largest change of velocity between two fixes that no motion explains, m/s: late time tags and
/// rounding.
const UNEXPLAINED_M_S: f64 = 0.25;
/// The same, in standard deviations of a velocity.
const UNEXPLAINED_SIGMAS: f64 = 6.0;
/// Error of the integrated specific force, as a share of it: tilt and scale.
const GAINED_SHARE: f64 = 0.1;
/// The same, as a share of the integral of the specific force's magnitude.
const FORCE_SHARE: f64 = 0.05;
/// Error of a fix's age, s.
const AGE_ERROR_S: f64 = 0.02;
/// Difference between the change of position and the two velocities, m, and as a share of it.
const UNEXPLAINED_M: f64 = 4.0;
const MOVED_SHARE: f64 = 0.2;
/// Conditions that end the quarantine: the receiver follows the motion, and is this close to the
/// estimate, in velocity, m/s, position, m, and standard deviations of the estimate. After an
/// outage of the complete ascent the estimated velocity is off by 0.3 m/s. A receiver that is off
/// by 1 m/s moves the estimated height as far from the true one as the barometer's scale permits.
const NEAR_M_S: f64 = 0.8;
/// The same velocity if the quarantine began in the burn: there a spike of the accelerometer by 1 g
/// has moved the estimate by 1.7 m/s.
const NEAR_IN_BURN_M_S: f64 = 2.0;
const NEAR_M: f64 = 30.0;
const NEAR_SIGMAS: f64 = 5.0;
/// Velocity gained by the specific force between two fixes, m/s, above which their change shows no
/// small step, and the distance from the estimate, m/s, within which the receiver is admitted then:
/// twice the estimate's error after the boost, which an accelerometer that is off by 0.05 g
/// doubles.
const PUSHED_M_S: f64 = 5.0;
const PUSHED_NEAR_M_S: f64 = 1.5;
/// Conditions after an outage: a receiver quarantined after an outage of this length, s, and this
/// far from the estimate, m/s, must instead follow this change of velocity, m/s, which a frozen one
/// cannot.
const OUTAGE_S: f64 = 1.0;
const FAR_M_S: f64 = 5.0;
const FOLLOWED_M_S: f64 = 4.0;
/// Position error, horizontal or vertical, from which a receiver's accuracy report counts, m.
/// Below, it is mostly the slow offset that the filter estimates.
pub(super) const REPORTED_M: f64 = 5.0;
/// Satellites needed for a three-dimensional fix.
const SATELLITES: u32 = 4;

/// The last fix, whether it was admitted or not.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
struct Reference {
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
    valid_at_s: f64,
    /// Sum of the velocity gained when it was valid, m/s.
    gained_m_s: Vector3<f64>,
}

impl Reference {
    /// Velocity beyond the sum gained, m/s: the same for all fixes of receivers without errors.
    fn surplus_m_s(&self) -> Vector3<f64> {
        self.velocity_m_s - self.gained_m_s
    }
}

/// State of the gate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct GnssGate {
    last: Reference,
    /// Whether the last reference is a fix, and not the start.
    has_fix: bool,
    pub(super) quarantined: bool,
    /// The quarantine began with the first fix after an outage.
    after_outage: bool,
    /// It began while a motor burned.
    in_burn: bool,
    /// Change of velocity that the last fixes have followed in a row, m/s.
    followed_m_s: f64,
    /// Integral of the specific force's magnitude since the last fix, m/s.
    force_m_s: f64,
    /// Frames without a usable inertial sample since then, and with repeated samples.
    blind_frames: u32,
    repeated_frames: u32,
    /// Velocity gained in unmeasured shocks since then, m/s.
    pub(super) shock_m_s: f64,
    /// Velocity of the fix admitted in this frame, m/s.
    admitted_m_s: Option<Vector3<f64>>,
}

impl GnssGate {
    /// Before the first fix, of a vehicle with this velocity, world, m/s.
    pub(super) fn new(velocity_m_s: &Vector3<f64>) -> Self {
        let last = Reference { velocity_m_s: *velocity_m_s, ..Reference::default() };
        Self { last, ..Self::default() }
    }

    /// Begins a frame with the velocity gained by the specific force, m/s, whether it was measured,
    /// and whether it repeats the sample before.
    pub(super) fn begin_frame(&mut self, force_m_s: f64, measured: bool, repeated: bool) {
        self.admitted_m_s = None;
        self.force_m_s += force_m_s;
        self.repeated_frames = if repeated { self.repeated_frames.saturating_add(1) } else { 0 };
        let blind = !measured || self.repeated_frames >= FROZEN_IMU;
        self.blind_frames = self.blind_frames.saturating_add(u32::from(blind));
    }
}

impl Estimator {
    /// Velocity of the fix admitted in the last frame, world, m/s.
    pub(crate) fn admitted_gnss_m_s(&self) -> Option<Vector3<f64>> {
        self.gnss_gate.admitted_m_s
    }

    /// Whether a fix may correct the estimate and vote on apogee; `burns`: a motor burns.
    pub(super) fn admits(&mut self, fix: &GnssFix, burns: bool) -> bool {
        let admitted = self.follows_the_motion(fix, burns);
        if admitted {
            self.gnss_gate.admitted_m_s = Some(fix.velocity_m_s);
        } else {
            self.aids.gnss_velocity.discard();
            self.aids.gnss_position.discard();
        }
        admitted
    }

    fn follows_the_motion(&mut self, fix: &GnssFix, burns: bool) -> bool {
        let [lever_m, lever_m_s] = self.history.lever;
        let velocity_m_s = self.nominal.velocity_m_s + lever_m_s;
        let enough = fix.quality.satellites == 0 || fix.quality.satellites >= SATELLITES;
        let finite = fix.position_m.iter().chain(&fix.velocity_m_s).all(|value| value.is_finite());
        let Some(since) = self.since_fix(fix).filter(|_| enough && finite) else { return false };
        let sigma_m_s = self.config.gnss_velocity_m_s.max(fix.quality.speed_m_s);
        let gate = &mut self.gnss_gate;
        let now = Reference {
            position_m: fix.position_m,
            velocity_m_s: fix.velocity_m_s,
            valid_at_s: fix.valid_at_s,
            gained_m_s: self.history.gained_m_s() - since.gained_m_s,
        };
        let before = core::mem::replace(&mut gate.last, now);
        let had_fix = core::mem::replace(&mut gate.has_fix, true);
        let gained_m_s = now.gained_m_s - before.gained_m_s;
        let fell_s = now.valid_at_s - before.valid_at_s;
        let sensed_m_s = gained_m_s + Vector3::z() * (self.config.gravity_m_s2 * fell_s);
        let unexplained_m_s = (now.surplus_m_s() - before.surplus_m_s()).norm();
        let pushed = gate.force_m_s > PUSHED_M_S;
        let limit_m_s = UNEXPLAINED_M_S
            + UNEXPLAINED_SIGMAS * sigma_m_s
            + GAINED_SHARE * sensed_m_s.norm()
            + FORCE_SHARE * core::mem::take(&mut gate.force_m_s)
            + AGE_ERROR_S * since.acceleration_m_s2.norm()
            + core::mem::take(&mut gate.shock_m_s);
        let moved_m = (now.velocity_m_s + before.velocity_m_s) * (0.5 * (now.valid_at_s - before.valid_at_s));
        let astray_m = (now.position_m - before.position_m - moved_m).norm();
        let stays = !had_fix || astray_m <= UNEXPLAINED_M + MOVED_SHARE * moved_m.norm();
        let repeated =
            had_fix && (now.position_m, now.velocity_m_s) == (before.position_m, before.velocity_m_s);
        let off_m_s = (fix.velocity_m_s - velocity_m_s + since.gained_m_s).norm();
        let near_m_s = NEAR_SIGMAS * self.covariance.sigmas(VELOCITY).norm();
        let near = !pushed || off_m_s <= near_m_s.max(PUSHED_NEAR_M_S);
        if core::mem::take(&mut gate.blind_frames) <= BRIDGED_FRAMES {
            if unexplained_m_s <= limit_m_s && stays && near {
                gate.followed_m_s += gained_m_s.norm();
            } else {
                gate.followed_m_s = 0.0;
                gate.after_outage = !gate.quarantined && now.valid_at_s - before.valid_at_s > OUTAGE_S;
                gate.in_burn = if gate.quarantined { gate.in_burn } else { burns && !pushed };
                gate.quarantined = true;
            }
        }
        let off_m = (fix.position_m - self.nominal.position_m - lever_m + since.moved_m).norm();
        let near_m = NEAR_M + NEAR_SIGMAS * self.covariance.sigmas(POSITION).norm();
        // After an outage the estimate may be far off, but a receiver that follows the motion
        // hardly ever is.
        let returns = gate.after_outage && gate.followed_m_s >= FOLLOWED_M_S && off_m_s > FAR_M_S;
        let near_m_s = if gate.in_burn { NEAR_IN_BURN_M_S } else { NEAR_M_S };
        if gate.followed_m_s > 0.0 && (off_m_s <= near_m_s || returns) && off_m <= near_m {
            gate.quarantined = false;
        }
        !gate.quarantined && !repeated
    }
}
