//! Where the vehicle probably is once it is no longer heard: a prediction, and marked as one.
//!
//! Along the last plan if there was one, else falling freely from the last known motion. The uncertainty
//! grows with the time that nothing was heard: a position, a speed and an acceleration that were not
//! quite right add up to `s0 + sv t + sa t^2 / 2`.

use std::time::Duration;

use super::vehicle::Vehicle;

/// Standard gravity, m/s2 (CGPM 1901).
const GRAVITY_M_S2: f64 = 9.806_65;
/// How wrong the last position may be, m: a satellite receiver's usual error.
const POSITION_ERROR_M: f64 = 1.5;
/// How wrong the last speed may be, m/s.
const SPEED_ERROR_M_S: f64 = 0.5;
/// How wrong the acceleration may be, m/s2: a tenth of the thrust-to-mass ratio of a 3 kg vehicle under 60 N.
const ACCELERATION_ERROR_M_S2: f64 = 2.0;

/// A predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reckoned {
    /// Horizontal position in the pitch plane, m.
    pub x_m: f64,
    /// Altitude, m; never below the ground.
    pub altitude_m: f64,
    /// It is expected within this distance, m.
    pub error_m: f64,
    /// Time that nothing was heard.
    pub age: Duration,
    /// Along the vehicle's own plan; else falling freely.
    pub by_plan: bool,
}

/// The predicted position of a vehicle in flight whose last position is stale; `None` while it is heard,
/// on the ground, and where it was never seen.
pub fn reckon(vehicle: &Vehicle, now: Duration) -> Option<Reckoned> {
    let motion = vehicle.best_motion()?;
    if !vehicle.in_flight() || !motion.is_stale(now) {
        return None;
    }
    let age = motion.age(now);
    let seconds = age.as_secs_f64();
    let error_m =
        POSITION_ERROR_M + SPEED_ERROR_M_S * seconds + 0.5 * ACCELERATION_ERROR_M_S2 * seconds * seconds;
    if let Some((x_m, altitude_m)) = along_plan(vehicle, now) {
        return Some(Reckoned { x_m, altitude_m, error_m, age, by_plan: true });
    }
    let from = motion.value;
    let fallen = from.altitude_m + from.climb_m_s * seconds - 0.5 * GRAVITY_M_S2 * seconds * seconds;
    let x_m = from.x_m + from.vx_m_s * seconds;
    Some(Reckoned { x_m, altitude_m: fallen.max(0.0), error_m, age, by_plan: false })
}

/// The plan's points are spread evenly over its time.
fn along_plan(vehicle: &Vehicle, now: Duration) -> Option<(f64, f64)> {
    let (path, prediction) = (vehicle.path.as_ref()?, vehicle.prediction?);
    let total_s = prediction.value.time_to_go_s;
    let last = path.value.len().checked_sub(1)?;
    if total_s.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let place = (path.age(now).as_secs_f64() / total_s).min(1.0) * last as f64;
    let before = (place.floor() as usize).min(last);
    let (from, to) = (path.value[before], path.value[(before + 1).min(last)]);
    let share = place - before as f64;
    Some((from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Touchdown;
    use crate::model::motion::Motion;
    use crate::model::vehicle::{Heartbeat, Prediction, Sample};
    use protocol::dialect::{TdLimit, TdPhase};

    const SEEN: Duration = Duration::from_secs(100);

    fn falling() -> Vehicle {
        Vehicle {
            heartbeat: Some(Sample::new(
                Heartbeat { armed: true, phase: Some(TdPhase::TD_PHASE_POWERED), terminated: false },
                SEEN,
            )),
            motion: Some(Sample::new(
                Motion { x_m: 1.0, y_m: 0.0, altitude_m: 100.0, vx_m_s: 2.0, vy_m_s: 0.0, climb_m_s: -10.0 },
                SEEN,
            )),
            ..Vehicle::default()
        }
    }

    #[test]
    fn what_is_heard_is_not_predicted() {
        assert_eq!(reckon(&falling(), SEEN + Duration::from_secs(1)), None);
        let mut landed = falling();
        landed.heartbeat = landed.heartbeat.map(|heartbeat| {
            let value = Heartbeat { phase: Some(TdPhase::TD_PHASE_TOUCHDOWN), ..heartbeat.value };
            Sample { value, ..heartbeat }
        });
        assert_eq!(reckon(&landed, SEEN + Duration::from_secs(9)), None);
    }

    /// Free fall by hand: 100 - 10 t - 9.80665 t^2 / 2 at t = 2 s is 60.3867 m.
    #[test]
    fn val_free_fall_without_a_plan_and_never_below_the_ground() {
        let found = reckon(&falling(), SEEN + Duration::from_secs(2)).unwrap();
        assert!((found.altitude_m - 60.3867).abs() < 1e-9 && (found.x_m - 5.0).abs() < 1e-12);
        assert!(!found.by_plan);
        assert_eq!(reckon(&falling(), SEEN + Duration::from_mins(1)).unwrap().altitude_m.to_bits(), 0);
    }

    #[test]
    fn with_a_plan_it_follows_the_plan_and_waits_at_its_end() {
        let mut vehicle = falling();
        let touchdown = Touchdown {
            x_m: 0.0,
            altitude_m: 0.0,
            pitch_rad: 1.57,
            u_m_s: 0.0,
            w_m_s: 0.0,
            q_rad_s: 0.0,
            violated: TdLimit::empty(),
        };
        vehicle.prediction = Some(Sample::new(Prediction { time_to_go_s: 4.0, touchdown }, SEEN));
        vehicle.path = Some(Sample::new(vec![(4.0, 40.0), (2.0, 10.0), (0.0, 0.0)], SEEN));
        let at = |s| reckon(&vehicle, SEEN + Duration::from_secs(s)).unwrap();
        assert!(at(3).by_plan);
        assert!((at(3).altitude_m - 5.0).abs() < 1e-9 && (at(3).x_m - 1.0).abs() < 1e-9);
        assert!(at(9).altitude_m.abs() < 1e-9);
        assert!(at(2).error_m < at(3).error_m && at(3).error_m < at(9).error_m);
    }
}
