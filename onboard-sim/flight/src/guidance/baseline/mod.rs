//! Simpler controllers, for comparison with the NMPC.
//!
//! Both light the motor at a height fixed before the flight and do not move the fins during the burn. Estimator,
//! steering by fins and attitude loop are those of the [pilot](crate::computer::pilot); only the plan is missing.
//!
//! * Open-loop timing: the height and one fin opening are chosen so that the certified motor stops the vehicle at the
//!   ground. The nose is held upright.
//! * Oscillating gimbal: the nose swings about the vertical, which wastes thrust. The amplitude is set ten times a
//!   second so that the predicted speed at the ground is zero (after D. Michalow, D. Alazard, L. Lustosa,
//!   EuroGNC 2026: mean vertical thrust of a fixed-thrust motor lowered by oscillation). The height is chosen for half
//!   of the largest amplitude, so that there is room in both directions.

use alloc::borrow::ToOwned as _;
use alloc::string::String;
use core::f64::consts::TAU;

use crate::computer::memory::remembers;
use crate::control::aim::{Aim, AimLoop};
use crate::estimation::estimator::Estimate;
use crate::estimation::motor_estimate::MotorEstimate;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::atmosphere::Air;
use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;
use crate::vehicle::thrust_curve::ThrustCurve;
use nalgebra::Vector3;

mod braking;

use self::braking::{Brake, nominal_fall_speed_m_s};

/// The law that flies the landing burn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Controller {
    /// The pilot: it decides the ignition on board and plans the landing with the NMPC.
    #[default]
    Nmpc,
    /// Open-loop timing.
    OpenLoop,
    /// Oscillating gimbal.
    Oscillating,
}

impl Controller {
    /// Every controller.
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

/// No controller has this name.
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

/// Fraction of the apogee height that the vehicle falls before the burn: the speed is nearly terminal by then.
const FALL_SHARE: f64 = 0.76;
/// Swings per second, slow enough for the gimbal loop.
const SWING_HZ: f64 = 1.0;
/// Fraction of the gimbal's travel that the swing may use; the rest keeps the balance.
const SWING_TRAVEL_SHARE: f64 = 0.6;
/// Largest swing, rad.
const SWING_MAX_RAD: f64 = 0.5;
/// The swing fades over this time before the predicted contact, s.
const FADE_S: f64 = 0.6;
/// Frames between two settings of the amplitude.
const FRAMES_PER_SETTING: u32 = 20;

/// The law that flies the landing burn, with its values computed before the flight.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "one a flight")]
pub enum Law {
    /// The pilot's own plans.
    Nmpc,
    /// A simpler law.
    Baseline(Baseline),
}

impl Law {
    /// Prepares a controller's law before the flight from the mission's data.
    pub fn of(controller: Controller, mission: &Mission) -> Self {
        Baseline::new(controller, mission).map_or(Self::Nmpc, Self::Baseline)
    }

    /// The height at which thrust begins, m, if it is fixed before the flight.
    pub fn ignition_height_m(&self) -> Option<f64> {
        match self {
            Self::Nmpc => None,
            Self::Baseline(baseline) => Some(baseline.ignition_height_m()),
        }
    }
}

/// A simple law for the landing burn.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    controller: Controller,
    mission: Mission,
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
    /// Prepares the law before the flight from the data alone; `None` for the pilot.
    pub fn new(controller: Controller, mission: &Mission) -> Option<Self> {
        if controller == Controller::Nmpc {
            return None;
        }
        let curve = &mission.motor_curve;
        let mass = MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg());
        let burn = Burn::nominal(curve);
        let fins = &mission.airframe.fins;
        let [closed_m2, open_m2] =
            [fins.closed_rad(), fins.open_rad()].map(|opening| mission.airframe.drag_area_m2(opening));
        // The burn takes about the last quarter of the fall.
        let fallen_m = FALL_SHARE * mission.start.height_m;
        let speed_m_s = nominal_fall_speed_m_s(mission, mass.at(0.0).mass_kg, open_m2, fallen_m);
        let mut brake = Brake {
            mass_at_ignition_kg: mass.at(0.0).mass_kg,
            gravity_m_s2: mission.gravity_m_s2,
            air_density_kg_m3: Air::at_height_m(mission.pad_altitude_m).density_kg_m3,
            drag_area_m2: open_m2,
            thrust_share: 1.0,
        };
        let largest_swing_rad = largest_swing_rad(mission, &mass, curve);
        if controller == Controller::Oscillating {
            brake.thrust_share = mean_cosine(largest_swing_rad / 2.0);
        }
        brake.drag_area_m2 = brake.drag_area_to_rest_m2(&burn, -speed_m_s, [closed_m2, open_m2]);
        let each_m2 = (open_m2 - closed_m2) / (libm::sin(fins.open_rad()) - libm::sin(fins.closed_rad()));
        let sine = libm::sin(fins.closed_rad()) + (brake.drag_area_m2 - closed_m2) / each_m2;
        let stop = brake.stop(&burn, 0.0, -speed_m_s);
        Some(Self {
            controller,
            fins_rad: [libm::asin(sine.clamp(0.0, 1.0)); 4],
            ignition_height_m: stop.fallen_m,
            largest_swing_rad,
            swing_rad: 0.0,
            frames: 0,
            aim_loop: AimLoop::new(mission.aim, mission.estimator.frame_s),
            mission: mission.clone(),
            mass,
            brake,
        })
    }

    /// Height of the feet at which thrust begins, m.
    pub fn ignition_height_m(&self) -> f64 {
        self.ignition_height_m
    }

    /// The commands at a time after the thrust began, s: gimbal and fins, rad.
    pub(crate) fn commands_rad(
        &mut self,
        burning_s: f64,
        estimate: &Estimate,
        motor: &MotorEstimate,
    ) -> ([f64; 2], [f64; 4]) {
        let mass = self.mass.at(self.mission.motor_curve.propellant_burnt_kg(burning_s));
        let state = &estimate.state;
        let height_m = state.position_m.z - self.mission.airframe.above_feet_m(mass.cg_station_m);
        let burn = motor.burn(&self.mission.motor_curve);
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
        let gimbal_rad = self.aim_loop.command_rad(
            &state.world_from_body,
            &state.rate_rad_s,
            turning_rad_s2,
            &aim,
            self.mission.airframe.gimbal.limit_rad(),
        );
        (gimbal_rad, self.fins_rad)
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

/// The largest swing that the gimbal can produce with the motor's mean thrust.
fn largest_swing_rad(mission: &Mission, mass: &MassModel, curve: &ThrustCurve) -> f64 {
    let mean_n = curve.total_impulse_n_s() / curve.burn_time_s();
    let full = mass.at(0.0);
    let turning_rad_s2 = mean_n * full.cg_station_m / full.pitch_inertia_kg_m2;
    let frequency = TAU * SWING_HZ;
    let travel_rad = SWING_TRAVEL_SHARE * mission.airframe.gimbal.limit_rad();
    (turning_rad_s2 * travel_rad / (frequency * frequency)).min(SWING_MAX_RAD)
}

// The prepared values do not change in flight.
remembers!(Baseline { swing_rad, frames, aim_loop } but {
    controller, mission, mass, brake, fins_rad, ignition_height_m, largest_swing_rad,
});
