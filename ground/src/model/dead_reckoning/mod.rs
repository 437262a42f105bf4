//! Predicts the position of the vehicle after the link is lost in flight.
//!
//! Under thrust the vehicle is assumed to follow its last plan. Otherwise `extrapolation` continues the last known
//! motion, with the drag estimated from the last second's acceleration, the wind, and the height at which the motor
//! was to be lit.
//!
//! The error circle is meant to contain the vehicle in 19 of 20 cases. It grows with the time `t` since the last
//! position: errors of position, speed and acceleration add up to `s0 + sv t + sa t^2 / 2`. If a burn is expected,
//! the circle also reaches the position without a burn. It stops growing once the vehicle must have landed.

mod extrapolation;

use std::time::Duration;

use protocol::dialect::{TdChute, TdHold, TdPhase};

use super::vehicle::{Vehicle, is_burning};
pub use extrapolation::Basis;
use extrapolation::{Extrapolated, LastMotion};

/// Error of the last position, m: usual for a satellite receiver.
const POSITION_ERROR_M: f64 = 1.5;
/// Error of the last speed, m/s.
const SPEED_ERROR_M_S: f64 = 0.5;
/// Error of the acceleration, m/s2: fins and thrust steer in an unknown direction.
const STEERED_ERROR_M_S2: f64 = 2.0;
/// The same while the drag changes: between free fall and terminal speed.
const OPENING_ERROR_M_S2: f64 = 5.0;
/// The same while a boost motor of unknown thrust burns.
const LIFTED_ERROR_M_S2: f64 = 20.0;
/// In space, surplus thrust of a burn is directed sideways, in an unknown direction: at most this acceleration, m/s2,
/// for this time, s. The resulting speed is kept.
const SWERVE_M_S2: f64 = 6.0;
const SWERVE_S: f64 = 1.0;
/// A landing is at most this share of the predicted time, plus this time, s, later than predicted.
const LATE_SHARE: f64 = 0.25;
const LATE_S: f64 = 2.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedPosition {
    /// North of the pad, m.
    pub x_m: f64,
    /// East of the pad, m.
    pub y_m: f64,
    /// Never below the ground.
    pub altitude_m: f64,
    /// The radius of the error circle, m.
    pub error_m: f64,
    /// Time since the last position.
    pub age: Duration,
    pub basis: Basis,
    /// It must have come down by now.
    pub is_down: bool,
}

/// The predicted position of a vehicle in flight whose last position is stale. `None` while the vehicle is heard or
/// on the ground, or if no position in flight is known.
pub fn predict_position(vehicle: &Vehicle, now: Duration) -> Option<PredictedPosition> {
    let motion = vehicle.best_motion()?;
    if !is_unheard(vehicle, now) {
        return None;
    }
    let phase = vehicle.phase()?.value;
    let on_plan = along_plan(vehicle, phase, now);
    // A position on the pad says nothing about a flight from apogee; only a boost starts on the pad.
    let in_flight = vehicle.left_pad_at.is_some_and(|at| motion.received_at >= at);
    if !in_flight && phase != TdPhase::TD_PHASE_BOOST && on_plan.is_none() {
        return None;
    }
    let age = motion.age(now);
    let seconds = age.as_secs_f64();
    let expected = on_plan.unwrap_or_else(|| LastMotion::of(vehicle, phase, &motion.value).after(seconds));
    let down_after_s = expected.landed_after_s.map(|landed_s| (1.0 + LATE_SHARE) * landed_s + LATE_S);
    let growing_s = down_after_s.map_or(seconds, |down_s| seconds.min(down_s));
    let wrong_m_s2 = acceleration_error_m_s2(vehicle, phase, expected.basis);
    let swerved_m = if vehicle.in_space { swerve_m(expected.burning_s) } else { 0.0 };
    let grown_m = SPEED_ERROR_M_S * growing_s + 0.5 * wrong_m_s2 * growing_s * growing_s + swerved_m;
    Some(PredictedPosition {
        x_m: expected.x_m,
        y_m: expected.y_m,
        altitude_m: expected.altitude_m.max(0.0),
        error_m: POSITION_ERROR_M + grown_m + expected.or_else_m,
        age,
        basis: expected.basis,
        is_down: down_after_s.is_some_and(|down_s| seconds > down_s),
    })
}

/// For how long the vehicle may have been in the air: its countdown ran when it was last heard, and has reached zero since.
/// A hold or an abort in the silence is not known here.
pub fn may_have_left(vehicle: &Vehicle, now: Duration) -> Option<Duration> {
    let status = vehicle.status.as_ref().filter(|status| status.is_stale(now))?;
    let counted =
        status.value.phase == TdPhase::TD_PHASE_PAD_ARMED && status.value.hold == TdHold::TD_HOLD_NONE;
    let left_s = vehicle.countdown_s().filter(|left| counted && left.value > 0.0)?.value;
    // Something heard after it may already tell of the flight.
    status.age(now).checked_sub(Duration::from_secs_f64(left_s)).filter(|_| vehicle.left_pad_at.is_none())
}

/// Whether the vehicle is in flight and its position is stale.
pub fn is_unheard(vehicle: &Vehicle, now: Duration) -> bool {
    let in_silence = match vehicle.best_motion() {
        Some(motion) => motion.is_stale(now),
        None => vehicle.phase().is_some_and(|phase| phase.is_stale(now)),
    };
    vehicle.in_flight() && in_silence
}

fn acceleration_error_m_s2(vehicle: &Vehicle, phase: TdPhase, basis: Basis) -> f64 {
    let chute = vehicle.descent.as_ref().map(|descent| descent.value.chute);
    match phase {
        TdPhase::TD_PHASE_BOOST => LIFTED_ERROR_M_S2,
        _ if basis == Basis::FreeFall => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_COAST | TdPhase::TD_PHASE_DEPLOY => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_CHUTE if chute != Some(TdChute::TD_CHUTE_OPEN) => OPENING_ERROR_M_S2,
        _ => STEERED_ERROR_M_S2,
    }
}

fn swerve_m(burning_s: f64) -> f64 {
    let swerving_s = burning_s.min(SWERVE_S);
    SWERVE_M_S2 * swerving_s * (burning_s - 0.5 * swerving_s)
}

/// Under thrust, the present position on the plan. Its points are evenly spaced in time. The motion across the plane
/// of the plan is assumed to stop when the plan ends.
fn along_plan(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> Option<Extrapolated> {
    let (path, prediction) = (vehicle.path.as_ref()?, vehicle.prediction?);
    let motion = vehicle.best_motion()?;
    let last = path.value.len().checked_sub(1)?;
    // The duration of the plan, from the time of its path: path and time to go come in separate messages.
    let apart_s = prediction.received_at.as_secs_f64() - path.received_at.as_secs_f64();
    let total_s = prediction.value.time_to_go_s + apart_s;
    if !is_burning(phase) || total_s.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let place = (path.age(now).as_secs_f64() / total_s).min(1.0) * last as f64;
    let before = (place.floor() as usize).min(last);
    let (from, to) = (path.value[before], path.value[(before + 1).min(last)]);
    let share = place - before as f64;
    let end_s = total_s - path.age(motion.received_at).as_secs_f64();
    let passed_s = motion.age(now).as_secs_f64().min(end_s.max(0.0));
    let braked = if end_s > 0.0 { 1.0 - 0.5 * passed_s / end_s } else { 0.0 };
    Some(Extrapolated {
        x_m: from.0 + share * (to.0 - from.0),
        y_m: motion.value.y_m + motion.value.vy_m_s * passed_s * braked,
        altitude_m: from.1 + share * (to.1 - from.1),
        or_else_m: 0.0,
        burning_s: passed_s,
        landed_after_s: (path.age(now).as_secs_f64() >= total_s).then(|| end_s.max(0.0)),
        basis: Basis::Plan,
    })
}

#[cfg(test)]
mod tests;
