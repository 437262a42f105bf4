//! The history of the flight for the review page: when each phase began, and the greatest values.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::trace::Trace;
use super::vehicle::Vehicle;

/// The longest timeline, so that a vehicle that keeps changing its phase cannot fill the memory.
const TIMELINE_MAX: usize = 64;

/// The greatest values since the vehicle left the pad; `None` if a value was never received.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Maxima {
    pub altitude_m: Option<f64>,
    /// Descent speed, m/s, down.
    pub descent_m_s: Option<f64>,
    /// Tilt from the vertical, rad.
    pub tilt_rad: Option<f64>,
    /// Distance from the pad over the ground, m.
    pub distance_m: Option<f64>,
    /// How fast the nose turned, rad/s, in any direction.
    pub turn_rate_rad_s: Option<f64>,
    /// The larger measured gimbal angle of the two axes, rad, without its sign.
    pub gimbal_rad: Option<f64>,
    pub solve_time_s: Option<f64>,
    /// The smallest margin to the deadline, s.
    pub margin_min_s: Option<f64>,
    /// Time without a heartbeat, s.
    pub silence_s: Option<f64>,
}

/// What the review page shows.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// Each phase and when it was first received, since the start of the run.
    pub timeline: Vec<(TdPhase, Duration)>,
    pub maxima: Maxima,
    pub trace: Trace,
}

impl History {
    pub(crate) fn note_phase(&mut self, phase: TdPhase, now: Duration) {
        if self.timeline.len() < TIMELINE_MAX && self.timeline.last().is_none_or(|(last, _)| *last != phase) {
            self.timeline.push((phase, now));
        }
    }

    /// Takes the current values, unless they are stale.
    pub(crate) fn note_values(&mut self, vehicle: &Vehicle, silence: Option<Duration>, now: Duration) {
        if !vehicle.in_flight() {
            return;
        }
        let maxima = &mut self.maxima;
        if let Some(motion) = vehicle.best_motion().filter(|motion| !motion.is_stale(now)) {
            raise(&mut maxima.altitude_m, motion.value.altitude_m);
            raise(&mut maxima.descent_m_s, -motion.value.climb_m_s);
            raise(&mut maxima.distance_m, motion.value.distance_m());
        }
        if let Some(attitude) = vehicle.attitude.filter(|attitude| !attitude.is_stale(now)) {
            raise(&mut maxima.tilt_rad, attitude.value.tilt_rad);
            raise(&mut maxima.turn_rate_rad_s, attitude.value.turn_rate_rad_s());
        }
        if let Some(gimbal) = vehicle.gimbal.filter(|gimbal| !gimbal.is_stale(now)) {
            for axis in [gimbal.value.pitch, gimbal.value.yaw] {
                raise(&mut maxima.gimbal_rad, axis.measured_rad.abs());
            }
        }
        if let Some(controller) = vehicle.controller.as_ref().filter(|controller| !controller.is_stale(now)) {
            raise(&mut maxima.solve_time_s, f64::from(controller.value.solve_time_us) * 1e-6);
            let mut less = maxima.margin_min_s.map(|margin| -margin);
            raise(&mut less, -f64::from(controller.value.deadline_margin_us) * 1e-6);
            maxima.margin_min_s = less.map(|margin| -margin);
        }
        if let Some(silence) = silence {
            raise(&mut maxima.silence_s, silence.as_secs_f64());
        }
    }
}

fn raise(greatest: &mut Option<f64>, value: f64) {
    if value.is_finite() {
        *greatest = Some(greatest.map_or(value, |known| known.max(value)));
    }
}
