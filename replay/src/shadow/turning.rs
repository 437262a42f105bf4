//! Holds the turning of the vehicle against the command of its gimbal.
//!
//! A gimbal at the angle `d` turns the vehicle by `-T l d / J`: the thrust, its arm, the pitch inertia. Over the eighth of a second
//! between two attitudes the change of the rate gives the mean angle that has acted. A gimbal that follows is at its command
//! after 50 ms (20 ms of delay, and 7 degrees at 250 degrees a second). So if, after a message whose command and angle are
//! more than 5 degrees apart, the vehicle turns as it does with that angle and not as with that command, the gimbal does not
//! follow. It is found an eighth of a second after that message, where [`super::following`] needs the next one.
//!
//! 0.13 % of the messages of a nominal burn have such a gap (0.4 s after the light and above 1 m), and the angle that has acted is then as near to the
//! measured one as is asked for with a probability of at most a third: less than one false flag in 100 flights.

use super::heard::Attitude;

/// Command and angle are apart, degrees.
const APART_DEG: f64 = 5.0;
/// The angle that has acted is this near to the measured one: a share of what they are apart.
const NEAR_SHARE: f64 = 0.25;
/// The message is as old as this at most when the turning begins, s.
const FRESH_S: f64 = 0.13;
/// Attitudes closer together than this do not show an acceleration, s.
const SHORTEST_S: f64 = 0.06;

/// Angles of one axis, degrees, in a message of the gimbal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub(super) commanded_deg: f64,
    pub(super) measured_deg: f64,
}

/// The turning does not belong to the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NotTurned {
    /// 0 pitch, 1 yaw.
    pub(super) axis: usize,
    /// Mean angle that has acted, degrees.
    pub(super) acted_deg: f64,
    pub(super) commanded_deg: f64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct TurningWatch {
    told: Option<(f64, [Axis; 2])>,
    flagged: bool,
}

impl TurningWatch {
    /// Takes a message of the gimbal at the vehicle's time, s.
    pub(super) fn on_gimbal(&mut self, time_s: f64, axes: [Axis; 2]) {
        self.told = Some((time_s, axes));
    }

    /// Takes two attitudes in a row and the angular acceleration, rad/s^2, that a radian of the gimbal makes.
    pub(super) fn on_attitude(
        &mut self,
        before: &Attitude,
        now: &Attitude,
        turning_rad_s2: f64,
    ) -> Option<NotTurned> {
        let (told_s, axes) = self.told?;
        let interval_s = now.time_s - before.time_s;
        let fresh = before.time_s >= told_s - 0.03 && before.time_s <= told_s + FRESH_S;
        if self.flagged || !fresh || interval_s < SHORTEST_S || turning_rad_s2 <= 0.0 {
            return None;
        }
        let accelerations = (now.rate_rad_s - before.rate_rad_s) / interval_s;
        let found = axes.iter().enumerate().find_map(|(axis, told)| {
            let acted_deg = -(accelerations[axis + 1] / turning_rad_s2).to_degrees();
            let apart_deg = (told.commanded_deg - told.measured_deg).abs();
            let as_measured = (acted_deg - told.measured_deg).abs() < NEAR_SHARE * apart_deg;
            (apart_deg > APART_DEG && as_measured).then_some(NotTurned {
                axis,
                acted_deg,
                commanded_deg: told.commanded_deg,
            })
        });
        self.flagged = found.is_some();
        found
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    fn turning(time_s: f64, pitch_rad_s: f64) -> Attitude {
        Attitude {
            time_s,
            ned_from_body: UnitQuaternion::identity(),
            rate_rad_s: Vector3::new(0.0, pitch_rad_s, 0.0),
        }
    }

    /// 3 degrees at 200 rad/s^2 for a radian turn by -1.31 rad/s in 0.125 s; -7 degrees by 3.05 rad/s.
    #[test]
    fn a_vehicle_that_turns_as_the_stuck_gimbal_does_is_found_and_one_that_obeys_is_not() {
        let axes =
            [Axis { commanded_deg: -7.0, measured_deg: 3.0 }, Axis { commanded_deg: 0.0, measured_deg: 0.0 }];
        let after = |pitch_rad_s: f64| {
            let mut watch = TurningWatch::default();
            watch.on_gimbal(10.0, axes);
            watch.on_attitude(&turning(10.01, 0.0), &turning(10.135, pitch_rad_s), 200.0)
        };
        assert!(after(-1.31).is_some_and(|found| found.axis == 0 && (found.acted_deg - 3.0).abs() < 0.01));
        assert_eq!(after(3.05), None);
    }
}
