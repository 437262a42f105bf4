//! Where the vehicle probably is once it is no longer heard: a prediction, and marked as one.
//!
//! Under thrust along the last plan. Otherwise as `course` has it, from what was last known: the last motion, the drag
//! that the last second's acceleration shows, the wind, the height at which the motor was to be lit.
//!
//! The circle is meant to hold the vehicle nineteen times out of twenty. It grows with the time that nothing was heard: a
//! position, a speed and an acceleration that were not quite right add up to `s0 + sv t + sa t^2 / 2`. Where a burn
//! is expected it reaches as far as where the vehicle would be without one. It stops growing when the vehicle
//! must have come down.

use std::time::Duration;

use protocol::dialect::{TdChute, TdPhase};

use super::course::{Course, Expected};
use super::vehicle::{Vehicle, is_burning};

/// How wrong the last position may be, m: a satellite receiver's usual error.
const POSITION_ERROR_M: f64 = 1.5;
/// How wrong the last speed may be, m/s.
const SPEED_ERROR_M_S: f64 = 0.5;
/// How wrong the acceleration may be, m/s2: fins and thrust steer, and in which way is not known.
const STEERED_ERROR_M_S2: f64 = 2.0;
/// The same while the drag is about to change: between free fall and a fall at terminal speed.
const OPENING_ERROR_M_S2: f64 = 5.0;
/// The same while a motor of unknown thrust lifts it.
const LIFTED_ERROR_M_S2: f64 = 20.0;
/// In space a burn throws surplus thrust away sideways, and to which side is not told: this much, m/s2, for this long, s, and
/// the speed that it makes of it is kept.
const SWERVE_M_S2: f64 = 6.0;
const SWERVE_S: f64 = 1.0;
/// A landing comes later than predicted by no more than this share of the time to it, and this time, s.
const LATE_SHARE: f64 = 0.25;
const LATE_S: f64 = 2.0;

/// A predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reckoned {
    /// North of the pad, m.
    pub x_m: f64,
    /// East of the pad, m.
    pub y_m: f64,
    /// Altitude, m; never below the ground.
    pub altitude_m: f64,
    /// It is expected within this distance, m.
    pub error_m: f64,
    /// Time that nothing was heard.
    pub age: Duration,
    /// What it goes by.
    pub by: By,
}

/// What a prediction goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// The vehicle's own plan.
    Plan,
    /// The last acceleration under thrust.
    LastThrust,
    /// A fall with the drag that was last seen, and the burn that was planned at its end.
    FallThenBurn,
    /// A fall with the drag that was last seen.
    Fall,
    /// A fall of unknown drag: falling freely.
    FreeFall,
}

/// The predicted position of a vehicle in flight whose last position is stale; `None` while it is heard,
/// on the ground, and where nothing is known that it could begin from.
pub fn reckon(vehicle: &Vehicle, now: Duration) -> Option<Reckoned> {
    let motion = vehicle.best_motion()?;
    if !is_unheard(vehicle, now) {
        return None;
    }
    let phase = vehicle.phase()?.value;
    let on_plan = along_plan(vehicle, phase, now);
    // What stood on the pad says nothing of a flight that began elsewhere; only a boost begins there.
    let in_flight = vehicle.left_pad_at.is_some_and(|at| motion.received_at >= at);
    if !in_flight && phase != TdPhase::TD_PHASE_BOOST && on_plan.is_none() {
        return None;
    }
    let age = motion.age(now);
    let seconds = age.as_secs_f64();
    let expected = on_plan.unwrap_or_else(|| Course::of(vehicle, phase, &motion.value).after(seconds));
    let growing_s = match expected.landed_after_s {
        Some(landed_s) => seconds.min((1.0 + LATE_SHARE) * landed_s + LATE_S),
        None => seconds,
    };
    let wrong_m_s2 = acceleration_error_m_s2(vehicle, phase, expected.by);
    let swerved_m = if vehicle.in_space { swerve_m(expected.burning_s) } else { 0.0 };
    let grown_m = SPEED_ERROR_M_S * growing_s + 0.5 * wrong_m_s2 * growing_s * growing_s + swerved_m;
    Some(Reckoned {
        x_m: expected.x_m,
        y_m: expected.y_m,
        altitude_m: expected.altitude_m.max(0.0),
        error_m: POSITION_ERROR_M + grown_m + expected.or_else_m,
        age,
        by: expected.by,
    })
}

/// Whether it flies, and where was not heard of late.
pub fn is_unheard(vehicle: &Vehicle, now: Duration) -> bool {
    let in_silence = match vehicle.best_motion() {
        Some(motion) => motion.is_stale(now),
        None => vehicle.phase().is_some_and(|phase| phase.is_stale(now)),
    };
    vehicle.in_flight() && in_silence
}

fn acceleration_error_m_s2(vehicle: &Vehicle, phase: TdPhase, by: By) -> f64 {
    let chute = vehicle.descent.as_ref().map(|descent| descent.value.chute);
    match phase {
        TdPhase::TD_PHASE_BOOST => LIFTED_ERROR_M_S2,
        _ if by == By::FreeFall => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_COAST | TdPhase::TD_PHASE_DEPLOY => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_CHUTE if chute != Some(TdChute::TD_CHUTE_OPEN) => OPENING_ERROR_M_S2,
        _ => STEERED_ERROR_M_S2,
    }
}

fn swerve_m(burning_s: f64) -> f64 {
    let swerving_s = burning_s.min(SWERVE_S);
    SWERVE_M_S2 * swerving_s * (burning_s - 0.5 * swerving_s)
}

/// Under thrust, where the plan is by now. Its points are spread evenly over its time; what is across the
/// plane that it is drawn in comes to rest with it.
fn along_plan(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> Option<Expected> {
    let (path, prediction) = (vehicle.path.as_ref()?, vehicle.prediction?);
    let motion = vehicle.best_motion()?;
    let last = path.value.len().checked_sub(1)?;
    // The plan's whole time, as of its path: it was told apart from its end.
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
    Some(Expected {
        x_m: from.0 + share * (to.0 - from.0),
        y_m: motion.value.y_m + motion.value.vy_m_s * passed_s * braked,
        altitude_m: from.1 + share * (to.1 - from.1),
        or_else_m: 0.0,
        burning_s: passed_s,
        landed_after_s: (path.age(now).as_secs_f64() >= total_s).then(|| end_s.max(0.0)),
        by: By::Plan,
    })
}

#[cfg(test)]
mod tests;
