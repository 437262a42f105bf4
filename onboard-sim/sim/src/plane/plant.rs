//! The simulated vehicle: the truth, as opposed to the controller's model.
//!
//! Planar motion (the same equations as the controller's consistent model, Eq. 18-22 of the landing paper with
//! its errata corrected), a motor of constant thrust, rate-limited servos, and the ground. Integrated by RK4 at
//! 1 ms. Legs are perfectly inelastic: contact stops the vehicle, and thrust above weight lifts it again.

use flight::vehicle::dynamics::{PlanarModel, PlanarState};
use flight::vehicle::profile::{ModelKind, Motor, Profile};

use super::draw::Draw;

/// Integration step, s.
pub const STEP_S: f64 = 0.001;

/// A contact with the ground: the state just before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Plant time, s.
    pub time_s: f64,
    /// The state as the legs touch.
    pub state: PlanarState,
}

/// What holds the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    /// A rig, upright and still, until released.
    Rig,
    /// The air.
    Free,
    Ground,
}

/// The simulated vehicle.
#[derive(Debug, Clone)]
pub struct Plant {
    model: PlanarModel,
    motor: Motor,
    thrust_scale: f64,
    gimbal_limit_rad: f64,
    gimbal_rate_rad_s: Option<f64>,
    fin_rate_rad_s: f64,
    time_s: f64,
    hold: Hold,
    state: PlanarState,
    gimbal_commanded_rad: f64,
    gimbal_rad: f64,
    fin_commanded_rad: [f64; 4],
    fin_rad: [f64; 4],
    ignited_at_s: Option<f64>,
}

impl Plant {
    /// The vehicle in its rig: upright and still at the start position, fins closed.
    pub fn new(profile: &Profile, draw: &Draw) -> Self {
        Self {
            // The truth is always the consistent model, whichever model the controller uses.
            model: PlanarModel { params: profile.planar_params(), kind: ModelKind::Consistent },
            motor: profile.motor,
            thrust_scale: draw.thrust_scale,
            gimbal_limit_rad: profile.gimbal.limit_rad(),
            gimbal_rate_rad_s: profile.gimbal.rate_limit_rad_s(),
            fin_rate_rad_s: profile.fins.rate_limit_rad_s(),
            time_s: 0.0,
            hold: Hold::Rig,
            state: PlanarState {
                x_m: draw.release.x_m,
                z_m: draw.release.z_m,
                theta_rad: core::f64::consts::FRAC_PI_2,
                ..PlanarState::default()
            },
            gimbal_commanded_rad: 0.0,
            gimbal_rad: 0.0,
            fin_commanded_rad: [profile.fins.closed_rad(); 4],
            fin_rad: [profile.fins.closed_rad(); 4],
            ignited_at_s: None,
        }
    }

    /// Releases the vehicle in this state.
    pub fn release(&mut self, state: PlanarState) {
        self.state = state;
        self.hold = Hold::Free;
    }

    /// Lights the motor; a second time does nothing.
    pub fn ignite(&mut self) {
        self.ignited_at_s.get_or_insert(self.time_s);
    }

    /// Sets the actuators' targets.
    pub fn command(&mut self, gimbal_rad: f64, fin_rad: [f64; 4]) {
        self.gimbal_commanded_rad = gimbal_rad;
        self.fin_commanded_rad = fin_rad;
        // A servo without a rate limit is ideal: it reaches its target at once, also in the step that begins now.
        if self.gimbal_rate_rad_s.is_none() {
            self.gimbal_rad = gimbal_rad.clamp(-self.gimbal_limit_rad, self.gimbal_limit_rad);
        }
    }

    /// Advances by one [`STEP_S`]; returns the contact if the legs touched in it.
    pub fn step(&mut self) -> Option<Impact> {
        self.move_servos();
        let thrust_n = self.mean_thrust_n();
        let impact = match self.hold {
            Hold::Rig => None,
            Hold::Ground => {
                if self.lifts_off(thrust_n) {
                    self.hold = Hold::Free;
                    self.fly(thrust_n)
                } else {
                    None
                }
            }
            Hold::Free => self.fly(thrust_n),
        };
        self.time_s += STEP_S;
        impact
    }

    /// Plant time, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// True state.
    pub fn state(&self) -> PlanarState {
        self.state
    }

    /// True thrust now, N.
    pub fn thrust_n(&self) -> f64 {
        self.ignited_at_s.map_or(0.0, |at_s| self.thrust_scale * self.motor.thrust_at_n(self.time_s - at_s))
    }

    pub fn mass_kg(&self) -> f64 {
        self.model.params.mass_kg
    }

    /// Whether the legs are on the ground.
    pub fn in_contact(&self) -> bool {
        self.hold == Hold::Ground
    }

    /// Whether thrust is too small to lift the vehicle off the ground.
    pub fn thrust_below_weight(&self) -> bool {
        !self.lifts_off(self.thrust_n())
    }

    /// The reading of a perfect accelerometer along the nose axis, m/s^2. On the ground or in the rig it is the
    /// reaction to gravity.
    pub fn axial_specific_force_m_s2(&self) -> f64 {
        let state = self.state;
        let gravity_m_s2 = self.model.params.gravity_m_s2 * libm::sin(state.theta_rad);
        if self.hold != Hold::Free {
            return gravity_m_s2;
        }
        let udot = self.model.derivative(&state.to_array(), self.gimbal_rad, self.thrust_n())[3];
        udot + gravity_m_s2 + state.q_rad_s * state.w_m_s
    }

    /// Commanded and actual gimbal angle, rad.
    pub fn gimbal_rad(&self) -> (f64, f64) {
        (self.gimbal_commanded_rad, self.gimbal_rad)
    }

    /// Commanded and actual fin opening angles, rad.
    pub fn fins_rad(&self) -> ([f64; 4], [f64; 4]) {
        (self.fin_commanded_rad, self.fin_rad)
    }

    fn move_servos(&mut self) {
        let target = self.gimbal_commanded_rad.clamp(-self.gimbal_limit_rad, self.gimbal_limit_rad);
        self.gimbal_rad = match self.gimbal_rate_rad_s {
            None => target,
            Some(rate) => slewed(self.gimbal_rad, target, rate),
        };
        for (fin, target) in self.fin_rad.iter_mut().zip(self.fin_commanded_rad) {
            *fin = slewed(*fin, target, self.fin_rate_rad_s);
        }
    }

    /// Mean over the step that begins now, so that the burn's end inside a step keeps its impulse.
    fn mean_thrust_n(&self) -> f64 {
        self.ignited_at_s
            .map_or(0.0, |at_s| self.thrust_scale * self.motor.mean_thrust_n(self.time_s - at_s, STEP_S))
    }

    fn lifts_off(&self, thrust_n: f64) -> bool {
        let (sin_delta, cos_delta) = libm::sincos(self.gimbal_rad);
        let (sin_theta, cos_theta) = libm::sincos(self.state.theta_rad);
        let up_n = thrust_n * (cos_delta * sin_theta + sin_delta * cos_theta);
        up_n > self.model.params.mass_kg * self.model.params.gravity_m_s2
    }

    fn fly(&mut self, thrust_n: f64) -> Option<Impact> {
        let before = self.state;
        let after = self.model.rk4_step(&before, self.gimbal_rad, thrust_n, STEP_S);
        if after.z_m > 0.0 {
            self.state = after;
            return None;
        }
        // Bisect for the instant of contact: 40 halvings of 1 ms are below a double's resolution of time.
        let (mut above_s, mut below_s) = (0.0, STEP_S);
        for _ in 0..40 {
            let middle_s = 0.5 * (above_s + below_s);
            let there = self.model.rk4_step(&before, self.gimbal_rad, thrust_n, middle_s);
            if there.z_m > 0.0 {
                above_s = middle_s;
            } else {
                below_s = middle_s;
            }
        }
        let touching = self.model.rk4_step(&before, self.gimbal_rad, thrust_n, above_s);
        self.hold = Hold::Ground;
        self.state = PlanarState { z_m: 0.0, u_m_s: 0.0, w_m_s: 0.0, q_rad_s: 0.0, ..touching };
        Some(Impact { time_s: self.time_s + above_s, state: touching })
    }
}

fn slewed(now_rad: f64, target_rad: f64, rate_rad_s: f64) -> f64 {
    let most_rad = rate_rad_s * STEP_S;
    now_rad + (target_rad - now_rad).clamp(-most_rad, most_rad)
}

#[cfg(test)]
mod tests {
    use super::super::draw::draw;
    use super::*;

    fn calibrated() -> (Profile, Plant) {
        let profile = vehicles::profile::builtin("paper-calibrated").unwrap();
        let plant = Plant::new(&profile, &draw(&profile, 0));
        (profile, plant)
    }

    #[test]
    fn the_rig_holds_until_released() {
        let (_, mut plant) = calibrated();
        let before = plant.state();
        for _ in 0..100 {
            assert_eq!(plant.step(), None);
        }
        assert_eq!(plant.state(), before);
    }

    /// Without thrust and nearly without drag, from rest: v^2 = 2 g h.
    #[test]
    fn val_free_fall_from_rest_hits_the_ground_at_the_textbook_speed() {
        let (mut profile, _) = calibrated();
        profile.vehicle.drag_coefficient = 0.0;
        let mut plant = Plant::new(&profile, &draw(&profile, 0));
        let upright =
            PlanarState { z_m: 5.0, theta_rad: core::f64::consts::FRAC_PI_2, ..PlanarState::default() };
        plant.release(upright);
        let impact = std::iter::repeat_with(|| plant.step()).take(2_000).find_map(|impact| impact).unwrap();
        let gravity = profile.environment.gravity_m_s2;
        assert!((impact.state.u_m_s + (2.0 * gravity * 5.0).sqrt()).abs() < 1e-9, "{impact:?}");
        assert!((impact.time_s - (2.0 * 5.0 / gravity).sqrt()).abs() < 1e-9, "{impact:?}");
        assert!(impact.state.z_m >= 0.0 && impact.state.z_m < 1e-9);
        assert!(plant.in_contact() && plant.thrust_below_weight());
    }

    /// 30 N on 3 kg, upright all the way: on the ground at 3.2 s at -4.3 m/s (hand integration of the paper's case).
    #[test]
    fn val_hand_integration_thirty_newton_cannot_stop_the_vehicle() {
        let profile = vehicles::profile::builtin("paper-as-printed").unwrap();
        let mut plant = Plant::new(&profile, &draw(&profile, 0));
        plant.release(profile.start.planar_state());
        plant.ignite();
        let impact = std::iter::repeat_with(|| plant.step()).take(6_000).find_map(|impact| impact).unwrap();
        assert!((impact.time_s - 3.2).abs() < 0.05 && (impact.state.u_m_s + 4.3).abs() < 0.05, "{impact:?}");
    }

    #[test]
    fn servos_keep_their_rate_and_their_stops() {
        let (mut profile, _) = calibrated();
        profile.gimbal.rate_limit_deg_s = Some(400.0);
        let mut plant = Plant::new(&profile, &draw(&profile, 0));
        plant.command(1.0, [core::f64::consts::FRAC_PI_2; 4]);
        let mut last = plant.gimbal_rad().1;
        for _ in 0..200 {
            plant.step();
            let now = plant.gimbal_rad().1;
            assert!((now - last).abs() <= 400f64.to_radians() * STEP_S + 1e-12);
            last = now;
        }
        assert!((last - profile.gimbal.limit_rad()).abs() < 1e-12, "stops at its limit, not at 1 rad");
        let fins_deg = plant.fins_rad().1[0].to_degrees();
        assert!((fins_deg - 0.2 * profile.fins.rate_limit_deg_s).abs() < 1e-9, "{fins_deg}");
    }

    #[test]
    fn the_burn_lasts_its_time_and_lights_once() {
        let (profile, mut plant) = calibrated();
        plant.ignite();
        let mut impulse_n_s = 0.0;
        for _ in 0..6_000 {
            impulse_n_s += plant.mean_thrust_n() * STEP_S;
            plant.step();
            plant.ignite();
        }
        let nominal = profile.motor.thrust_n * profile.motor.burn_time_s;
        assert!((impulse_n_s / nominal - 1.0).abs() < 1e-9, "{impulse_n_s}");
    }
}
