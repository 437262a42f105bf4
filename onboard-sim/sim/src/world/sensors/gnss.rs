//! The satellite receiver with its late fixes: white and wandering errors (Groves 2013, chapter 9).

use flight::estimation::estimator::{FixQuality, GRAVITY_M_S2, GnssFix};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::noise::{Fate, Flaws, fate};
use super::{MS_S, SensorParams, SensorTruth, Sensors};

flight::with_defaults! {
    /// Satellite receiver. Its position is zeroed on the pad before the flight and wanders from
    /// then on.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct GnssParams {
        /// Time between fixes, ms.
        pub period_ms: u32 = 200,
        /// Age of a fix when it arrives, ms; below the period.
        pub delay_ms: u32 = 120,
        /// Velocity noise, each axis, m/s.
        pub velocity_m_s: f64 = 0.05,
        /// White position noise, horizontal, each axis, m.
        pub horizontal_white_m: f64 = 0.2,
        /// White position noise, vertical, m.
        pub vertical_white_m: f64 = 0.3,
        /// Wandering position error, horizontal, each axis, m.
        pub horizontal_wander_m: f64 = 1.5,
        /// Wandering position error, vertical, m.
        pub vertical_wander_m: f64 = 2.5,
        /// Correlation time of the wandering error, s.
        pub wander_correlation_s: f64 = 200.0,
        /// Time from the zeroing on the pad to the start of the simulation, s.
        pub zeroed_before_s: f64 = 20.0,
        /// Error of the fixes' time tags, the same for all of a flight, s.
        pub time_tag_s: f64 = 0.0,
        /// Error of each fix's time tag beside that, s.
        pub age_jitter_s: f64 = 0.0,
        /// Wandering velocity error, each axis, m/s, and its correlation time, s.
        pub velocity_wander_m_s: f64 = 0.0,
        pub velocity_wander_correlation_s: f64 = 60.0,
        /// Probability that a fix is lost.
        pub dropout_share: f64 = 0.0,
        /// Probability that a fix is an outlier, and how far an outlier's position is off, each
        /// axis, m.
        pub outlier_share: f64 = 0.0,
        pub outlier_m: f64 = 0.0,
        /// How much of the sky a lean takes from an antenna that looks along the nose: at 1 beyond
        /// 20 degrees of tilt the noise is threefold, and beyond 30 half of the fixes are lost.
        pub shadow_share: f64 = 0.0,
        /// Time for which the receiver repeats the motion at lift-off as valid fixes, s.
        pub stale_s: f64 = 0.0,
    }
}

/// Spread of position, m, and velocity, m/s, of a receiver that holds its last state.
const HELD_SPREAD: f64 = 0.02;

impl Sensors {
    /// Keeps reporting this motion for a time, s, as valid and slightly changing fixes.
    pub(crate) fn hold_fixes(&mut self, state: &RigidState, for_s: f64) {
        self.stale = Some((*state, self.elapsed_ms + (for_s / MS_S) as u32));
    }

    pub(super) fn watch_satellites(&mut self, truth: &SensorTruth, out: bool) {
        let gnss = &self.params.gnss;
        let ago_ms = (self.elapsed_ms + gnss.period_ms - self.gnss_phase_ms) % gnss.period_ms;
        if ago_ms >= truth.inertial.steps as u32 {
            return;
        }
        let now_ms = self.elapsed_ms - ago_ms;
        for axis in &mut self.wander {
            axis.advance(f64::from(gnss.period_ms) * MS_S, &mut self.gnss_noise);
        }
        let wandered_m = Vector3::from_fn(|axis, _| self.wander[axis].value) - self.zero_m;
        let white_m = Vector3::new(gnss.horizontal_white_m, gnss.horizontal_white_m, gnss.vertical_white_m);
        let (older_s, slow_m_s) = self.flaws.of_satellites(&self.params);
        let mut then = moved_back(truth, older_s + f64::from(ago_ms) * MS_S);
        let lever_m = self.places.lever_arms(&truth.cg_m).gnss_m;
        then.velocity_m_s += then.world_from_body * then.rate_rad_s.cross(&lever_m);
        then.position_m += then.world_from_body * lever_m;
        let beyond = |limit_deg: f64, share: f64| {
            if then.tilt_rad() > limit_deg.to_radians() { share * gnss.shadow_share } else { 0.0 }
        };
        let (noise, shadowed_share) = (1.0 + beyond(20.0, 2.0), beyond(30.0, 0.5));
        let mut fix = GnssFix {
            position_m: then.position_m
                + wandered_m
                + self.gnss_noise.next3().component_mul(&white_m) * noise,
            velocity_m_s: then.velocity_m_s
                + slow_m_s
                + self.gnss_noise.next3() * (gnss.velocity_m_s * noise),
            valid_at_s: self.start_s + f64::from(now_ms) * MS_S + self.flaws.gnss_tag_s,
            quality: FixQuality {
                satellites: 9,
                horizontal_m: gnss.horizontal_wander_m,
                vertical_m: gnss.vertical_wander_m,
                speed_m_s: gnss.velocity_m_s * noise,
            },
        };
        let stale = self.stale.filter(|(_, until_ms)| now_ms < *until_ms);
        if let Some((held, _)) = stale {
            fix.position_m = held.position_m + self.flaws.satellites.next3() * HELD_SPREAD;
            fix.velocity_m_s = held.velocity_m_s + self.flaws.satellites.next3() * HELD_SPREAD;
        }
        let (fate, off_m) = self.flaws.of_fix(&self.params, shadowed_share);
        if fate == Fate::Outlier {
            fix.position_m += off_m;
        }
        if stale.is_some() || !out && fate != Fate::Lost {
            self.on_its_way = Some((now_ms + gnss.delay_ms, fix));
        }
    }

    /// The fix that has arrived by this frame.
    pub(super) fn arrived(&mut self) -> Option<GnssFix> {
        let now_ms = self.elapsed_ms;
        self.on_its_way.take_if(|(at_ms, _)| *at_ms <= now_ms).map(|(_, fix)| fix)
    }
}

impl Flaws {
    /// Errors of the next fix: its age beyond the time tag, s, and its wandering velocity error,
    /// m/s.
    fn of_satellites(&mut self, params: &SensorParams) -> (f64, Vector3<f64>) {
        let gnss = &params.gnss;
        for axis in &mut self.velocity_wander {
            axis.advance(f64::from(gnss.period_ms) * MS_S, &mut self.satellites);
        }
        let older_s = gnss.age_jitter_s * self.satellites.next();
        (older_s, Vector3::from_fn(|axis, _| self.velocity_wander[axis].value))
    }

    /// Fate of a fix, at this loss rate in a lean, and the error of an outlier, m.
    fn of_fix(&mut self, params: &SensorParams, shadowed_share: f64) -> (Fate, Vector3<f64>) {
        let lost_share = params.gnss.dropout_share + shadowed_share;
        let fate = fate(self.gnss.unit(), lost_share, params.gnss.outlier_share);
        (fate, self.gnss.next3() * params.gnss.outlier_m)
    }
}

/// The motion some time ago, s, under the present acceleration.
fn moved_back(truth: &SensorTruth, older_s: f64) -> RigidState {
    let mut acceleration_m_s2 = truth.state.world_from_body * truth.inertial.specific_force_m_s2;
    acceleration_m_s2.z -= GRAVITY_M_S2;
    RigidState {
        position_m: truth.state.position_m - truth.state.velocity_m_s * older_s,
        velocity_m_s: truth.state.velocity_m_s - acceleration_m_s2 * older_s,
        ..truth.state
    }
}
