//! The flights of a card: in the wind of the day, in more wind, and of the certified vehicle in steady wind.

use campaign::hazard::{self, Flights, HazardError, Radius, Rule, Way};
use flight::vehicle::profile::StartPoint;
use sim::recipe::Recipe;

use super::{CardError, Order};
use crate::flown::{Flown, FlyError, Weather, fly_rows};

/// A mean wind and the flights in it.
#[derive(Debug, Clone)]
pub struct Day {
    /// Mean wind 10 m above the ground, m/s.
    pub wind_m_s: f64,
    pub weather: Weather,
}

/// What the flights came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Winds {
    pub today_m_s: f64,
    pub today: Flown,
    pub windier_m_s: f64,
    pub windier: Flown,
    /// Strongest steady wind, m/s, up to which the certified vehicle lands in every wind that was tried; `None` if in none.
    pub steady_m_s: Option<f64>,
    /// Strongest steady wind that was tried, m/s.
    pub steady_tried_m_s: f64,
}

impl Winds {
    /// The wind above which a team should not fly, m/s: the strongest that was flown, if the certified vehicle lands in
    /// it and not many fewer flights landed than in the wind of the day.
    pub fn limit_m_s(&self) -> f64 {
        /// Of the rate in the wind of the day.
        const KEPT: f64 = 0.9;
        let windier = self.windier.legs.share >= KEPT * self.today.legs.share;
        let flown_m_s = if windier { self.windier_m_s } else { self.today_m_s };
        flown_m_s.min(self.steady_m_s.unwrap_or(0.0))
    }
}

/// How near people may stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Hazard {
    /// Mean wind of the flights: the strongest up to which the card allows to fly, or more, m/s.
    pub wind_m_s: f64,
    /// Flights of every way in which a flight can end.
    pub survey: u64,
    /// The way that reaches farthest, with its own flights.
    pub way: Way,
    pub radius: Radius,
    pub rule: Rule,
}

/// Flights of each way, by which the one that reaches farthest is known.
const SURVEY: u64 = 6;

/// Where the card's mission comes down, from its pad if it has a booster. Every way is flown a few times, and the way that reaches
/// farthest as often as its interval needs.
pub(super) fn fly_the_hazard(
    order: &Order<'_>,
    recipe: &Recipe,
    limit_m_s: f64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Hazard, CardError> {
    let day = if limit_m_s > order.today.wind_m_s { order.windier } else { order.today };
    let mut recipe = in_weather(recipe, &day.weather);
    if recipe.mission.launch.is_some() && recipe.mission.start.at == StartPoint::Apogee {
        recipe = recipe.starting_at(StartPoint::Pad).map_err(HazardError::Recipe)?;
    }
    let rule = Rule::of(&recipe.mission);
    let flights = Flights { survey: SURVEY.min(order.hazard_flights), of_widest: order.hazard_flights };
    let impacts =
        hazard::study(&recipe, flights, order.jobs, &|done, of| progress(done as usize, of as usize))?;
    let (way, radius) = hazard::widest(&impacts).ok_or(HazardError::NoFlight)?;
    Ok(Hazard { wind_m_s: day.wind_m_s, survey: flights.survey, way, radius, rule })
}

fn in_weather(recipe: &Recipe, weather: &Weather) -> Recipe {
    Recipe {
        dispersion: weather.dispersion,
        dispersion_name: weather.dispersion_name.clone(),
        dispersion_toml: weather.dispersion_toml.clone(),
        ..recipe.clone()
    }
}

/// Flights from which the cost of one is learnt.
const FIRST: u64 = 4;
/// Fewest and most flights in the wind of the day.
const FLIGHTS: [u64; 2] = [12, 60];
/// Work in the wind of the day, as iterations of the landing solver: some 3 s on two cores. It is counted, not timed, so
/// that a card is the same on every machine.
const BUDGET: u64 = 140_000;
/// What a flight costs beside its solver, as iterations.
const BESIDE: u64 = 1_500;

pub(super) fn fly_in_winds(
    order: &Order<'_>,
    recipe: &Recipe,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Winds, FlyError> {
    let first = order.flights.unwrap_or(FIRST).min(FIRST);
    let mut today = fly_rows(&numbered(recipe, 0..first), order.jobs, &|_| {})?;
    let flights = order.flights.unwrap_or_else(|| {
        let each = today.iter().map(|row| row.solver_iterations).sum::<u64>() / FIRST + BESIDE;
        (BUDGET / each).clamp(FLIGHTS[0], FLIGHTS[1])
    });
    let windier = in_weather(recipe, &order.windier.weather);
    let steady: Vec<Recipe> = order.steady.iter().map(|(_, weather)| in_weather(recipe, weather)).collect();
    // All at once, so that no thread waits for the last flight of a wind.
    let mut tasks = numbered(recipe, first..flights);
    let from_windier = tasks.len();
    tasks.extend(numbered(&windier, 0..flights.div_ceil(2)));
    let from_steady = tasks.len();
    tasks.extend(steady.iter().map(|recipe| (recipe, 0)));
    let (before, of) = (today.len(), today.len() + tasks.len());
    let rows = fly_rows(&tasks, order.jobs, &|done| progress(before + done, of))?;
    today.extend_from_slice(&rows[..from_windier]);
    let landed = rows[from_steady..].iter().take_while(|row| row.legs).count();
    Ok(Winds {
        today_m_s: order.today.wind_m_s,
        today: Flown::of(order.set, &today),
        windier_m_s: order.windier.wind_m_s,
        windier: Flown::of(order.set, &rows[from_windier..from_steady]),
        steady_m_s: landed.checked_sub(1).map(|last| order.steady[last].0),
        steady_tried_m_s: order.steady.last().map_or(0.0, |(wind_m_s, _)| *wind_m_s),
    })
}

fn numbered(recipe: &Recipe, numbers: core::ops::Range<u64>) -> Vec<(&Recipe, u64)> {
    numbers.map(|number| (recipe, number)).collect()
}
