//! The mass and the height of the start from which an airframe lands best on a motor, or why it does not.
//!
//! A lighter vehicle stands a weaker motor, a heavier one a stronger one. So the scatter that it stands rises with the mass
//! up to one mass and falls beyond it, and a grid with a golden section around its best place finds that mass.

use core::convert::Infallible;

use flight::vehicle::airframe::{BadValue, Mass};
use flight::vehicle::atmosphere::Air;
use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use flight::vehicle::thrust_curve::ThrustCurve;
use sim::recipe::Recipe;

use super::frame::{Ballast, Frame};
use super::window::{Fall, Onset, Window};
use crate::statistics::golden_section;

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
    let landing_kg = landing_masses_kg(&pairing);
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
    best(&pairing, landing_kg).map_err(refused)
}

/// What a team has, and what it can change for any motor.
#[derive(Debug, Clone)]
pub struct Team {
    /// The mission of its airframe, in the world of its flights.
    pub recipe: Recipe,
    /// Least and most ballast, kg.
    pub ballast_kg: [f64; 2],
    pub start: StartHeight,
    /// Widest motor that fits, m; that of the mission's own motor if not given.
    pub tube_m: Option<f64>,
}

impl Team {
    /// With a start up to the mission's own height.
    pub fn new(recipe: Recipe, ballast_kg: [f64; 2]) -> Self {
        let start = StartHeight::AtMost(recipe.mission.start_height_m());
        Self { recipe, ballast_kg, start, tube_m: None }
    }

    /// What it can change with a motor.
    pub fn limits(&self, frame: &Frame, curve: &ThrustCurve) -> Limits {
        let without_kg = frame.mass_kg() + curve.total_mass_kg();
        Limits {
            masses_kg: self.ballast_kg.map(|ballast_kg| without_kg + ballast_kg),
            ballast_station_m: frame.cg_station_m(),
            start: self.start,
            tube_m: self.tube_m.unwrap_or(frame.tube_m()),
        }
    }
}

/// Shares of the terminal speed at which the thrust may begin.
const SPEED_SHARES: [f64; 5] = [0.75, 0.85, 0.92, 0.95, 0.97];
/// Shortest fall from the start to the first thrust, as the time that the landing controller takes over before the
/// ignition and this for opening the fins and steering, s.
const STEERING_S: f64 = 2.0;
/// Falls from the release of a drop to the first thrust, s. The fall is felt after 0.1 s, and the fins are open 0.4 s after
/// the release; 2.4 s are a fall of 28 m.
const DROPS_S: [f64; 8] = [1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.4];
/// Factor between neighbours of the grid of masses.
const MASS_STEP: f64 = 1.03;
/// Masses looked at in all, as shares of the mission's own.
const MASSES: [f64; 2] = [0.1, 4.0];
/// Steps of the golden section: a step of the grid becomes 0.1 % of the mass.
const SECTIONS: usize = 7;
/// Rounds in which height and speed of the onset are made to agree.
const ROUNDS: usize = 8;
/// A scatter must be larger by this for more ballast.
const BETTER: f64 = 0.01;

/// Least and most mass with which the certified motor lands, kg, whether that mass can be had or not.
pub(crate) fn landing_masses_kg(pairing: &Pairing<'_>) -> Option<[f64; 2]> {
    let lands = |mass_kg: f64| {
        let (onset, fall) = pairing.imagined(mass_kg);
        speeds_m_s(pairing, &fall, &onset).into_iter().any(|speed_m_s| onset.lands(speed_m_s))
    };
    let own_kg = pairing.mission.airframe.mass.loaded_kg;
    let least_kg = (MASSES[0] * own_kg).max(1.01 * pairing.curve.total_mass_kg());
    let most_kg = (MASSES[1] * own_kg).min(pairing.curve.peak_thrust_n() / pairing.mission.gravity_m_s2);
    let masses_kg = grid(least_kg, most_kg);
    let first = masses_kg.iter().position(|mass_kg| lands(*mass_kg))?;
    let last = masses_kg.iter().rposition(|mass_kg| lands(*mass_kg))?;
    let edge_kg = |inside: usize, outside: Option<usize>| {
        let mut inside_kg = masses_kg[inside];
        let Some(mut outside_kg) = outside.and_then(|outside| masses_kg.get(outside).copied()) else {
            return inside_kg;
        };
        for _ in 0..SECTIONS {
            let middle_kg = 0.5 * (inside_kg + outside_kg);
            *(if lands(middle_kg) { &mut inside_kg } else { &mut outside_kg }) = middle_kg;
        }
        inside_kg
    };
    Some([edge_kg(first, first.checked_sub(1)), edge_kg(last, Some(last + 1))])
}

fn grid(least_kg: f64, most_kg: f64) -> Vec<f64> {
    let mut masses_kg = Vec::new();
    let mut mass_kg = least_kg;
    while mass_kg < most_kg {
        masses_kg.push(mass_kg);
        mass_kg *= MASS_STEP;
    }
    if most_kg >= least_kg {
        masses_kg.push(most_kg);
    }
    masses_kg
}

/// The speeds at which the thrust may begin, m/s.
fn speeds_m_s(pairing: &Pairing<'_>, fall: &Fall, onset: &Onset<'_>) -> Vec<f64> {
    match pairing.limits.start {
        StartHeight::Exactly(start_m) => vec![agreed_m_s(fall, onset, start_m)],
        StartHeight::AtMost(_) if pairing.mission.start.at == StartPoint::Drone => {
            DROPS_S.map(|fallen_s| fall.speed_after_m_s(fallen_s)).to_vec()
        }
        StartHeight::AtMost(_) => {
            let least_m_s = fall.speed_after_m_s(pairing.mission.ignition.arm_before_s + STEERING_S);
            let shares = SPEED_SHARES.map(|share| share * fall.terminal_m_s);
            let fast = shares.into_iter().filter(|speed_m_s| *speed_m_s > least_m_s);
            core::iter::once(least_m_s).chain(fast).collect()
        }
    }
}

/// The speed at the first thrust after a start at a height, m/s, where guidance lets the thrust begin at that speed.
fn agreed_m_s(fall: &Fall, onset: &Onset<'_>, start_m: f64) -> f64 {
    let mut speed_m_s = fall.speed_m_s(start_m, 0.2 * start_m);
    for _ in 0..ROUNDS {
        let Some(onset_m) = onset.chosen_m(speed_m_s) else { break };
        speed_m_s = 0.5 * (speed_m_s + fall.speed_m_s(start_m, onset_m));
    }
    speed_m_s
}

/// The best landing among the possible masses.
pub(crate) fn best(pairing: &Pairing<'_>, landing_kg: [f64; 2]) -> Result<Choice, Obstacle> {
    let [least_kg, most_kg] = pairing.limits.masses_kg;
    let masses_kg = grid(least_kg, most_kg);
    let mut best: Option<(Place, usize)> = None;
    let mut needed_m = f64::INFINITY;
    for (index, mass_kg) in masses_kg.iter().enumerate() {
        match place_at(pairing, *mass_kg) {
            Tried::Lands(place) => {
                if best.as_ref().is_none_or(|(best, _)| place.scatter > best.scatter + BETTER) {
                    best = Some((place, index));
                }
            }
            Tried::TooLow(start_m) => needed_m = needed_m.min(start_m),
            Tried::Nothing => {}
        }
    }
    let Some((place, index)) = best else {
        return Err(match pairing.limits.start {
            StartHeight::AtMost(most_m) if needed_m.is_finite() => Obstacle::Height { needed_m, most_m },
            _ => Obstacle::Mass { possible_kg: pairing.limits.masses_kg },
        });
    };
    let around = |index: usize| masses_kg[index.min(masses_kg.len() - 1)];
    let place = golden(pairing, place, [around(index.saturating_sub(1)), around(index + 1)]);
    finished(pairing, &place, landing_kg).ok_or(Obstacle::Mass { possible_kg: pairing.limits.masses_kg })
}

/// A mass, and the best speed for it.
struct Place {
    mass_kg: f64,
    speed_m_s: f64,
    scatter: f64,
}

/// What a mass came to.
enum Tried {
    Lands(Place),
    /// It lands from a higher start only, m.
    TooLow(f64),
    Nothing,
}

fn place_at(pairing: &Pairing<'_>, mass_kg: f64) -> Tried {
    let Ok(Weighed { onset, fall, .. }) = pairing.weighed(mass_kg) else { return Tried::Nothing };
    let mut best: Option<Place> = None;
    let mut needed_m = f64::INFINITY;
    for speed_m_s in speeds_m_s(pairing, &fall, &onset) {
        if !onset.lands(speed_m_s) {
            continue;
        }
        if let StartHeight::AtMost(most_m) = pairing.limits.start {
            let onset_m = onset.chosen_m(speed_m_s).unwrap_or_default();
            let Some(start_m) = fall.start_height_m(onset_m, speed_m_s) else { continue };
            if start_m > most_m {
                needed_m = needed_m.min(start_m);
                continue;
            }
        }
        let scatter = onset.scatter(speed_m_s);
        if best.as_ref().is_none_or(|best| scatter > best.scatter) {
            best = Some(Place { mass_kg, speed_m_s, scatter });
        }
    }
    match best {
        Some(place) => Tried::Lands(place),
        None if needed_m.is_finite() => Tried::TooLow(needed_m),
        None => Tried::Nothing,
    }
}

/// The best mass between two, kg, around a good one.
fn golden(pairing: &Pairing<'_>, good: Place, range_kg: [f64; 2]) -> Place {
    let mut best = good;
    let Ok(_) = golden_section(range_kg, 2 + SECTIONS, |mass_kg| {
        let Tried::Lands(place) = place_at(pairing, mass_kg) else { return Ok::<_, Infallible>(0.0) };
        let scatter = place.scatter;
        if scatter > best.scatter {
            best = place;
        }
        Ok(-scatter)
    });
    best
}

fn finished(pairing: &Pairing<'_>, place: &Place, landing_kg: [f64; 2]) -> Option<Choice> {
    let [least_kg, most_kg] = pairing.limits.masses_kg;
    // A team weighs to a gram.
    let rounded_kg = libm::round(place.mass_kg * 1e3) / 1e3;
    let is_end = place.mass_kg <= least_kg || place.mass_kg >= most_kg;
    let mass_kg = if is_end { place.mass_kg } else { rounded_kg.clamp(least_kg, most_kg) };
    let Weighed { mass, ballast, onset, fall } = pairing.weighed(mass_kg).ok()?;
    let window = onset.window(place.speed_m_s)?;
    let start_height_m = match pairing.limits.start {
        StartHeight::Exactly(start_m) => start_m,
        // To a metre, upwards: from higher it is hardly faster.
        StartHeight::AtMost(most_m) => {
            libm::ceil(fall.start_height_m(window.onset_m, place.speed_m_s)?).min(most_m)
        }
    };
    Some(Choice { mass, ballast, start_height_m, window, landing_kg })
}
