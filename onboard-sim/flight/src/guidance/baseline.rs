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
use nalgebra::Vector3;
use serde::Serialize;

use crate::control::aim::{Aim, AimLoop};
use crate::estimation::estimator::Estimate;
use crate::estimation::motor_estimate::MotorEstimate;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::atmosphere::Air;
use crate::vehicle::burn::Burn;
use crate::vehicle::mission::Mission;
use crate::vehicle::thrust_curve::ThrustCurve;

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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Baseline {
    // What is skipped is a constant of the mission.
    #[serde(skip)]
    controller: Controller,
    #[serde(skip)]
    mission: Mission,
    #[serde(skip)]
    mass: MassModel,
    #[serde(skip)]
    brake: Brake,
    #[serde(skip)]
    fins_rad: [f64; 4],
    #[serde(skip)]
    ignition_height_m: f64,
    #[serde(skip)]
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

// The vertical motion of an upright vehicle under its motor. The simple controllers compute it before the flight.

/// Step of the integration, s.
const STEP_S: f64 = 0.002;
/// Halvings of an interval.
const HALVINGS: usize = 30;
/// Vertical velocity aimed for at contact, m/s.
const CONTACT_M_S: f64 = -0.2;

/// The vehicle and its motor during braking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Brake {
    pub(crate) mass_at_ignition_kg: f64,
    pub(crate) gravity_m_s2: f64,
    pub(crate) air_density_kg_m3: f64,
    /// Drag area of body and fins, m^2.
    pub(crate) drag_area_m2: f64,
    /// Fraction of the thrust that acts along the vertical.
    pub(crate) thrust_share: f64,
}

/// The end of a fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    /// Distance fallen, m.
    pub(crate) fallen_m: f64,
    /// Vertical velocity there, m/s: the target, or the velocity at which the thrust falls through the weight.
    pub(crate) vertical_m_s: f64,
}

impl Brake {
    /// Falls from a moment of the burn until the target velocity is reached or the thrust is below the weight.
    pub(crate) fn stop(&self, burn: &Burn<'_>, burning_s: f64, vertical_m_s: f64) -> Stop {
        let carried_s =
            burn.falls_through_weight_s(self.mass_at_ignition_kg, self.gravity_m_s2).unwrap_or(burning_s);
        let (mut time_s, mut speed_m_s, mut fallen_m) = (burning_s, vertical_m_s, 0.0);
        while time_s < carried_s && speed_m_s < CONTACT_M_S {
            let mass_kg = self.mass_at_ignition_kg - burn.burnt_kg(time_s);
            let drag_n = 0.5 * self.air_density_kg_m3 * self.drag_area_m2 * speed_m_s * speed_m_s;
            let force_n = self.thrust_share * burn.mean_thrust_n(time_s, STEP_S) + drag_n;
            let after_m_s = speed_m_s + STEP_S * (force_n / mass_kg - self.gravity_m_s2);
            fallen_m -= 0.5 * STEP_S * (speed_m_s + after_m_s);
            speed_m_s = after_m_s;
            time_s += STEP_S;
        }
        Stop { fallen_m, vertical_m_s: speed_m_s }
    }

    /// The drag area, within a range, that brings the vehicle to rest just when the thrust falls through the weight:
    /// the smallest area if even that brakes too much, the largest if even that brakes too little.
    pub(crate) fn drag_area_to_rest_m2(
        &self,
        burn: &Burn<'_>,
        vertical_m_s: f64,
        [least_m2, most_m2]: [f64; 2],
    ) -> f64 {
        let rests = |drag_area_m2: f64| {
            Self { drag_area_m2, ..*self }.stop(burn, 0.0, vertical_m_s).vertical_m_s >= CONTACT_M_S
        };
        smallest(least_m2, most_m2, rests)
    }

    /// The swing with which the vehicle comes to rest after falling exactly its height, rad.
    pub(crate) fn swing_to_rest_rad(
        &self,
        burn: &Burn<'_>,
        burning_s: f64,
        vertical_m_s: f64,
        height_m: f64,
        most_rad: f64,
    ) -> f64 {
        // The larger the swing, the farther it falls.
        let reaches = |swing_rad: f64| {
            let brake = Self { thrust_share: mean_cosine(swing_rad), ..*self };
            brake.stop(burn, burning_s, vertical_m_s).fallen_m >= height_m
        };
        smallest(0.0, most_rad, reaches)
    }
}

/// The smallest value that fulfils a condition, which must hold for all larger values; the maximum if none does.
fn smallest(least: f64, most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (least, most);
    if holds(low) {
        return low;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// Speed, m/s, after a fall of `fallen_m` from the mission's apogee, fins open.
pub(crate) fn nominal_fall_speed_m_s(
    mission: &Mission,
    mass_kg: f64,
    drag_area_m2: f64,
    fallen_m: f64,
) -> f64 {
    let density_kg_m3 = crate::vehicle::atmosphere::Air::at_height_m(mission.pad_altitude_m).density_kg_m3;
    let terminal2 = 2.0 * mass_kg * mission.gravity_m_s2 / (density_kg_m3 * drag_area_m2);
    let shed = libm::exp(-2.0 * mission.gravity_m_s2 * fallen_m / terminal2);
    libm::sqrt(terminal2 * (1.0 - shed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::thrust_curve::{MotorData, ThrustCurve, ThrustPoint};

    /// A massless motor with 40 N for ten seconds on 2 kg, without air, at 10 m/s^2: the vehicle brakes at 10 m/s^2.
    fn brake() -> (Brake, ThrustCurve) {
        // No motor file may say so: it is not read from one.
        let at = |(time_s, thrust_n)| ThrustPoint { time_s, thrust_n };
        let curve = ThrustCurve::new(MotorData {
            name: "T".into(),
            manufacturer: "M".into(),
            diameter_m: 0.038,
            length_m: 0.2,
            propellant_mass_kg: 1e-6,
            total_mass_kg: 0.3,
            points: [(0.0, 0.0), (0.001, 40.0), (9.999, 40.0), (10.0, 0.0)].map(at).to_vec(),
        })
        .unwrap();
        let brake = Brake {
            mass_at_ignition_kg: 2.0,
            gravity_m_s2: 10.0,
            air_density_kg_m3: 1.2,
            drag_area_m2: 0.0,
            thrust_share: 1.0,
        };
        (brake, curve)
    }

    /// From 20 m/s at 10 m/s^2: 20 m, less 2 mm because the contact speed is not zero.
    #[test]
    fn a_fall_stops_after_the_distance_of_constant_deceleration() {
        let (brake, curve) = brake();
        let stop = brake.stop(&Burn::nominal(&curve), 0.1, -20.0);
        assert!((stop.fallen_m - (20.0 - 0.002)).abs() < 0.01, "{stop:?}");
        assert!((stop.vertical_m_s - CONTACT_M_S).abs() < 0.021, "{stop:?}");
    }

    /// 25 m instead of 20 m takes 8 m/s^2: nine tenths of the thrust, and J0(0.64) = 0.9.
    #[test]
    fn the_swing_wastes_the_surplus_thrust() {
        let (brake, curve) = brake();
        let swing_rad = brake.swing_to_rest_rad(&Burn::nominal(&curve), 0.1, -20.0, 25.0, 1.0);
        assert!((swing_rad - 0.6407).abs() < 0.005, "{swing_rad}");
        let none = brake.swing_to_rest_rad(&Burn::nominal(&curve), 0.1, -20.0, 15.0, 1.0);
        assert!(none.abs() < 1e-12, "{none}");
    }
}
