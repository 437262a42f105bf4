//! The landing card: what a team takes to the field for one mission, as it is loaded; one side of it is for the [`range_safety`]
//! officer.
//!
//! It is computed, not looked up: the mission is flown in several winds in every way in which a flight can end, and at other masses.

pub mod range_safety;
mod sheet;

use flight::vehicle::mission::StartPoint;
use sim::recipe::Recipe;

pub use self::sheet::escaped;
use crate::frame::{Frame, FrameError, changed};
use crate::hazard::{self, Flights, HazardError, Impact, Rule, landed_as_planned};
use crate::row::Row;
use crate::run::{RunError, fly};
use crate::statistics::Landings;
use crate::summary::failures;

/// What a card is made for.
pub struct Order<'a> {
    pub recipe: &'a Recipe,
    /// How a vehicle and its station show the mission's text.
    pub hash: &'a str,
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
}

/// Why there is no card.
#[derive(Debug, thiserror::Error)]
pub enum CardError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// No flight landed.
    #[error(
        "none of {flights} flights of `{set}` landed; most frequent reason: {reason}; `onboard-sim check` says \
         what to change"
    )]
    NoneLanded { flights: u64, set: String, reason: String },
    #[error("no wind is given")]
    NoWind,
    #[error(transparent)]
    Fly(#[from] RunError),
    #[error("where it comes down")]
    Hazard(#[from] HazardError),
}

impl Card {
    /// Computes a card.
    ///
    /// # Errors
    /// The vehicle does not land, or what was asked for cannot be had.
    pub fn new(order: &Order<'_>, told: &(dyn Fn(usize, usize) + Sync)) -> Result<Self, CardError> {
        let recipe = order.recipe;
        let days = order.winds.iter().map(|day| day.flies(recipe)).collect::<Result<Vec<_>, _>>()?;
        let calmest = days.first().ok_or(CardError::NoWind)?;
        refuse_without_a_landing(calmest, told)?;
        let impacts = hazard::studies(&days, order.flights, told)?;
        let own = impacts
            .first()
            .map_or_else(|| Landings::of(core::iter::empty()), |impacts| landed_as_planned(impacts));
        Ok(Self {
            recipe: recipe.clone(),
            hash: order.hash.to_owned(),
            start: calmest.mission.start.at,
            flown: order.winds.iter().map(|day| day.wind_m_s).zip(impacts).collect(),
            masses: masses(calmest, own, order.flights.survey, told)?,
            flights: order.flights,
            rule: Rule::of(&calmest.mission),
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
fn refuse_without_a_landing(recipe: &Recipe, told: &(dyn Fn(usize, usize) + Sync)) -> Result<(), CardError> {
    const FIRST: u64 = 12;
    told(0, FIRST as usize);
    let rows = fly(recipe, FIRST, &|done| told(done, FIRST as usize))?;
    if rows.iter().any(|row| row.stands) {
        return Ok(());
    }
    let reason =
        failures(&rows).into_iter().next().map_or_else(|| "unknown".to_owned(), |failure| failure.reason);
    Err(CardError::NoneLanded { flights: FIRST, set: recipe.dispersion_name.clone(), reason })
}

/// How many land at the mission's own mass and at others, on each side up to the first at which fewer than nine of ten do. Ballast is
/// at the centre of gravity.
fn masses(
    recipe: &Recipe,
    own: Landings,
    flights: u64,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<(f64, Landings)>, CardError> {
    /// Between neighbours, of the own mass, and most of them on each side.
    const STEP: f64 = 0.02;
    const STEPS: i32 = 10;
    let airframe = &recipe.mission.airframe;
    let (frame, own_kg) = (Frame::of(&recipe.mission)?, airframe.mass.loaded_kg);
    let mut found = vec![(own_kg, own)];
    for side in [-1, 1] {
        let mut share = own.stands.share;
        for step in 1..=STEPS {
            let mass = frame.with(&recipe.mission.motor_curve, f64::from(side * step) * STEP * own_kg);
            let Ok(other) = changed(recipe, &airframe.motor, &mass) else { break };
            if share < NINE_OF_TEN {
                break;
            }
            let rows = fly(&other, flights, &|done| told(done, flights as usize))?;
            let landings = Landings::of(rows.iter().map(Row::landing));
            share = landings.stands.share;
            found.push((mass.loaded_kg, landings));
        }
    }
    found.sort_by(|one, two| one.0.total_cmp(&two.0));
    Ok(found)
}

/// A mass at which so many land is one to fly with.
pub(super) const NINE_OF_TEN: f64 = 0.9;
