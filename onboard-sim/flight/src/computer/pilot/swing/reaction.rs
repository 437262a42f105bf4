//! A body that reacts to its gimbal, for tests.

use super::Swing;
use crate::computer::pad_check::SURFACES;
use crate::control::servo::ServoModel;
use crate::vehicle::mission::Mission;

pub(in crate::computer::pilot) struct Reaction {
    swing: Swing,
    servos: [ServoModel; SURFACES],
    /// Share of each command that the motor follows, pitch and yaw.
    pub(in crate::computer::pilot) shares: [f64; 2],
}

impl Reaction {
    pub(in crate::computer::pilot) fn of(mission: &Mission, swing: Swing) -> Self {
        let servos = ServoModel::of_each(&mission.airframe, [0.0; SURFACES]);
        Self { swing, servos, shares: [1.0; 2] }
    }

    /// Cross rates measured in a frame, rad/s, after the commands of the last one, rad.
    pub(in crate::computer::pilot) fn sensed_rad_s(&mut self, command_rad: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis: usize| {
            let servo = &mut self.servos[axis];
            let before_rad = servo.at_rad;
            servo.take(command_rad[axis]);
            servo.advance();
            let turned = (servo.at_rad - before_rad) / self.swing.limit_rad;
            -self.swing.leg_rad_s * turned * self.shares[axis]
        })
    }
}
