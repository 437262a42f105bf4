//! Predicts the position of the vehicle after the link is lost in flight.
//!
//! Under thrust the vehicle is assumed to follow its last plan. Otherwise [`LastMotion`]
//! extrapolates the last motion, with the drag estimated from the last second's acceleration, the
//! wind, and the planned ignition height.
//!
//! The error circle is meant to contain the vehicle in 19 of 20 cases. It grows with the time `t`
//! since the last position: errors of position, speed and acceleration add up to `s0 + sv t + sa
//! t^2 / 2`. If a burn is expected, the circle also reaches the position without a burn. It stops
//! growing once the vehicle must have landed.

use std::time::Duration;

use protocol::dialect::{TdHold, TdPhase};

use super::{Change, GRAVITY_M_S2, Motion, NorthEastUp, Spot, Vehicle, hangs_on_its_chute, is_burning};

/// Error of the last position, m: usual for a satellite receiver.
pub(super) const POSITION_ERROR_M: f64 = 1.5;
/// Error of the last speed, m/s.
const SPEED_ERROR_M_S: f64 = 0.5;
/// Error of the acceleration, m/s2: fins and thrust steer in an unknown direction.
const STEERED_ERROR_M_S2: f64 = 2.0;
/// The same while the drag changes: between free fall and terminal speed.
const OPENING_ERROR_M_S2: f64 = 5.0;
/// The same while a boost motor of unknown thrust burns.
const LIFTED_ERROR_M_S2: f64 = 20.0;
/// Surplus thrust of a burn is directed sideways, in an unknown direction: at most this
/// acceleration, m/s2, for this time, s. The resulting speed persists.
const SWERVE_M_S2: f64 = 6.0;
const SWERVE_S: f64 = 1.0;
/// A landing is at most this share of the predicted time, plus this time, s, later than predicted.
const LATE_SHARE: f64 = 0.25;
const LATE_S: f64 = 2.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedPosition {
    /// Position over the ground with the radius of the error circle.
    pub spot: Spot,
    /// Never below the ground.
    pub altitude_m: f64,
    /// Time since the last position.
    pub age: Duration,
    pub basis: Basis,
    /// It must have come down by now.
    pub is_down: bool,
}

/// The predicted position of a vehicle in flight whose last position is stale. `None` while the
/// telemetry arrives or the vehicle is on the ground, or if no position in flight is available.
pub fn predict_position(vehicle: &Vehicle, now: Duration) -> Option<PredictedPosition> {
    let motion = vehicle.best_motion()?;
    if !is_silent(vehicle, now) {
        return None;
    }
    let phase = vehicle.phase()?.value;
    let on_plan = along_plan(vehicle, phase, now);
    // A position on the pad is irrelevant to a flight from apogee; only a boost starts on the pad.
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
    let swerving_s = expected.burning_s.min(SWERVE_S);
    let swerved_m = SWERVE_M_S2 * swerving_s * (expected.burning_s - 0.5 * swerving_s);
    let grown_m = SPEED_ERROR_M_S * growing_s + 0.5 * wrong_m_s2 * growing_s * growing_s + swerved_m;
    let [north_m, east_m, altitude_m] = expected.place;
    Some(PredictedPosition {
        spot: Spot { north_m, east_m, error_m: POSITION_ERROR_M + grown_m + expected.or_else_m },
        altitude_m: altitude_m.max(0.0),
        age,
        basis: expected.basis,
        is_down: down_after_s.is_some_and(|down_s| seconds > down_s),
    })
}

/// How far apart the points of a course are, s, and the longest one.
const COURSE_STEP_S: f64 = 0.5;
const COURSE_LONGEST_S: f64 = 120.0;

/// Predicted times and positions, down to the ground as far as that can be predicted. On the way up
/// only to apogee: the fall is not reported yet. Empty under the ascent motor, whose thrust is not
/// reported, and under a parachute that still fills. After a loss of the link it begins at the last
/// report, so that the predicted touchdown does not move.
pub fn predicted_course(vehicle: &Vehicle, now: Duration) -> Vec<(Duration, NorthEastUp)> {
    let (Some(motion), Some(phase)) = (vehicle.best_motion(), vehicle.phase_now()) else { return Vec::new() };
    let from = if is_silent(vehicle, now) { motion.received_at } else { now };
    let has_left_pad = vehicle.left_pad_at.is_some_and(|at| motion.received_at >= at);
    let unpredictable = match phase {
        TdPhase::TD_PHASE_CHUTE => !is_carried(vehicle),
        _ => matches!(phase, TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_DEPLOY),
    };
    if !vehicle.in_flight() || !has_left_pad || unpredictable {
        return Vec::new();
    }
    let last = LastMotion::of(vehicle, phase, &motion.value);
    let age_s = motion.age(from).as_secs_f64();
    let mut course: Vec<(Duration, NorthEastUp)> = Vec::new();
    for step in 0..(COURSE_LONGEST_S / COURSE_STEP_S) as u32 {
        let ahead_s = f64::from(step) * COURSE_STEP_S;
        let planned = along_plan(vehicle, phase, from + Duration::from_secs_f64(ahead_s));
        let planned = planned.map(|at| (at.place, at.landed_after_s));
        let ([x_m, y_m, altitude_m], landed_after_s) = planned.unwrap_or_else(|| {
            let (place, landed_after_s, _) = last.follow(age_s + ahead_s);
            (place, landed_after_s)
        });
        let falls = course.last().is_some_and(|(_, before)| before[2] > altitude_m);
        if phase == TdPhase::TD_PHASE_COAST && falls {
            break;
        }
        let at_s = landed_after_s.map_or(ahead_s, |landed_s| (landed_s - age_s).clamp(0.0, ahead_s));
        course.push((from + Duration::from_secs_f64(at_s), [x_m, y_m, altitude_m.max(0.0)]));
        if landed_after_s.is_some() {
            break;
        }
    }
    course
}

/// For how long the vehicle may have been in the air: its countdown ran in the last telemetry, and
/// has reached zero since. A hold or an abort in the silence is not visible here.
pub fn may_have_left(vehicle: &Vehicle, now: Duration) -> Option<Duration> {
    let status = vehicle.status.as_ref().filter(|status| status.is_stale(now))?;
    let counted =
        status.value.phase == TdPhase::TD_PHASE_PAD_ARMED && status.value.hold == TdHold::TD_HOLD_NONE;
    let left_s = vehicle.countdown_s().filter(|left| counted && left.value > 0.0)?.value;
    // A later message may already report the flight.
    status.age(now).checked_sub(Duration::from_secs_f64(left_s)).filter(|_| vehicle.left_pad_at.is_none())
}

/// Whether the vehicle is in flight and its position is stale.
pub fn is_silent(vehicle: &Vehicle, now: Duration) -> bool {
    let in_silence = match vehicle.best_motion() {
        Some(motion) => motion.is_stale(now),
        None => vehicle.phase().is_some_and(|phase| phase.is_stale(now)),
    };
    vehicle.in_flight() && in_silence
}

/// Whether its canopy is open and carries it; on the ground it does not.
fn is_carried(vehicle: &Vehicle) -> bool {
    hangs_on_its_chute(vehicle) && vehicle.phase_now() == Some(TdPhase::TD_PHASE_CHUTE)
}

fn acceleration_error_m_s2(vehicle: &Vehicle, phase: TdPhase, basis: Basis) -> f64 {
    match phase {
        TdPhase::TD_PHASE_BOOST => LIFTED_ERROR_M_S2,
        _ if basis == Basis::FreeFall => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_COAST | TdPhase::TD_PHASE_DEPLOY => OPENING_ERROR_M_S2,
        TdPhase::TD_PHASE_CHUTE if !is_carried(vehicle) => OPENING_ERROR_M_S2,
        _ => STEERED_ERROR_M_S2,
    }
}

/// Under thrust, the present position on the plan. Its points are evenly spaced in time and give
/// north and height. The motion to the east is assumed to stop when the plan ends.
fn along_plan(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> Option<Extrapolated> {
    let (path, prediction) = (vehicle.path.as_ref()?, vehicle.prediction?);
    let motion = vehicle.best_motion()?;
    let last = path.value.len().checked_sub(1)?;
    // The duration of the plan, from the time of its path: path and time to go come in separate
    // messages.
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
    let east_m = motion.value.y_m + motion.value.vy_m_s * passed_s * braked;
    Some(Extrapolated {
        place: [from.0 + share * (to.0 - from.0), east_m, from.1 + share * (to.1 - from.1)],
        or_else_m: 0.0,
        burning_s: passed_s,
        landed_after_s: (path.age(now).as_secs_f64() >= total_s).then(|| end_s.max(0.0)),
        basis: Basis::Plan,
    })
}

// Extrapolates the last motion of the vehicle: falling with drag, braking, or accelerating under
// thrust.
//
// A fall has the drag `k V^2` against its motion through the air. `k` is chosen so that drag
// explains the difference between gravity and the last second's acceleration: at terminal speed the
// speed is constant, shortly after apogee the vehicle falls freely. Below the planned ignition
// height, a constant deceleration brings the vehicle to rest on the ground.

/// Below this airspeed, m/s, drag cannot be distinguished from noise.
const DRAG_SEEN_M_S: f64 = 8.0;
/// The largest plausible drag, 1/m: a terminal speed of 2 m/s, slower than under an open parachute.
const DRAG_MAX_PER_M: f64 = GRAVITY_M_S2 / 4.0;
/// Integration step, s: small against the fastest change, the 0.5 s in which a fall under a
/// parachute reaches its terminal speed.
const STEP_S: f64 = 0.02;
/// The longest extrapolation, s; a fall from any height that is flown takes less.
const LONGEST_S: f64 = 300.0;

/// What a predicted position is based on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// The vehicle's own plan.
    Plan,
    /// The last acceleration under thrust, continued.
    LastThrust,
    /// A fall with the last estimated drag, then the planned burn.
    FallThenBurn,
    /// A fall with the last estimated drag.
    Fall,
    /// Free fall, because the drag is unknown.
    FreeFall,
}

/// The expected state after some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extrapolated {
    pub(super) place: NorthEastUp,
    /// The distance from this position if the burn does not happen, m.
    pub(super) or_else_m: f64,
    /// How long the landing motor burns until then, s.
    pub(super) burning_s: f64,
    /// When it landed, s after the last position.
    pub(super) landed_after_s: Option<f64>,
    pub(super) basis: Basis,
}

/// The last reported motion and the forces on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct LastMotion {
    at_m: NorthEastUp,
    velocity_m_s: NorthEastUp,
    wind_m_s: NorthEastUp,
    forces: Forces,
}

#[derive(Debug, Clone, Copy)]
enum Forces {
    /// Gravity and drag, 1/m; below this height, m, a burn that ends on the ground.
    Air { drag_per_m: Option<f64>, burn_from_m: Option<f64> },
    /// The last acceleration, gravity included, m/s2, until the vertical speed is zero.
    Thrust { acceleration_m_s2: NorthEastUp },
    /// A burn without a measured acceleration: braked so that it ends on the ground.
    Brake,
}

impl LastMotion {
    /// Collects the last reports of the vehicle.
    pub(super) fn of(vehicle: &Vehicle, phase: TdPhase, motion: &Motion) -> Self {
        // An unknown position stays unknown; an unknown velocity is taken as zero.
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        let velocity_m_s = [motion.vx_m_s, motion.vy_m_s, motion.climb_m_s].map(finite);
        let descent = vehicle.descent().map(|descent| descent.value);
        let wind_m_s = descent
            .as_ref()
            .map_or([0.0; 3], |d| [f64::from(d.wind_x_m_s), f64::from(d.wind_y_m_s), 0.0])
            .map(finite);
        let change = vehicle.trend.mean_change();
        let thrust = matches!(phase, TdPhase::TD_PHASE_POWERED | TdPhase::TD_PHASE_BOOST);
        let forces = match change {
            Some(Change { acceleration_m_s2, .. }) if thrust => Forces::Thrust { acceleration_m_s2 },
            _ if is_burning(phase) => Forces::Brake,
            _ => {
                let chosen_m = descent.map(|d| f64::from(d.chosen_height_m));
                let burn_from_m = chosen_m.filter(|height_m| *height_m > 0.0 && vehicle.may_light());
                let drag_per_m = if is_carried(vehicle) {
                    canopy_drag_per_m(-velocity_m_s[2])
                } else {
                    change.and_then(|change| drag_per_m(&change, &wind_m_s))
                };
                Forces::Air { drag_per_m, burn_from_m }
            }
        };
        Self { at_m: [motion.x_m, motion.y_m, motion.altitude_m], velocity_m_s, wind_m_s, forces }
    }

    /// The expected state after this time, s.
    pub(super) fn after(&self, seconds: f64) -> Extrapolated {
        let (place, landed_after_s, burning_s) = self.follow(seconds);
        let (or_else_m, basis) = match self.forces {
            Forces::Thrust { .. } | Forces::Brake => (0.0, Basis::LastThrust),
            Forces::Air { burn_from_m: Some(_), drag_per_m } => {
                let without_burn = Self { forces: Forces::Air { drag_per_m, burn_from_m: None }, ..*self };
                let fallen = without_burn.follow(seconds).0;
                ((place[2].max(0.0) - fallen[2].max(0.0)).abs(), Basis::FallThenBurn)
            }
            Forces::Air { drag_per_m: Some(_), .. } => (0.0, Basis::Fall),
            Forces::Air { drag_per_m: None, .. } => (0.0, Basis::FreeFall),
        };
        Extrapolated { place, or_else_m, burning_s, landed_after_s, basis }
    }

    /// Position, time of landing, s, and burn time, s. Integrates with the midpoint rule: exact for
    /// free fall, second order for drag.
    fn follow(&self, seconds: f64) -> (NorthEastUp, Option<f64>, f64) {
        let (mut place, mut velocity) = (self.at_m, self.velocity_m_s);
        let mut braking = None;
        let (mut passed_s, mut burning_s) = (0.0, 0.0);
        let seconds = seconds.min(LONGEST_S);
        while passed_s < seconds {
            let step_s = STEP_S.min(seconds - passed_s);
            let start = self.acceleration_m_s2_at(&place, &velocity, &mut braking);
            let halfway = std::array::from_fn(|axis| velocity[axis] + 0.5 * start[axis] * step_s);
            let acceleration = self.acceleration_m_s2_at(&place, &halfway, &mut braking);
            for axis in 0..3 {
                place[axis] += (velocity[axis] + 0.5 * acceleration[axis] * step_s) * step_s;
                velocity[axis] += acceleration[axis] * step_s;
            }
            passed_s += step_s;
            let burns = !matches!(self.forces, Forces::Air { .. }) || braking.is_some();
            burning_s += if burns { step_s } else { 0.0 };
            // Braked to rest, close to the ground as far as the last values were right; or on the
            // ground.
            let is_down = burns && velocity[2] >= 0.0 && self.velocity_m_s[2] < 0.0;
            if is_down || place[2] <= 0.0 {
                return (place, Some(passed_s), burning_s);
            }
        }
        (place, None, burning_s)
    }

    fn acceleration_m_s2_at(
        &self,
        place: &NorthEastUp,
        velocity: &NorthEastUp,
        braking: &mut Option<NorthEastUp>,
    ) -> NorthEastUp {
        let is_ignited = |from_m: f64| place[2] <= from_m && velocity[2] < 0.0;
        match self.forces {
            Forces::Thrust { acceleration_m_s2 } => acceleration_m_s2,
            Forces::Air { drag_per_m, burn_from_m }
                if braking.is_none() && !burn_from_m.is_some_and(is_ignited) =>
            {
                let through_air = std::array::from_fn(|axis| velocity[axis] - self.wind_m_s[axis]);
                let resistance = drag_per_m.unwrap_or(0.0) * size(&through_air);
                let [north, east, up] = through_air.map(|part: f64| -resistance * part);
                [north, east, up - GRAVITY_M_S2]
            }
            _ => *braking.get_or_insert_with(|| deceleration_to_rest_m_s2(place, velocity)),
        }
    }
}

/// The drag that explains the difference between acceleration and gravity, 1/m; `None` if the
/// airspeed is too low to estimate it.
fn drag_per_m(change: &Change, wind: &NorthEastUp) -> Option<f64> {
    let through_air: NorthEastUp = std::array::from_fn(|axis| change.velocity_m_s[axis] - wind[axis]);
    let speed = size(&through_air);
    if speed < DRAG_SEEN_M_S {
        return None;
    }
    let [north, east, up] = change.acceleration_m_s2;
    let specific_force = [north, east, up + GRAVITY_M_S2];
    let against: f64 = specific_force.iter().zip(&through_air).map(|(force, through)| -force * through).sum();
    let drag = against / (speed * speed * speed);
    drag.is_finite().then(|| drag.clamp(0.0, DRAG_MAX_PER_M))
}

/// The drag with which a canopy carries the weight at this sink, 1/m: it is slower than drag is
/// seen at. `None` without sink.
fn canopy_drag_per_m(sinks_m_s: f64) -> Option<f64> {
    (sinks_m_s > 0.0).then(|| (GRAVITY_M_S2 / (sinks_m_s * sinks_m_s)).min(DRAG_MAX_PER_M))
}

/// The constant deceleration that ends at rest on the ground, m/s2.
fn deceleration_to_rest_m_s2(place: &NorthEastUp, velocity: &NorthEastUp) -> NorthEastUp {
    let down_m_s = -velocity[2];
    if place[2] <= 0.0 || down_m_s <= 0.0 {
        return [0.0; 3];
    }
    let takes_s = 2.0 * place[2] / down_m_s;
    velocity.map(|part| -part / takes_s)
}

fn size(vector: &NorthEastUp) -> f64 {
    libm::hypot(libm::hypot(vector[0], vector[1]), vector[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use protocol::dialect::{MavMessage, TD_DESCENT_DATA, TD_FLIGHT_STATUS_DATA, TdChute, TdLimit};

    use crate::model::{GRAVITY_M_S2, Heartbeat, Motion, Prediction, Sample, Touchdown};

    const SEEN: Duration = Duration::from_secs(100);

    fn after(vehicle: &Vehicle, seconds: f64) -> PredictedPosition {
        predict_position(vehicle, SEEN + Duration::from_secs_f64(seconds)).unwrap()
    }

    /// A vehicle in this phase at 100 m altitude and 1 m north, with this velocity, m/s, and mean
    /// acceleration over the last second, m/s2.
    fn moving(phase: TdPhase, velocity: [f64; 3], acceleration: Option<[f64; 3]>) -> Vehicle {
        let [vx_m_s, vy_m_s, climb_m_s] = velocity;
        let motion = Motion { x_m: 1.0, y_m: 0.0, vx_m_s, vy_m_s, ..Motion::vertical(100.0, climb_m_s) };
        let heartbeat = Heartbeat { armed: true, phase: Some(phase), terminated: false };
        let mut vehicle = Vehicle {
            heartbeat: Some(Sample::new(heartbeat, SEEN)),
            motion: Some(Sample::new(motion, SEEN)),
            left_pad_at: Some(SEEN),
            ..Vehicle::default()
        };
        if let Some([north, east, up]) = acceleration {
            let before =
                Motion { vx_m_s: vx_m_s - north, vy_m_s: vy_m_s - east, climb_m_s: climb_m_s - up, ..motion };
            vehicle.trend.note(1_000, &before, Some(phase));
            vehicle.trend.note(2_000, &motion, Some(phase));
        }
        vehicle
    }

    fn falling_freely() -> Vehicle {
        moving(TdPhase::TD_PHASE_COAST, [2.0, 0.0, -20.0], Some([0.0, 0.0, -GRAVITY_M_S2]))
    }

    #[test]
    fn no_prediction_while_telemetry_arrives_or_after_landing() {
        assert_eq!(predict_position(&falling_freely(), SEEN + Duration::from_secs(1)), None);
        let landed = moving(TdPhase::TD_PHASE_TOUCHDOWN, [0.0; 3], None);
        assert_eq!(predict_position(&landed, SEEN + Duration::from_secs(9)), None);
    }

    /// Free fall by hand: 100 - 20 t - 9.80665 t^2 / 2 at t = 2 s is 40.3867 m.
    #[test]
    fn val_free_fall_without_drag_and_never_below_the_ground() {
        for vehicle in [falling_freely(), moving(TdPhase::TD_PHASE_COAST, [2.0, 0.0, -20.0], None)] {
            let found = after(&vehicle, 2.0);
            assert!(
                (found.altitude_m - 40.3867).abs() < 1e-9 && (found.spot.north_m - 5.0).abs() < 1e-9,
                "{found:?}"
            );
            assert_eq!(after(&vehicle, 60.0).altitude_m.to_bits(), 0);
        }
        assert_eq!(after(&falling_freely(), 2.0).basis, Basis::Fall);
        assert_eq!(after(&moving(TdPhase::TD_PHASE_COAST, [0.0; 3], None), 2.0).basis, Basis::FreeFall);
    }

    /// A fall from rest with terminal speed V: `V^2/g ln cosh(g t / V)`; here 40 m/s, with the link
    /// lost after 3 s. The last second shows the mean of a growing drag, which costs at most 0.5 %
    /// of the distance.
    #[test]
    fn val_a_fall_with_drag_follows_its_closed_form() {
        let (terminal_m_s, seen_s) = (40.0, 3.0);
        let speed_m_s = |t: f64| terminal_m_s * libm::tanh(GRAVITY_M_S2 * t / terminal_m_s);
        let fallen_m = |t: f64| {
            terminal_m_s * terminal_m_s / GRAVITY_M_S2
                * libm::log(libm::cosh(GRAVITY_M_S2 * t / terminal_m_s))
        };
        let now_m_s = speed_m_s(seen_s);
        let pull = speed_m_s(seen_s - 1.0) - now_m_s;
        let vehicle = moving(TdPhase::TD_PHASE_AERO_DESCENT, [0.0, 0.0, -now_m_s], Some([0.0, 0.0, pull]));
        for passed_s in [1.6, 2.5] {
            let way_m = fallen_m(seen_s + passed_s) - fallen_m(seen_s);
            let expected_m = 100.0 - way_m;
            let found = after(&vehicle, passed_s);
            assert!(
                (found.altitude_m - expected_m).abs() < 0.005 * way_m,
                "{} is not {expected_m}",
                found.altitude_m
            );
        }
    }

    /// The plan is followed only under thrust.
    #[test]
    fn under_thrust_it_follows_the_plan_and_stays_at_its_end() {
        let mut vehicle = moving(TdPhase::TD_PHASE_POWERED, [2.0, 1.0, -10.0], None);
        let touchdown = Touchdown {
            distance_m: 0.0,
            height_m: 0.0,
            vertical_m_s: 0.0,
            lateral_m_s: 0.0,
            tilt_rad: 0.0,
            rate_rad_s: 0.0,
            violated: TdLimit::empty(),
        };
        vehicle.prediction = Some(Sample::new(Prediction { time_to_go_s: 4.0, touchdown }, SEEN));
        vehicle.path = Some(Sample::new(vec![(4.0, 40.0), (2.0, 10.0), (0.0, 0.0)], SEEN));
        assert_eq!(after(&vehicle, 3.0).basis, Basis::Plan);
        assert!((after(&vehicle, 3.0).altitude_m - 5.0).abs() < 1e-9);
        assert!((after(&vehicle, 3.0).spot.north_m - 1.0).abs() < 1e-9);
        assert!(after(&vehicle, 9.0).altitude_m.abs() < 1e-9);
        // The motion east at 1 m/s stops when the plan ends: 2 m in 4 s.
        assert!((after(&vehicle, 9.0).spot.east_m - 2.0).abs() < 1e-9);
        assert!(after(&vehicle, 2.0).spot.error_m < after(&vehicle, 3.0).spot.error_m);
        assert!(after(&vehicle, 3.0).spot.error_m < after(&vehicle, 9.0).spot.error_m);
        // The path arrived one second before the time to go, so the vehicle is one second further
        // along.
        let sooner = Duration::from_secs(99);
        vehicle.path = Some(Sample::new(vec![(4.0, 40.0), (2.0, 10.0), (0.0, 0.0)], sooner));
        assert!((after(&vehicle, 1.6).altitude_m - (10.0 - 0.04 * 10.0)).abs() < 1e-9);
        let coasting =
            Heartbeat { armed: true, phase: Some(TdPhase::TD_PHASE_AERO_DESCENT), terminated: false };
        vehicle.heartbeat = Some(Sample::new(coasting, SEEN));
        assert_eq!(after(&vehicle, 3.0).basis, Basis::FreeFall);
    }

    #[test]
    fn under_thrust_without_a_plan_the_last_acceleration_continues() {
        let vehicle = moving(TdPhase::TD_PHASE_POWERED, [0.0, 2.0, -20.0], Some([0.0, -0.5, 3.0]));
        let found = after(&vehicle, 2.0);
        assert_eq!(found.basis, Basis::LastThrust);
        assert!(
            (found.altitude_m - 66.0).abs() < 1e-9 && (found.spot.east_m - 3.0).abs() < 1e-9,
            "{found:?}"
        );
    }

    /// At terminal speed, with ignition planned at 50 m: from there, 40 m/s are braked to zero in
    /// 2.5 s.
    #[test]
    fn the_planned_burn_brakes_and_the_circle_covers_a_fall_without_it() {
        let mut vehicle = moving(TdPhase::TD_PHASE_LAND_ARMED, [0.0, 0.0, -40.0], Some([0.0; 3]));
        let descent = TD_DESCENT_DATA { chosen_height_m: 50.0, ..TD_DESCENT_DATA::default() };
        vehicle.store(&MavMessage::TD_DESCENT(descent), SEEN);
        let phase = TdPhase::TD_PHASE_LAND_ARMED;
        let mut status = TD_FLIGHT_STATUS_DATA { phase, ..TD_FLIGHT_STATUS_DATA::default() };
        status.interlocks = protocol::dialect::TdInterlock::TD_INTERLOCK_ARMED;
        vehicle.status = Some(Sample::new(status.clone(), SEEN));
        // 1.25 s to the burn, then 1.25 s of it: half the speed and a quarter of the height remain.
        let found = after(&vehicle, 2.5);
        assert_eq!(found.basis, Basis::FallThenBurn);
        assert!((found.altitude_m - 12.5).abs() < 0.5, "{found:?}");
        assert!(found.spot.error_m > found.altitude_m, "unlit it is on the ground by now");
        assert!(after(&vehicle, 30.0).altitude_m < 0.5);
        // With an inhibited motor it keeps falling.
        status.interlocks |= protocol::dialect::TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
        vehicle.status = Some(Sample::new(status, SEEN));
        assert_eq!(after(&vehicle, 2.5).basis, Basis::Fall);
        assert_eq!(after(&vehicle, 2.6).altitude_m.to_bits(), 0);
    }

    /// A vehicle under its canopy, in this wind to the north, m/s.
    fn carried(sinks_m_s: f64, wind_x_m_s: f32) -> Vehicle {
        let phase = TdPhase::TD_PHASE_CHUTE;
        let mut vehicle = moving(phase, [f64::from(wind_x_m_s), 0.0, -sinks_m_s], Some([0.0; 3]));
        let chute = TdChute::TD_CHUTE_OPEN;
        let descent =
            TD_DESCENT_DATA { chute, wind_x_m_s, chosen_height_m: f32::NAN, ..TD_DESCENT_DATA::default() };
        vehicle.store(&MavMessage::TD_DESCENT(descent), SEEN);
        vehicle
    }

    /// It sinks as it does and drifts with the wind: 100 m at 6 m/s take 16.7 s, at 7 m/s 14.3 s.
    #[test]
    fn val_under_its_canopy_the_sink_is_constant_and_it_drifts_with_the_wind() {
        for (sinks_m_s, wind_m_s) in [(6.0, 5.0_f32), (7.0, -3.0)] {
            let course = predicted_course(&carried(sinks_m_s, wind_m_s), SEEN);
            let (lands_at, [north_m, ..]) = *course.last().expect("a course to the ground");
            let lands_s = lands_at.saturating_sub(SEEN).as_secs_f64();
            assert!((lands_s - 100.0 / sinks_m_s).abs() < 0.5, "{lands_s} s");
            assert!((north_m - 1.0 - f64::from(wind_m_s) * lands_s).abs() < 1.0, "{north_m} m");
        }
    }

    /// Until the canopy carries it, the time of landing is unpredictable.
    #[test]
    fn no_course_is_predicted_before_the_canopy_carries_it() {
        let mut vehicle = carried(30.0, 0.0);
        let fired = TD_DESCENT_DATA { chute: TdChute::TD_CHUTE_FIRED, ..TD_DESCENT_DATA::default() };
        vehicle.store(&MavMessage::TD_DESCENT(fired), SEEN);
        assert_eq!(predicted_course(&vehicle, SEEN), []);
    }

    proptest! {
        /// At terminal speed the forces balance: the speed is kept, whatever the speed and the
        /// wind.
        #[test]
        fn at_terminal_speed_the_speed_is_constant(
            down_m_s in 8.5..60.0_f64,
            wind in prop::array::uniform2(-8.0..8.0_f64),
            seconds in 1.6..3.0_f64,
        ) {
            let mut vehicle =
                moving(TdPhase::TD_PHASE_AERO_DESCENT, [wind[0], wind[1], -down_m_s], Some([0.0; 3]));
            let [wind_x_m_s, wind_y_m_s] = wind.map(|part| part as f32);
            let descent =
                TD_DESCENT_DATA { wind_x_m_s, wind_y_m_s, chosen_height_m: f32::NAN, ..TD_DESCENT_DATA::default() };
            vehicle.store(&MavMessage::TD_DESCENT(descent), SEEN);
            let found = after(&vehicle, seconds);
            let expected_m = (100.0 - down_m_s * seconds).max(0.0);
            prop_assert!((found.altitude_m - expected_m).abs() < 1e-3, "{found:?}");
            if expected_m > 0.0 {
                prop_assert!((found.spot.north_m - 1.0 - wind[0] * seconds).abs() < 1e-3);
                prop_assert!((found.spot.east_m - wind[1] * seconds).abs() < 1e-3);
            }
        }

        /// Whatever was last received, the prediction is finite if the last position was, and the
        /// circle never shrinks.
        #[test]
        fn any_last_report_gives_a_finite_position_and_a_growing_circle(
            phase in 3_u32..13,
            velocity in prop::array::uniform3(-1e3..1e3_f64),
            acceleration in prop::option::of(prop::array::uniform3(-1e3..1e3_f64)),
            chosen_height_m in prop_oneof![Just(f32::NAN), -1e3_f32..1e3],
            seconds in 1.6..500.0_f64,
        ) {
            let phase = crate::model::telemetry::phase_from_number(phase).unwrap();
            let mut vehicle = moving(phase, velocity, acceleration);
            let descent = TD_DESCENT_DATA { chosen_height_m, ..TD_DESCENT_DATA::default() };
            vehicle.store(&MavMessage::TD_DESCENT(descent), SEEN);
            let at = |seconds: f64| predict_position(&vehicle, SEEN + Duration::from_secs_f64(seconds));
            if let (Some(sooner), Some(later)) = (at(seconds), at(seconds + 0.5)) {
                prop_assert!(later.spot.north_m.is_finite() && later.spot.east_m.is_finite() && later.altitude_m.is_finite());
                prop_assert!(sooner.altitude_m >= 0.0 && sooner.spot.error_m > 0.0);
                prop_assert!(later.spot.error_m >= sooner.spot.error_m || later.basis == Basis::FallThenBurn);
            }
        }
    }
}
