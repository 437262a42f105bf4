//! The landing card: what a team takes to the field for one mission, as it is loaded.
//!
//! It is computed, not looked up: the mission is flown in several winds in every way in which a flight can end, and at other masses.
//! Another mass or motor is a mission of its own, proposed at the end.

use flight::vehicle::airframe::Mass;
use flight::vehicle::mission::StartPoint;
use sim::recipe::Recipe;

use super::choice::{Limits, Refusal, Team, choose};
use super::frame::{Ballast, Changes, Frame, FrameError, changed};
use super::ranking::{FlyError, Landing, Progress, RankError, fly};
use super::sheet;
use super::source::Candidate;
use crate::hazard::{self, Flights, HazardError, Impact, Rule, landed_as_planned};
use crate::statistics::Landings;

/// What a card is made for.
pub struct Order<'a> {
    pub team: &'a Team,
    /// How a vehicle and its station show the mission's text.
    pub hash: &'a str,
    /// Of the proposal.
    pub motor: &'a Candidate,
    /// Of the proposal, with the motor full, kg; the best one within the ballast if not given.
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
    /// With the mission that was given.
    pub recipe: Recipe,
    pub(super) hash: String,
    /// Where the flights begin: on the pad if the mission has a booster.
    pub(super) start: StartPoint,
    /// The mean winds, rising, m/s, and where the flights in each came down.
    pub flown: Vec<(f64, Vec<Impact>)>,
    /// How flights land in the least wind, by mass with the motor full, kg, rising.
    pub masses: Vec<(f64, Landings)>,
    pub(super) flights: Flights,
    pub(super) rule: Rule,
    pub(super) wind_from_deg: Option<f64>,
    pub(super) proposal: Result<Landing, Refusal>,
    /// The mission of the proposal, if that is another one.
    pub proposed: Option<Recipe>,
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
    /// No flight landed.
    #[error(
        "none of {flights} flights of `{set}` landed; most frequent reason: {reason}. A motor or mass with a larger scatter is \
         wanted: `onboard-sim motors` ranks them"
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
    /// The vehicle does not land, or what was asked for cannot be had.
    pub fn new(order: &Order<'_>, progress: &(dyn Fn(Progress) + Sync)) -> Result<Self, CardError> {
        let recipe = &order.team.recipe;
        let (proposal, proposed) = order.proposal()?;
        let days = order.winds.iter().map(|day| day.flies(recipe)).collect::<Result<Vec<_>, _>>()?;
        let calmest = days.first().ok_or(CardError::NoWind)?;
        refuse_without_a_landing(calmest, progress)?;
        let told = |done, of| progress(Progress::Flights(done, of));
        let impacts = hazard::studies(&days, order.flights, &told)?;
        let own = impacts
            .first()
            .map_or_else(|| Landings::of(core::iter::empty()), |impacts| landed_as_planned(impacts));
        Ok(Self {
            recipe: recipe.clone(),
            hash: order.hash.to_owned(),
            start: calmest.mission.start.at,
            flown: order.winds.iter().map(|day| day.wind_m_s).zip(impacts).collect(),
            masses: masses(calmest, own, order.flights.survey, progress)?,
            flights: order.flights,
            rule: Rule::of(&calmest.mission),
            wind_from_deg: order.wind_from_deg,
            proposal,
            proposed,
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

impl Order<'_> {
    /// The best mass for the motor, or why there is none, and its mission if it is another one. Only what was asked for is refused.
    fn proposal(&self) -> Result<(Result<Landing, Refusal>, Option<Recipe>), CardError> {
        let recipe = &self.team.recipe;
        let (mission, curve) = (&recipe.mission, &self.motor.curve);
        let frame = Frame::of(mission)?;
        let is_other_motor = self.motor.motor != mission.airframe.motor;
        match choose(mission, &frame, curve, &self.limits(&frame)?) {
            Ok(choice) => {
                let is_other = is_other_motor || choice.mass != mission.airframe.mass;
                let landing = Landing { candidate: self.motor.clone(), choice, flown: None };
                let proposed = is_other.then(|| landing.recipe(recipe)).transpose()?;
                Ok((Ok(landing), proposed))
            }
            Err(refusal) if is_other_motor || self.mass_kg.is_some() => {
                let motor = format!("{} ({})", self.motor.name(), self.motor.origin);
                Err(CardError::NoLanding { motor, refusal: Box::new(refusal) })
            }
            Err(refusal) => Ok((Err(refusal), None)),
        }
    }

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
    flown.into_iter().filter(|flown| flown.landings.stands.count == 0).try_for_each(|flown| {
        let reason = flown.failure.map_or_else(|| "unknown".to_owned(), |(reason, _)| reason);
        Err(CardError::NoneLanded { flights: FIRST, set: flown.set, reason })
    })
}

/// How many land at the mission's own mass and at others, on each side up to the first at which fewer than nine of ten do. Ballast is
/// at the centre of gravity.
fn masses(
    recipe: &Recipe,
    own: Landings,
    flights: u64,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<(f64, Landings)>, CardError> {
    /// Between neighbours, of the own mass, and most of them on each side.
    const STEP: f64 = 0.02;
    const STEPS: i32 = 10;
    let (frame, own_kg) = (Frame::of(&recipe.mission)?, recipe.mission.airframe.mass.loaded_kg);
    let mut found = vec![(own_kg, own)];
    for side in [-1, 1] {
        let mut share = own.stands.share;
        for step in 1..=STEPS {
            let ballast_kg = f64::from(side * step) * STEP * own_kg;
            let ballast = Ballast { mass_kg: ballast_kg, station_m: frame.cg_station_m() };
            let Ok(mass) = frame.with(&recipe.mission.motor_curve, ballast) else { break };
            if share < NINE_OF_TEN {
                break;
            }
            let told = |done| progress(Progress::Flights(done, flights as usize));
            let flown = fly(&[&with_mass(recipe, mass)?], flights, &told)?;
            share = flown.first().map_or(0.0, |flown| flown.landings.stands.share);
            found.extend(flown.into_iter().map(|flown| (mass.loaded_kg, flown.landings)));
        }
    }
    found.sort_by(|one, two| one.0.total_cmp(&two.0));
    Ok(found)
}

/// A mass at which so many land is one to fly with.
pub(super) const NINE_OF_TEN: f64 = 0.9;

fn with_mass(recipe: &Recipe, mass: Mass) -> Result<Recipe, CardError> {
    let mission = &recipe.mission;
    let changes = Changes {
        name: &mission.name,
        summary: &mission.summary,
        motor: &mission.airframe.motor,
        keeps_lot: true,
        mass,
        start_height_m: mission.start_height_m(),
    };
    let text = changed(&recipe.mission_toml, &changes)
        .map_err(|source| RankError::Text { origin: mission.name.clone(), source })?;
    let mission = flight::vehicles::mission::from_toml(&text, &mission.name).map_err(RankError::from)?;
    Ok(Recipe { mission, mission_toml: text, ..recipe.clone() })
}
