//! Simpler controllers, to be beaten.
//!
//! Both light the motor at a height fixed before the flight and keep the fins as they are during the burn; estimator,
//! steering by fins and the attitude loop are those of the [pilot](flight::pilot). They only do without a plan.
//!
//! * Open-loop timing: the height and one opening of the fins are those that bring the certified motor to rest at the
//!   ground ([`crate::timing`]). The nose is held upright.
//! * Oscillating gimbal: the nose swings to and fro about the vertical, which wastes thrust. The amplitude is set ten
//!   times a second so that the predicted speed at the ground is nil (after D. Michalow, D. Alazard, L. Lustosa,
//!   EuroGNC 2026: mean vertical thrust of a fixed-thrust motor lowered by oscillation). The height is fixed for half
//!   of the largest amplitude, so that there is room either way.

use core::f64::consts::TAU;

use flight::aim::{Aim, AimLoop};
use flight::airframe::MassModel;
use flight::atmosphere::Air;
use flight::burn::Burn;
use flight::mission::{Mission, MissionError};
use flight::pilot::{Pilot, PilotOutput};
use flight::thrust_curve::ThrustCurve;
use nalgebra::Vector3;

use crate::braking::{Brake, nominal_fall_speed_m_s};

/// Who flies the landing burn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Controller {
    /// The pilot: ignition decided on board, landing planned by the NMPC.
    #[default]
    Nmpc,
    /// Open-loop timing.
    OpenLoop,
    /// Oscillating gimbal.
    Oscillating,
}

impl Controller {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Nmpc, Self::OpenLoop, Self::Oscillating];

    /// The name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nmpc => "nmpc",
            Self::OpenLoop => "open-loop",
            Self::Oscillating => "oscillating",
        }
    }
}

/// A controller of a name that there is not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no controller is named `{0}`; there are nmpc, open-loop and oscillating")]
pub struct UnknownController(String);

impl core::str::FromStr for Controller {
    type Err = UnknownController;

    fn from_str(name: &str) -> Result<Self, UnknownController> {
        let found = Self::ALL.into_iter().find(|controller| controller.name() == name);
        found.ok_or_else(|| UnknownController(name.to_owned()))
    }
}

/// Share of the height of apogee that is fallen before the burn: the speed is nearly terminal by then.
const FALL_SHARE: f64 = 0.76;
/// Swings a second. Slow enough for the gimbal loop to follow.
const SWING_HZ: f64 = 1.0;
/// Share of the gimbal's travel that swinging may take; the rest keeps the balance.
const SWING_TRAVEL_SHARE: f64 = 0.6;
/// Largest swing, rad.
const SWING_MAX_RAD: f64 = 0.5;
/// The swing fades over this time before the predicted contact, s.
const FADE_S: f64 = 0.6;
/// Frames between two settings of the amplitude.
const FRAMES_PER_SETTING: u32 = 20;

/// A simple controller of the landing burn.
#[derive(Debug, Clone)]
pub struct Baseline {
    controller: Controller,
    mission: Mission,
    curve: ThrustCurve,
    mass: MassModel,
    brake: Brake,
    fins_rad: [f64; 4],
    ignition_height_m: f64,
    largest_swing_rad: f64,
    swing_rad: f64,
    frames: u32,
    aim_loop: AimLoop,
}

impl Baseline {
    /// Made ready on the ground, from the data alone; `None` for the pilot itself.
    ///
    /// # Errors
    /// The mission's motor is not to be had.
    pub fn new(controller: Controller, mission: &Mission) -> Result<Option<Self>, MissionError> {
        if controller == Controller::Nmpc {
            return Ok(None);
        }
        let curve = mission.motor()?;
        let mass = MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg());
        let burn = Burn::nominal(&curve);
        let fins = &mission.airframe.fins;
        let [closed_m2, open_m2] =
            [fins.closed_rad(), fins.open_rad()].map(|opening| mission.airframe.drag_area_m2(opening));
        // The burn takes the last quarter of the fall, about.
        let fallen_m = FALL_SHARE * mission.start.height_m;
        let speed_m_s = nominal_fall_speed_m_s(mission, mass.at(0.0).mass_kg, open_m2, fallen_m);
        let mut brake = Brake {
            mass_at_ignition_kg: mass.at(0.0).mass_kg,
            gravity_m_s2: mission.gravity_m_s2,
            air_density_kg_m3: Air::at_height_m(mission.pad_altitude_m).density_kg_m3,
            drag_area_m2: open_m2,
            thrust_share: 1.0,
        };
        let largest_swing_rad = largest_swing_rad(mission, &mass, &curve);
        if controller == Controller::Oscillating {
            brake.thrust_share = mean_cosine(largest_swing_rad / 2.0);
        }
        brake.drag_area_m2 = brake.drag_area_to_rest_m2(&burn, -speed_m_s, [closed_m2, open_m2]);
        let each_m2 = (open_m2 - closed_m2) / (libm::sin(fins.open_rad()) - libm::sin(fins.closed_rad()));
        let sine = libm::sin(fins.closed_rad()) + (brake.drag_area_m2 - closed_m2) / each_m2;
        let stop = brake.stop(&burn, 0.0, -speed_m_s);
        Ok(Some(Self {
            controller,
            fins_rad: [libm::asin(sine.clamp(0.0, 1.0)); 4],
            ignition_height_m: stop.fallen_m,
            largest_swing_rad,
            swing_rad: 0.0,
            frames: 0,
            aim_loop: AimLoop::new(mission.aim, mission.estimator.frame_s),
            mission: mission.clone(),
            curve,
            mass,
            brake,
        }))
    }

    /// Height of the feet at which thrust is to begin, m.
    pub fn ignition_height_m(&self) -> f64 {
        self.ignition_height_m
    }

    /// Replaces what the pilot commands while the motor burns.
    pub fn fly(&mut self, time_s: f64, pilot: &Pilot, output: &mut PilotOutput) {
        let (Some(burning_s), Some(estimate)) = (pilot.burning_s(time_s), pilot.estimate()) else { return };
        if !output.phase.in_landing_burn() {
            return;
        }
        let mass = self.mass.at(self.curve.propellant_burnt_kg(burning_s));
        let state = &estimate.state;
        let height_m = state.position_m.z - self.mission.airframe.above_feet_m(mass.cg_station_m);
        let motor = pilot.motor();
        let burn = Burn {
            curve: &self.curve,
            impulse_scale: motor.impulse_scale(),
            time_scale: motor.burn_time_stretch(),
        };
        if self.controller == Controller::Oscillating {
            if self.frames.is_multiple_of(FRAMES_PER_SETTING) {
                let most = self.largest_swing_rad;
                self.swing_rad =
                    self.brake.swing_to_rest_rad(&burn, burning_s, state.velocity_m_s.z, height_m, most);
            }
            self.frames += 1;
        }
        let thrust_n = burn.thrust_n(burning_s);
        let turning_rad_s2 =
            if thrust_n > 3.0 { thrust_n * mass.cg_station_m / mass.pitch_inertia_kg_m2 } else { 0.0 };
        let to_go_s = height_m.max(0.0) / (-state.velocity_m_s.z).max(0.5);
        let aim = swinging(self.swing_rad * (to_go_s / FADE_S).clamp(0.0, 1.0), burning_s);
        output.gimbal_rad = self.aim_loop.command_rad(
            &state.world_from_body,
            &state.rate_rad_s,
            turning_rad_s2,
            &aim,
            self.mission.airframe.gimbal.limit_rad(),
        );
        output.fins_rad = self.fins_rad;
    }
}

/// The nose swinging in the world's x-z plane.
fn swinging(amplitude_rad: f64, time_s: f64) -> Aim {
    let frequency = TAU * SWING_HZ;
    let (sine, cosine) = libm::sincos(frequency * time_s);
    let (nose_x, nose_z) = libm::sincos(amplitude_rad * sine);
    Aim {
        nose_in_world: Vector3::new(nose_x, 0.0, nose_z),
        rate_in_world_rad_s: Vector3::y() * (amplitude_rad * frequency * cosine),
        acceleration_in_world_rad_s2: Vector3::y() * (-amplitude_rad * frequency * frequency * sine),
    }
}

/// Mean cosine of an angle that swings with an amplitude, to fourth order: the Bessel function `J0`.
pub(crate) fn mean_cosine(amplitude_rad: f64) -> f64 {
    let square = amplitude_rad * amplitude_rad;
    1.0 - square / 4.0 + square * square / 64.0
}

/// What the gimbal can swing, by the motor's mean thrust.
fn largest_swing_rad(mission: &Mission, mass: &MassModel, curve: &ThrustCurve) -> f64 {
    let mean_n = curve.total_impulse_n_s() / curve.burn_time_s();
    let full = mass.at(0.0);
    let turning_rad_s2 = mean_n * full.cg_station_m / full.pitch_inertia_kg_m2;
    let frequency = TAU * SWING_HZ;
    let travel_rad = SWING_TRAVEL_SHARE * mission.airframe.gimbal.limit_rad();
    (turning_rad_s2 * travel_rad / (frequency * frequency)).min(SWING_MAX_RAD)
}
