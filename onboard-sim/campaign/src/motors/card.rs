//! The landing card: what a team takes to the field for one vehicle and one motor.
//!
//! It is computed, not looked up: the mass and the height are chosen or checked, the mission is flown in several winds in every way
//! in which a flight can end, and what cannot land is refused.

use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::recipe::Recipe;

use super::choice::{Limits, Refusal, Team, choose};
use super::frame::{Frame, FrameError, start_height_m};
use super::ranking::{FlyError, Landing, Progress, RankError, fly};
use super::sheet;
use super::source::Candidate;
use crate::attainable;
use crate::hazard::{self, Flights, HazardError, Impact, Rule};

/// What a card is made for.
pub struct Order<'a> {
    pub team: &'a Team,
    pub motor: &'a Candidate,
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
    #[error("{motor}: {refusal}; `onboard-sim motors` ranks those that it lands on")]
    NoLanding { motor: String, refusal: Box<Refusal> },
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
        let choice = choose(mission, &frame, &order.motor.curve, &limits).map_err(|refusal| {
            let motor = format!("{} ({})", order.motor.name(), order.motor.origin);
            CardError::NoLanding { motor, refusal: Box::new(refusal) }
        })?;
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
fn certified_window(mission: &Mission) -> Option<attainable::Window> {
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
