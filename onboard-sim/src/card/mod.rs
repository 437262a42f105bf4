//! The landing card: what a team takes to the field for one mission, as it is loaded; one side of
//! it is for the [`range_safety`] officer.
//!
//! It is computed, not looked up: the mission is flown in several winds, in every case of a
//! flight, and at other masses.

pub mod range_safety;
mod sheet;

use flight::vehicle::mission::StartPoint;
use protocol::mission::MissionHash;
use sim::recipe::{Recipe, RecipeError};
use sim::world::wind::aloft::WindsAloft;

pub use self::sheet::escaped;
use crate::frame::{Frame, FrameError, changed};
use crate::hazard::{self, Flights, Impact, Rule, landed_as_planned};
use crate::row::Row;
use crate::run::{RunError, fly};
use crate::statistics::Landings;
use crate::summary::failures;

/// A card.
#[derive(Debug, Clone)]
pub struct Card {
    /// With the mission that was given.
    pub recipe: Recipe,
    /// Where the flights begin: on the pad if the mission has a booster.
    start: StartPoint,
    /// The mean winds 10 m above the ground, rising, m/s, and where the flights in each came down.
    pub flown: Vec<(f64, Vec<Impact>)>,
    /// How flights land in the least wind, by mass with the motor full, kg, rising.
    pub masses: Vec<(f64, Landings)>,
    flights: Flights,
    rule: Rule,
    wind_from_deg: Option<f64>,
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
    /// The mission lacks the data of its start.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
}

impl Card {
    /// Computes the card of a recipe from its flights in each mean wind, m/s, rising.
    /// `wind_from_deg` is the direction of the wind on the day, degrees clockwise from north, if
    /// available.
    ///
    /// # Errors
    /// The vehicle does not land, or the request cannot be met.
    pub fn new(
        recipe: &Recipe,
        winds: Vec<(f64, Recipe)>,
        flights: Flights,
        wind_from_deg: Option<f64>,
        show: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, CardError> {
        let from_the_pad = recipe.mission.launch.is_some() && recipe.mission.start.at == StartPoint::Apogee;
        let (winds_m_s, days): (Vec<f64>, Vec<Recipe>) = winds.into_iter().unzip();
        let begin = |day: Recipe| if from_the_pad { day.starting_at(StartPoint::Pad) } else { Ok(day) };
        let days = days.into_iter().map(begin).collect::<Result<Vec<_>, _>>()?;
        let calmest = days.first().ok_or(CardError::NoWind)?;
        refuse_without_a_landing(calmest, show)?;
        let impacts = hazard::studies(&days, flights, show)?;
        let aloft = recipe.dispersion.winds_aloft.as_ref();
        let nominal = landed_as_planned(impacts.first().map_or(&[], Vec::as_slice));
        Ok(Self {
            recipe: recipe.clone(),
            start: calmest.mission.start.at,
            flown: winds_m_s.into_iter().zip(impacts).collect(),
            masses: masses(calmest, nominal, flights.survey, show)?,
            flights,
            rule: Rule::of(&calmest.mission),
            wind_from_deg: wind_from_deg.or(aloft.map(WindsAloft::from_deg)),
        })
    }

    /// How a vehicle and its station show the mission's text.
    fn hash(&self) -> String {
        MissionHash::of(&self.recipe.mission_toml).to_string()
    }
}

/// Some flights, before many are flown.
fn refuse_without_a_landing(recipe: &Recipe, show: &(dyn Fn(usize, usize) + Sync)) -> Result<(), CardError> {
    const FIRST: u64 = 12;
    show(0, FIRST as usize);
    let rows = fly(recipe, FIRST, &|done| show(done, FIRST as usize))?;
    if rows.iter().any(|row| row.stands) {
        return Ok(());
    }
    let reason = failures(&rows).into_iter().next().map_or_else(|| "unknown".to_owned(), |most| most.reason);
    Err(CardError::NoneLanded { flights: FIRST, set: recipe.dispersion_name.clone(), reason })
}

/// Landing rates at the mission's mass and at others, on each side up to the first at which fewer
/// than nine of ten land. Ballast is at the centre of gravity.
fn masses(
    recipe: &Recipe,
    nominal: Landings,
    flights: u64,
    show: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<(f64, Landings)>, CardError> {
    /// Between neighbours, as a share of the nominal mass, and most of them on each side.
    const STEP: f64 = 0.02;
    const STEPS: i32 = 10;
    let airframe = &recipe.mission.airframe;
    let (frame, nominal_kg) = (Frame::of(&recipe.mission)?, airframe.mass.loaded_kg);
    let mut found = vec![(nominal_kg, nominal)];
    for side in [-1, 1] {
        let mut share = nominal.stands.share;
        for step in 1..=STEPS {
            let mass = frame.with(&recipe.mission.motor_curve, f64::from(side * step) * STEP * nominal_kg);
            let Ok(other) = changed(recipe, &airframe.motor, &mass) else { break };
            if share < NINE_OF_TEN {
                break;
            }
            let rows = fly(&other, flights, &|done| show(done, flights as usize))?;
            let landings = Landings::of(rows.iter().map(Row::landing));
            share = landings.stands.share;
            found.push((mass.loaded_kg, landings));
        }
    }
    found.sort_by(|one, two| one.0.total_cmp(&two.0));
    Ok(found)
}

/// Landing rate from which a mass is suitable.
const NINE_OF_TEN: f64 = 0.9;
