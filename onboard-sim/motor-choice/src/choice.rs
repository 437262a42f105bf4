//! The mass and the height of the start from which an airframe lands best on a motor, or why it does not.

use flight::vehicle::airframe::{BadValue, Mass};
use flight::vehicle::atmosphere::Air;
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;

use crate::frame::{Ballast, Frame};
use crate::height::Fall;
use crate::mission_text::start_height_m;
use crate::search;
use crate::window::{Onset, Window};

/// What a team can change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Least and most mass with the motor full, kg.
    pub masses_kg: [f64; 2],
    /// Where ballast is added or taken out, m above the nozzle.
    pub ballast_station_m: f64,
    /// From where the flight may begin.
    pub start: StartHeight,
    /// Widest motor that fits, m.
    pub tube_m: f64,
}

/// Height of the centre of gravity above the pad at which a flight begins, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartHeight {
    /// The best one up to this.
    AtMost(f64),
    Exactly(f64),
}

/// The best landing on a motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Masses with the motor full and the ballast.
    pub mass: Mass,
    pub ballast: Ballast,
    /// Height of the centre of gravity above the pad at which the flight must begin, m.
    pub start_height_m: f64,
    pub window: Window,
    /// Least and most mass with which the certified motor lands, from any height and whether it can be had or not, kg.
    pub landing_kg: [f64; 2],
}

/// Why an airframe does not land on a motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    pub obstacle: Obstacle,
    /// Least and most mass with which the certified motor would land, kg.
    pub landing_kg: Option<[f64; 2]>,
}

/// What stands in the way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Obstacle {
    #[error("does not fit: its diameter is {motor_mm:.0} mm; up to {tube_mm:.0} mm is accepted")]
    Diameter { motor_mm: f64, tube_mm: f64 },
    #[error(
        "does not fit: its length is {motor_mm:.0} mm; up to {body_mm:.0} mm, the body's length, is accepted"
    )]
    Length { motor_mm: f64, body_mm: f64 },
    #[error(
        "its thrust of at most {peak_n:.1} N is never above the weight of {weight_n:.1} N at {mass_kg:.3} kg"
    )]
    Thrust { peak_n: f64, weight_n: f64, mass_kg: f64 },
    #[error("no landing exists {}", at_masses(*.possible_kg))]
    Mass { possible_kg: [f64; 2] },
    #[error("lands only from a start at {needed_m:.0} m or higher; up to {most_m:.0} m is accepted")]
    Height { needed_m: f64, most_m: f64 },
    #[error("the vehicle would not be sound")]
    Unsound(#[source] BadValue),
}

fn at_masses([least_kg, most_kg]: [f64; 2]) -> String {
    if most_kg - least_kg < 5e-4 {
        format!("at {least_kg:.3} kg")
    } else {
        format!("at {least_kg:.3} to {most_kg:.3} kg")
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.obstacle)?;
        if let Obstacle::Unsound(value) = &self.obstacle {
            write!(f, ": {value}")?;
        }
        match self.landing_kg {
            Some([least_kg, most_kg]) if !matches!(self.obstacle, Obstacle::Height { .. }) => {
                write!(f, "; it would land at {least_kg:.3} to {most_kg:.3} kg")
            }
            _ => Ok(()),
        }
    }
}

/// One motor in one airframe.
pub(crate) struct Pairing<'a> {
    pub(crate) mission: &'a Mission,
    pub(crate) frame: &'a Frame,
    pub(crate) curve: &'a ThrustCurve,
    pub(crate) limits: &'a Limits,
    density_kg_m3: f64,
    open_fins_m2: f64,
}

/// A vehicle of a mass, kg, with what leads to its onset.
pub(crate) struct Weighed<'a> {
    pub(crate) mass: Mass,
    pub(crate) ballast: Ballast,
    pub(crate) onset: Onset<'a>,
    pub(crate) fall: Fall,
}

impl<'a> Pairing<'a> {
    /// The vehicle of a mass, kg.
    pub(crate) fn weighed(&self, mass_kg: f64) -> Result<Weighed<'a>, BadValue> {
        let without_kg = self.frame.mass_kg() + self.curve.total_mass_kg();
        // Rounding must not make ballast of nothing.
        let ballast_kg = if (mass_kg - without_kg).abs() < 1e-9 { 0.0 } else { mass_kg - without_kg };
        let ballast = Ballast { mass_kg: ballast_kg, station_m: self.limits.ballast_station_m };
        let mass = self.frame.with(self.curve, ballast)?;
        let onset = Onset::new(self.mission, mass.loaded_kg, self.curve, self.density_kg_m3);
        let cg_above_feet_m = self.mission.airframe.above_feet_m(mass.loaded_cg_station_m);
        let fall = Fall::new(onset.column(), self.open_fins_m2, cg_above_feet_m);
        Ok(Weighed { mass, ballast, onset, fall })
    }

    /// A vehicle of a mass, kg, that may not be possible: the onset alone.
    pub(crate) fn imagined(&self, mass_kg: f64) -> (Onset<'a>, Fall) {
        let onset = Onset::new(self.mission, mass_kg, self.curve, self.density_kg_m3);
        let cg_m = self.mission.airframe.above_feet_m(self.mission.airframe.mass.loaded_cg_station_m);
        let fall = Fall::new(onset.column(), self.open_fins_m2, cg_m);
        (onset, fall)
    }

    fn misfit(&self) -> Option<Obstacle> {
        let mm = |length_m: f64| 1e3 * length_m;
        let (diameter_m, length_m) = (self.curve.diameter_m(), self.curve.length_m());
        let body_m = self.mission.airframe.body.length_m;
        // Files round to a millimetre.
        if diameter_m > self.limits.tube_m + 5e-4 {
            return Some(Obstacle::Diameter { motor_mm: mm(diameter_m), tube_mm: mm(self.limits.tube_m) });
        }
        (length_m > body_m).then(|| Obstacle::Length { motor_mm: mm(length_m), body_mm: mm(body_m) })
    }
}

/// The best mass and height of the start for a motor.
///
/// # Errors
/// What stands in the way of a landing.
pub fn choose(
    mission: &Mission,
    frame: &Frame,
    curve: &ThrustCurve,
    limits: &Limits,
) -> Result<Choice, Refusal> {
    let airframe = &mission.airframe;
    let pairing = Pairing {
        mission,
        frame,
        curve,
        limits,
        density_kg_m3: Air::at_height_m(mission.pad_altitude_m).density_kg_m3,
        open_fins_m2: airframe.fin_drag_area_m2(&[airframe.fins.open_rad(); 4]),
    };
    if let Some(obstacle) = pairing.misfit() {
        return Err(Refusal { obstacle, landing_kg: None });
    }
    let landing_kg = search::landing_masses_kg(&pairing);
    let refused = |obstacle| Refusal { obstacle, landing_kg };
    let [least_kg, most_kg] = limits.masses_kg;
    let weight_n = least_kg * mission.gravity_m_s2;
    if curve.peak_thrust_n() <= weight_n {
        let peak_n = curve.peak_thrust_n();
        return Err(refused(Obstacle::Thrust { peak_n, weight_n, mass_kg: least_kg }));
    }
    let Some(landing_kg) = landing_kg else {
        return Err(refused(Obstacle::Mass { possible_kg: limits.masses_kg }));
    };
    // The ends are not sound, say, but something between them may be.
    if let (Err(error), Err(_)) = (pairing.weighed(least_kg), pairing.weighed(most_kg)) {
        return Err(refused(Obstacle::Unsound(error)));
    }
    search::best(&pairing, landing_kg).map_err(refused)
}

/// The limits of a mission's frame with a motor: any ballast between two masses, kg, at its centre of gravity; its own
/// tube; and a start up to the mission's own height.
pub fn usual_limits(mission: &Mission, frame: &Frame, curve: &ThrustCurve, ballast_kg: [f64; 2]) -> Limits {
    let without_kg = frame.mass_kg() + curve.total_mass_kg();
    Limits {
        masses_kg: ballast_kg.map(|ballast_kg| without_kg + ballast_kg),
        ballast_station_m: frame.cg_station_m(),
        start: StartHeight::AtMost(start_height_m(mission)),
        tube_m: frame.tube_m(),
    }
}
