//! Changes the vehicle or the weather in the middle of a flight.

use flight::vehicle::airframe::{Airframe, Servo as ServoData};
use flight::vehicle::rigid::RigidState;
use flight::vehicle::thrust_curve::ThrustCurve;

use super::build::check_state;
use super::{World, WorldError};
use crate::servo::Servo;
use crate::truth::Truth;

impl World {
    /// The same moment of the same flight, with another airframe, motor or truth from now on.
    ///
    /// State, time, servo angles, past commands and faults stay. The gusts continue with the new strength, and a
    /// burning motor continues on the new curve at the same time. If nothing changes, the flight continues with the
    /// same bits.
    ///
    /// # Errors
    /// As [`World::new`].
    pub fn changed(
        &self,
        airframe: &Airframe,
        motor: &ThrustCurve,
        truth: &Truth,
    ) -> Result<Self, WorldError> {
        let other = Self::new(airframe, motor, truth, &self.state, 0)?;
        let servo = |here: &Servo, before: &ServoData, after: &Servo| here.changed(before, after);
        let gimbal_data = &self.airframe.gimbal.servo;
        let fin_data = &self.airframe.fins.servo;
        Ok(Self {
            motor: self.motor.changed(&other.motor, &self.truth),
            gimbal: core::array::from_fn(|axis| servo(&self.gimbal[axis], gimbal_data, &other.gimbal[axis])),
            fins: core::array::from_fn(|fin| servo(&self.fins[fin], fin_data, &other.fins[fin])),
            gimbal_links: core::array::from_fn(|axis| {
                self.gimbal_links[axis].changed(&other.gimbal_links[axis])
            }),
            fin_links: core::array::from_fn(|fin| self.fin_links[fin].changed(&other.fin_links[fin])),
            parachute: self.parachute.clone(),
            wind: self.wind.changed(&other.wind),
            steps: self.steps,
            mass: if *airframe == self.airframe && *truth == self.truth { self.mass } else { other.mass },
            specific_force_m_s2: self.specific_force_m_s2,
            angular_acceleration_rad_s2: self.angular_acceleration_rad_s2,
            touchdown: self.touchdown,
            rest: self.rest,
            stack: self.stack.clone(),
            separated_s: self.separated_s,
            hanging: self.hanging,
            ..other
        })
    }

    /// The same moment of the same flight with the vehicle at another position, attitude or motion; all else continues.
    ///
    /// # Errors
    /// The state is not finite, or its attitude is not a rotation.
    pub fn placed(&self, state: &RigidState) -> Result<Self, WorldError> {
        check_state(state)?;
        Ok(Self { state: *state, ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use vehicles::motors;

    use super::*;
    use crate::{Actuators, Fault};

    const IGNITED: Actuators =
        Actuators { gimbal_rad: [0.02, -0.01], fins_rad: [0.4; 4], ignite: true, ..Actuators::NONE };

    fn airframe() -> Airframe {
        vehicles::airframe::builtin("mk2").unwrap()
    }

    /// Half a second into its burn, with a weakened motor and a slow gimbal, in wind.
    fn burning() -> World {
        let airframe = airframe();
        let motor = motors::builtin(&airframe.motor).unwrap();
        let truth = Truth { wind_m_s: 4.0, impulse_scale: 1.03, ..Truth::default() };
        let mut world = World::new(&airframe, &motor, &truth, &RigidState::upright(80.0), 7).unwrap();
        world.inject(&Fault::WeakMotor { scale: 0.9 });
        world.inject(&Fault::LateLight { delay_s: 0.05 });
        world.inject(&Fault::GimbalSlow { scale: 0.3 });
        world.advance(&IGNITED, 700);
        world
    }

    #[test]
    fn without_a_change_the_flight_continues_bit_for_bit() {
        let mut world = burning();
        let motor = motors::builtin(&world.airframe().motor).unwrap();
        let mut same = world.changed(world.airframe(), &motor, world.truth()).unwrap();
        assert_eq!(same.thrust_n().to_bits(), world.thrust_n().to_bits());
        for _ in 0..300 {
            world.step(&IGNITED);
            same.step(&IGNITED);
            assert_eq!(format!("{:?}", same.state()), format!("{:?}", world.state()));
        }
        assert_eq!(same.time_s().to_bits(), world.time_s().to_bits());
    }

    #[test]
    fn a_moved_vehicle_keeps_everything_but_its_state() {
        let mut world = burning();
        let mut same = world.placed(world.state()).unwrap();
        let mut there = *world.state();
        there.position_m.x += 3.0;
        let mut moved = world.placed(&there).unwrap();
        for _ in 0..300 {
            world.step(&IGNITED);
            same.step(&IGNITED);
            moved.step(&IGNITED);
        }
        assert_eq!(format!("{:?}", same.state()), format!("{:?}", world.state()));
        assert!((moved.state().position_m.x - world.state().position_m.x - 3.0).abs() < 1e-9);
        assert!((moved.state().velocity_m_s - world.state().velocity_m_s).norm() < 1e-9);
        there.velocity_m_s.y = f64::NAN;
        assert!(matches!(world.placed(&there), Err(WorldError::State(_))));
    }

    #[test]
    fn another_motor_and_another_wind_act_at_once() {
        let world = burning();
        let motor = motors::builtin(&world.airframe().motor).unwrap();
        let weaker = Truth { impulse_scale: 0.5 * world.truth().impulse_scale, ..*world.truth() };
        let changed = world.changed(world.airframe(), &motor, &weaker).unwrap();
        assert_eq!(changed.state(), world.state());
        assert!((changed.thrust_n() / world.thrust_n() - 0.5).abs() < 1e-12, "the fault counts as before");
        let calm = Truth { wind_m_s: 0.0, ..*world.truth() };
        let mut changed = world.changed(world.airframe(), &motor, &calm).unwrap();
        changed.step(&IGNITED);
        assert!(changed.wind_m_s().norm() < 1e-300);
        let other = motors::builtin("G33").unwrap();
        let changed = world.changed(world.airframe(), &other, world.truth()).unwrap();
        let since_s = world.time_s() - world.thrust_begins_s().unwrap();
        assert!((changed.thrust_n() - 0.9 * 1.03 * other.thrust_at_n(since_s)).abs() < 1e-9);
        assert!(world.changed(world.airframe(), &motor, &Truth { wind_m_s: -1.0, ..weaker }).is_err());
    }
}
