//! Read access to the world.

use flight::vehicle::airframe::{Airframe, MassProperties};
use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use flight::vehicle::rigid::RigidState;
use nalgebra::Vector3;

use super::World;
use crate::STEP_S;
use crate::ground::{Rest, Touchdown};
use crate::truth::Truth;

impl World {
    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * STEP_S
    }

    /// Steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The vehicle's state; its position is that of the centre of gravity.
    pub fn state(&self) -> &RigidState {
        &self.state
    }

    /// Height of the feet above the ground as if the vehicle were upright, m; zero at touchdown.
    pub fn height_m(&self) -> f64 {
        let place_m = &self.state.position_m;
        place_m.z - self.truth.ground_m(place_m.x, place_m.y) - self.cg_above_feet_m()
    }

    /// Distance from the feet up to the centre of gravity, along the axis, m.
    pub fn cg_above_feet_m(&self) -> f64 {
        self.airframe.above_feet_m(self.cg_m().x)
    }

    /// Mean specific force over the last step in body axes, m/s^2, which is what an ideal accelerometer at the centre
    /// of gravity measures.
    pub fn specific_force_m_s2(&self) -> &Vector3<f64> {
        &self.specific_force_m_s2
    }

    /// Mean angular acceleration over the last step in body axes, rad/s^2.
    pub fn angular_acceleration_rad_s2(&self) -> &Vector3<f64> {
        &self.angular_acceleration_rad_s2
    }

    /// Mass, centre of gravity and inertia now.
    pub fn mass(&self) -> &MassProperties {
        &self.mass
    }

    /// Weight now, N.
    pub fn weight_n(&self) -> f64 {
        self.mass.mass_kg * STANDARD_GRAVITY_M_S2
    }

    /// Thrust now, N.
    pub fn thrust_n(&self) -> f64 {
        self.motor.thrust_n(self.time_s())
    }

    /// When the thrust begins or began, s; `None` before the ignition command and for a motor that does not light.
    pub fn thrust_begins_s(&self) -> Option<f64> {
        self.motor.thrust_begins_s()
    }

    /// Gimbal angles of the nozzle (pitch, yaw) without the thrust's misalignment, rad.
    pub fn gimbal_rad(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.gimbal_links[axis].rad())
    }

    /// Gimbal angles (pitch, yaw) as the servos' feedback tells them, rad.
    pub fn gimbal_feedback_rad(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.gimbal[axis].load_rad())
    }

    /// Opening angles of the fins, rad.
    pub fn fins_rad(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|fin: usize| self.fin_links[fin].rad())
    }

    /// Opening angles of the fins as the servos' feedback tells them, rad.
    pub fn fins_feedback_rad(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|fin: usize| self.fins[fin].load_rad())
    }

    /// Wind at the vehicle, gusts included, in the world, m/s.
    pub fn wind_m_s(&self) -> Vector3<f64> {
        self.wind.now_m_s()
    }

    /// Velocity of the centre of gravity through the air, in the world, m/s.
    pub fn air_velocity_m_s(&self) -> Vector3<f64> {
        self.state.velocity_m_s - self.wind.now_m_s()
    }

    /// The air at the vehicle.
    pub fn air(&self) -> Air {
        Air::at_height_m(self.state.position_m.z)
    }

    /// Whether the parachute was ejected.
    pub fn parachute_ejected(&self) -> bool {
        self.parachute.ejected()
    }

    /// Whether the wire between booster and vehicle is whole.
    pub fn booster_attached(&self) -> bool {
        self.stack.is_some()
    }

    /// Thrust of the ascent motor now, N.
    pub fn booster_thrust_n(&self) -> f64 {
        self.stack.as_ref().map_or(0.0, |stack| stack.thrust_n(self.time_s()))
    }

    /// When the separation charge was fired, s.
    pub fn charge_fired_s(&self) -> Option<f64> {
        self.stack.as_ref().map_or(self.separated_s, |stack| stack.charge_fired_s())
    }

    /// The vehicle hangs below its drone.
    pub fn hangs(&self) -> bool {
        self.hanging.is_some()
    }

    /// The drone lets the vehicle go.
    pub fn let_go(&mut self) {
        self.hanging = None;
    }

    /// When the parachute was ejected, s.
    pub fn parachute_ejected_s(&self) -> Option<f64> {
        self.parachute.ejected_s()
    }

    /// Height of the ground where a beam backwards along the axis meets it, m; the slope is taken as small.
    pub fn ground_under_beam_m(&self) -> f64 {
        let (place_m, nose) = (&self.state.position_m, self.state.nose_in_world());
        let per_m = place_m.z / nose.z.max(0.1);
        self.truth.ground_m(place_m.x - nose.x * per_m, place_m.y - nose.y * per_m)
    }

    /// Fraction of the parachute that is open, 0 to 1.
    pub fn parachute_open_share(&self) -> f64 {
        self.parachute.open_share()
    }

    /// The first contact with the ground, if there was one.
    pub fn touchdown(&self) -> Option<&Touchdown> {
        self.touchdown.as_ref()
    }

    /// How the vehicle came to rest, if it has. From then on only time changes.
    pub fn rest(&self) -> Option<&Rest> {
        self.rest.as_ref()
    }

    /// The vehicle's data.
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// How the true vehicle and the weather differ from the nominal data.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }
}
