//! The landing card: what a team takes to the field for one mission, as it is loaded; one side of
//! it is for the [`range_safety`] officer.
//!
//! It is computed, not looked up: the mission is flown in several winds, in every case of a
//! flight, and at other masses.

pub mod range_safety;
mod sheet;

use flight::vehicle::mission::StartPoint;
use protocol::mission::MissionHash;
use serde_json::{Value, json};
use sim::recipe::{Recipe, RecipeError};
use sim::world::wind::aloft::WindsAloft;

use self::range_safety::{in_winds, limit_m_s};
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
        refuse_without_a_landing(calmest)?;
        let at_masses = 2 * MOST_MASSES * flights.survey as usize;
        show(0, at_masses);
        let impacts = hazard::studies(&days, flights, &|done, of| show(done, of + at_masses))?;
        let before: usize = impacts.iter().map(Vec::len).sum();
        let show = |done| show(before + done, before + at_masses);
        let aloft = recipe.dispersion.winds_aloft.as_ref();
        let nominal = landed_as_planned(impacts.first().map_or(&[], Vec::as_slice));
        Ok(Self {
            recipe: recipe.clone(),
            start: calmest.mission.start.at,
            flown: winds_m_s.into_iter().zip(impacts).collect(),
            masses: masses(calmest, nominal, flights.survey, &show)?,
            flights,
            rule: Rule::of(&calmest.mission),
            wind_from_deg: wind_from_deg.or(aloft.map(WindsAloft::from_deg)),
        })
    }

    /// The numbers of the card as JSON.
    pub fn json(&self) -> Value {
        let judged = in_winds(&self.flown, &self.rule);
        let winds = self.flown.iter().zip(&judged).map(|((wind_m_s, impacts), judged)| {
            let mut wind = hazard::json(*wind_m_s, impacts, &self.rule);
            // As on the card: never less than in less wind.
            wind["exclusion_m"] = json!(judged.circle.map(|circle| circle.exclusion_m));
            wind
        });
        let (winds, recipe) = (winds.collect::<Vec<_>>(), &self.recipe);
        json!({
            "mission": recipe.mission.name, "hash": self.hash(), "start": self.start.name(), "winds": winds,
            "dispersion": recipe.dispersion_name, "seed": recipe.seed, "limit_m_s": limit_m_s(&judged),
            "rule_m": self.rule.distance_m(), "masses_kg": self.masses,
        })
    }

    /// How a vehicle and its station show the mission's text.
    fn hash(&self) -> String {
        MissionHash::of(&self.recipe.mission_toml).to_string()
    }
}

/// Some flights, before many are flown.
fn refuse_without_a_landing(recipe: &Recipe) -> Result<(), CardError> {
    const FIRST: u64 = 12;
    let rows = fly(recipe, 0..FIRST, &|_| ())?;
    if rows.iter().any(|row| row.stands) {
        return Ok(());
    }
    let reason = failures(&rows).into_iter().next().map_or_else(|| "unknown".to_owned(), |most| most.reason);
    Err(CardError::NoneLanded { flights: FIRST, set: recipe.dispersion_name.clone(), reason })
}

/// Between neighbouring masses, as a share of the nominal mass, and the steps on each side.
const STEP: f64 = 0.02;
const STEPS: u32 = 10;
/// Most masses flown on a side: the farthest, and the halvings of the steps before it.
const MOST_MASSES: usize = 5;

/// Landing rates at the mission's mass and, on each side, at the farthest at which nine of ten land
/// and the nearest at which fewer do. The rate only falls with the distance: the farthest mass is
/// flown first, and the steps before it are halved. Ballast is at the centre of gravity.
fn masses(
    recipe: &Recipe,
    nominal: Landings,
    flights: u64,
    show: &(dyn Fn(usize) + Sync),
) -> Result<Vec<(f64, Landings)>, CardError> {
    let airframe = &recipe.mission.airframe;
    let (frame, nominal_kg) = (Frame::of(&recipe.mission)?, airframe.mass.loaded_kg);
    let mut found = vec![(nominal_kg, nominal)];
    let (mut flown, most) = (0, 2 * MOST_MASSES * flights as usize);
    let going_on = |flown: usize| show(flown.min(most.saturating_sub(1)));
    for side in [-1.0, 1.0] {
        if nominal.stands.share < NINE_OF_TEN {
            break;
        }
        let (mut good, mut bad) = ((0, None), (STEPS + 1, None));
        while bad.0 - good.0 > 1 {
            let step = if bad.0 > STEPS { STEPS } else { good.0.midpoint(bad.0) };
            let mass = frame.with(&recipe.mission.motor_curve, side * f64::from(step) * STEP * nominal_kg);
            let landings = match changed(recipe, &airframe.motor, &mass) {
                Ok(other) => Some(decided(&other, flights, &|done| going_on(flown + done))?),
                Err(_) => None,
            };
            flown += flights as usize;
            going_on(flown);
            let at = landings.map(|landings| (mass.loaded_kg, landings));
            let lands = landings.is_some_and(|landings| landings.stands.share >= NINE_OF_TEN);
            *(if lands { &mut good } else { &mut bad }) = (step, at);
        }
        found.extend([good.1, bad.1].into_iter().flatten());
    }
    show(most);
    found.sort_by(|one, two| one.0.total_cmp(&two.0));
    Ok(found)
}

/// Flies until it is decided whether nine of ten land: until 0.9 is outside of the interval of the
/// rate, which is valid at every look, or so many flights are flown.
fn decided(recipe: &Recipe, flights: u64, done: &(dyn Fn(usize) + Sync)) -> Result<Landings, CardError> {
    /// Flights before the first look. Each further look is at twice as many.
    const FIRST: u64 = 25;
    let looks = 1 + flights.div_ceil(FIRST).next_power_of_two().ilog2();
    let mut rows = Vec::new();
    loop {
        let from = rows.len() as u64;
        let to = flights.min(FIRST.max(2 * from));
        rows.extend(fly(recipe, from..to, &|flown| done(from as usize + flown))?);
        let landings = Landings::of(rows.iter().map(Row::landing)).at_looks(looks);
        let open = (landings.stands.low..=landings.stands.high).contains(&NINE_OF_TEN);
        if to == flights || !open {
            return Ok(landings);
        }
    }
}

/// Landing rate from which a mass is suitable.
const NINE_OF_TEN: f64 = 0.9;
