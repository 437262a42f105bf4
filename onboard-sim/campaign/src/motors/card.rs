//! The landing card: what a team takes to the field for one vehicle and one motor.
//!
//! It is computed, not looked up: the mass and the height are chosen or checked, the mission is flown in several winds in every way
//! in which a flight can end, and what cannot land is refused with the bound that says so and the nearest vehicle that lands.

use core::fmt;

use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::recipe::Recipe;

use super::choice::{Choice, Limits, Refusal, StartHeight, Team, choose};
use super::frame::{Ballast, Frame, FrameError, start_height_m};
use super::ranking::{FlyError, Landing, Progress, RankError, fly};
use super::sheet;
use super::source::{Candidate, Found};
use crate::attainable;
use crate::hazard::{self, Flights, HazardError, Impact, Rule};
use crate::run::in_parallel;

/// What a card is made for.
pub struct Order<'a> {
    pub team: &'a Team,
    pub motor: &'a Candidate,
    /// Motors to suggest if this one cannot land.
    pub others: &'a [Found],
    /// Mass with the motor full, kg; the best one within the ballast if not given.
    pub mass_kg: Option<f64>,
    /// Mean winds, rising.
    pub winds: &'a [Day],
    /// Flights in each wind.
    pub flights: Flights,
    /// Where the wind of the day comes from, degrees clockwise from north, if it is known.
    pub wind_from_deg: Option<f64>,
}

/// A card.
#[derive(Debug, Clone)]
pub struct Card {
    /// With the mission to be loaded.
    pub recipe: Recipe,
    /// Where the flights begin: on the pad if the mission has a booster.
    pub(super) start: StartPoint,
    pub(super) landing: Landing,
    pub(super) frame: Frame,
    /// The mean winds, rising, m/s, and where the flights in each came down.
    pub flown: Vec<(f64, Vec<Impact>)>,
    pub(super) flights: Flights,
    pub(super) rule: Rule,
    pub(super) wind_from_deg: Option<f64>,
    /// Command heights of the feet from which a controller that knows everything would land.
    pub(super) attainable: Option<attainable::Window>,
}

/// Why there is no card.
#[derive(Debug, thiserror::Error)]
pub enum CardError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The mass cannot be had.
    #[error(
        "--mass {mass_kg}: the airframe without its motor weighs {frame_kg:.3} kg and the motor {motor_kg:.3} kg; \
         {least_kg:.3} to {most_kg:.3} kg is accepted, or another --ballast (below zero for what can be taken out)"
    )]
    Mass { mass_kg: f64, frame_kg: f64, motor_kg: f64, least_kg: f64, most_kg: f64 },
    /// No landing exists.
    #[error(transparent)]
    NoLanding(#[from] Box<NoLanding>),
    /// A landing exists, but no flight landed.
    #[error(
        "a landing exists, but none of {flights} flights of `{set}` landed; most frequent reason: {reason}. A motor or mass with \
         a larger scatter is wanted: `onboard-sim motors` ranks them"
    )]
    NoneLanded { flights: u64, set: String, reason: String },
    #[error("no wind is given")]
    NoWind,
    #[error(transparent)]
    Text(#[from] RankError),
    #[error(transparent)]
    Fly(#[from] FlyError),
    #[error("where it comes down")]
    Hazard(#[from] HazardError),
}

impl Card {
    /// Computes a card.
    ///
    /// # Errors
    /// The vehicle does not land, or the mass cannot be had.
    pub fn new(order: &Order<'_>, progress: &(dyn Fn(Progress) + Sync)) -> Result<Self, CardError> {
        let mission = &order.team.recipe.mission;
        let frame = Frame::of(mission)?;
        let limits = order.limits(&frame)?;
        let choice = match choose(mission, &frame, &order.motor.curve, &limits) {
            Ok(choice) => choice,
            Err(refusal) => {
                return Err(Box::new(no_landing(order, &frame, &limits, refusal, progress)).into());
            }
        };
        let landing = Landing { candidate: order.motor.clone(), choice, flown: None };
        let recipe = landing.recipe(&order.team.recipe)?;
        let days = order.winds.iter().map(|day| day.flies(&recipe)).collect::<Result<Vec<_>, _>>()?;
        let calmest = days.first().ok_or(CardError::NoWind)?;
        refuse_without_a_landing(calmest, progress)?;
        let (start, rule) = (calmest.mission.start.at, Rule::of(&calmest.mission));
        let told = |done, of| progress(Progress::Flights(done, of));
        let impacts = hazard::studies(&days, order.flights, &told)?;
        Ok(Self {
            attainable: certified_window(&recipe.mission),
            recipe,
            start,
            landing,
            frame,
            flown: order.winds.iter().map(|day| day.wind_m_s).zip(impacts).collect(),
            flights: order.flights,
            rule,
            wind_from_deg: order.wind_from_deg,
        })
    }

    /// The card as text.
    pub fn text(&self) -> String {
        sheet::text(&self.sides())
    }

    /// The card as HTML: two pages, for the two sides of a sheet.
    pub fn html(&self) -> String {
        sheet::html(&self.sides())
    }
}

/// What a controller that knows everything could do with the certified vehicle and motor in still air.
pub(crate) fn certified_window(mission: &Mission) -> Option<attainable::Window> {
    let drawn = draw(mission, &Dispersion::default(), 0, 0);
    let mut fell_from = drawn.apogee;
    if mission.start.at == StartPoint::Drone {
        fell_from.position_m.z = start_height_m(mission);
        fell_from.velocity_m_s.z = 0.0;
    }
    attainable::window(mission, &drawn, &fell_from)
}

impl Order<'_> {
    fn limits(&self, frame: &Frame) -> Result<Limits, CardError> {
        let curve = &self.motor.curve;
        let limits = self.team.limits(frame, curve);
        let [least_kg, most_kg] = limits.masses_kg;
        if let Some(mass_kg) = self.mass_kg {
            // Scales show grams.
            if !(least_kg - 5e-4..=most_kg + 5e-4).contains(&mass_kg) {
                let (frame_kg, motor_kg) = (frame.mass_kg(), curve.total_mass_kg());
                return Err(CardError::Mass { mass_kg, frame_kg, motor_kg, least_kg, most_kg });
            }
        }
        Ok(Limits { masses_kg: self.mass_kg.map_or(limits.masses_kg, |mass_kg| [mass_kg; 2]), ..limits })
    }
}

/// A mean wind and the flights in it.
#[derive(Debug, Clone)]
pub struct Day {
    /// Mean wind 10 m above the ground, m/s.
    pub wind_m_s: f64,
    pub recipe: Recipe,
}

impl Day {
    /// The flights of a card's mission on this day, from its pad if it has a booster.
    fn flies(&self, recipe: &Recipe) -> Result<Recipe, HazardError> {
        let Recipe { mission, mission_toml, .. } = recipe.clone();
        let from_the_pad = mission.launch.is_some() && mission.start.at == StartPoint::Apogee;
        let recipe = Recipe { mission, mission_toml, ..self.recipe.clone() };
        Ok(if from_the_pad { recipe.starting_at(StartPoint::Pad)? } else { recipe })
    }
}

/// Some flights, before many are flown.
fn refuse_without_a_landing(recipe: &Recipe, progress: &(dyn Fn(Progress) + Sync)) -> Result<(), CardError> {
    const FIRST: u64 = 12;
    progress(Progress::Flights(0, FIRST as usize));
    let flown = fly(&[recipe], FIRST, &|done| progress(Progress::Flights(done, FIRST as usize)))?;
    flown.into_iter().filter(|flown| flown.legs.count == 0).try_for_each(|flown| {
        let reason = flown.failure.map_or_else(|| "unknown".to_owned(), |(reason, _)| reason);
        Err(CardError::NoneLanded { flights: FIRST, set: flown.set, reason })
    })
}

/// Motors that are suggested.
const MOST: usize = 3;

/// No landing exists.
#[derive(Debug, thiserror::Error)]
pub struct NoLanding {
    motor: String,
    refusal: Refusal,
    bound: String,
    /// The mass at which the airframe lands best on the motor, and how much heavier it is without any ballast, kg.
    other_mass: Option<(Choice, f64)>,
    /// Motors on which it lands at this mass, with the mass and the scatter.
    other_motors: Vec<(String, f64, f64)>,
}

impl fmt::Display for NoLanding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.motor, self.refusal)?;
        write!(f, "\n  bound: {}", self.bound)?;
        match &self.other_mass {
            Some((choice, excess_kg)) => {
                let mass_kg = choice.mass.loaded_kg;
                write!(f, "\n  nearest mass on this motor: {mass_kg:.3} kg")?;
                write!(f, " from {:.0} m, scatter {:.2}", choice.start_height_m, choice.window.scatter)?;
                if *excess_kg > 0.0 {
                    write!(f, "; airframe and motor weigh {excess_kg:.3} kg more than that")?;
                }
            }
            None => write!(f, "\n  no mass lands on this motor")?,
        }
        if self.other_motors.is_empty() {
            return write!(f, "\n  none of the other motors lands either; --from gives more to choose from");
        }
        write!(f, "\n  nearest motors:")?;
        for (name, mass_kg, scatter) in &self.other_motors {
            write!(f, "\n    {name} at {mass_kg:.3} kg, scatter {scatter:.2}")?;
        }
        Ok(())
    }
}

fn no_landing(
    order: &Order<'_>,
    frame: &Frame,
    limits: &Limits,
    refusal: Refusal,
    progress: &(dyn Fn(Progress) + Sync),
) -> NoLanding {
    let curve = &order.motor.curve;
    let without_kg = frame.mass_kg() + curve.total_mass_kg();
    let other_mass = refusal.landing_kg.and_then(|landing_kg| {
        let limits = Limits { masses_kg: landing_kg, ..*limits };
        let choice = choose(&order.team.recipe.mission, frame, curve, &limits).ok()?;
        let excess_kg = without_kg - choice.mass.loaded_kg;
        Some((choice, excess_kg))
    });
    let bound = bound(order, frame, limits);
    let other_motors = other_motors(order, frame, limits, progress);
    let motor = format!("{} ({})", order.motor.name(), order.motor.origin);
    NoLanding { motor, refusal, bound, other_mass, other_motors }
}

/// What a controller that knows everything could do.
fn bound(order: &Order<'_>, frame: &Frame, limits: &Limits) -> String {
    /// Starts tried, as shares of the highest.
    const SHARES: [f64; 4] = [1.0, 0.7, 0.45, 0.25];
    let curve = &order.motor.curve;
    let mass_kg = limits.masses_kg[0];
    let ballast = Ballast {
        mass_kg: mass_kg - frame.mass_kg() - curve.total_mass_kg(),
        station_m: limits.ballast_station_m,
    };
    let mass = match frame.with(curve, ballast) {
        Ok(mass) => mass,
        Err(error) => return error.to_string(),
    };
    let heights_m: Vec<f64> = match limits.start {
        StartHeight::Exactly(height_m) => vec![height_m],
        StartHeight::AtMost(height_m) => SHARES.map(|share| share * height_m).to_vec(),
    };
    for height_m in &heights_m {
        let mut mission = order.team.recipe.mission.clone();
        mission.airframe.mass = mass;
        mission.motor_curve = curve.clone();
        mission.start.height_m = *height_m;
        if let Some(drop) = &mut mission.drop {
            drop.height_m = *height_m;
        }
        if let Some(window) = certified_window(&mission) {
            return format!(
                "a controller that knows everything lands {mass_kg:.3} kg from {height_m:.0} m if it commands the \
                 ignition at {:.1} to {:.1} m, but guidance, which keeps a reserve of tilt, finds no height for it",
                window.low_m, window.high_m
            );
        }
    }
    let from: Vec<String> = heights_m.iter().map(|height_m| format!("{height_m:.0}")).collect();
    format!(
        "not even a controller that knows everything and may light the motor at any height lands {mass_kg:.3} kg (starts \
         from {} m)",
        from.join(", ")
    )
}

/// The best other motors for this mass, or for this ballast if there is no mass.
fn other_motors(
    order: &Order<'_>,
    frame: &Frame,
    limits: &Limits,
    progress: &(dyn Fn(Progress) + Sync),
) -> Vec<(String, f64, f64)> {
    let others: Vec<&Candidate> = order
        .others
        .iter()
        .filter_map(|found| found.as_ref().ok())
        .filter(|other| other.curve != order.motor.curve)
        .collect();
    progress(Progress::Motors(0, others.len()));
    let chosen = in_parallel(
        &others,
        |other| {
            let possible_kg = order.team.limits(frame, &other.curve).masses_kg;
            let masses_kg = order.mass_kg.map_or(possible_kg, |mass_kg| [mass_kg; 2]);
            // With the least ballast it weighs more than this mass.
            if masses_kg[0] < possible_kg[0] - 5e-4 {
                return None;
            }
            choose(&order.team.recipe.mission, frame, &other.curve, &Limits { masses_kg, ..*limits }).ok()
        },
        &|done| progress(Progress::Motors(done, others.len())),
    );
    let mut landings: Vec<(String, f64, f64)> = others
        .iter()
        .zip(chosen)
        .filter_map(|(other, choice)| {
            let choice = choice?;
            Some((other.name(), choice.mass.loaded_kg, choice.window.scatter))
        })
        .collect();
    landings.sort_by(|one, two| two.2.total_cmp(&one.2));
    landings.truncate(MOST);
    landings
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bound with perfect information encloses the height that guidance chooses (16 m, from which 977 of 1,000 land).
    #[test]
    fn the_bound_of_a_drop_is_that_of_its_own_height() {
        let mission = flight::vehicles::mission::builtin("vlr").unwrap().unwrap();
        let bound = certified_window(&mission).unwrap();
        assert!(bound.low_m < 18.0 && 18.0 < bound.high_m && bound.high_m < 28.0, "{bound:?}");
    }
}
