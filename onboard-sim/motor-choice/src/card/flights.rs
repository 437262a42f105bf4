//! The flights of a card: in the wind of the day, in more wind, and of the certified vehicle in steady wind.

use sim::recipe::Recipe;

use super::Order;
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
    let in_weather = |weather: &Weather| Recipe {
        dispersion: weather.dispersion,
        dispersion_name: weather.dispersion_name.clone(),
        dispersion_toml: weather.dispersion_toml.clone(),
        ..recipe.clone()
    };
    let first = order.flights.unwrap_or(FIRST).min(FIRST);
    let mut today = fly_rows(&numbered(recipe, 0..first), order.jobs, &|_| {})?;
    let flights = order.flights.unwrap_or_else(|| {
        let each = today.iter().map(|row| row.solver_iterations).sum::<u64>() / FIRST + BESIDE;
        (BUDGET / each).clamp(FLIGHTS[0], FLIGHTS[1])
    });
    let windier = in_weather(&order.windier.weather);
    let steady: Vec<Recipe> = order.steady.iter().map(|(_, weather)| in_weather(weather)).collect();
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
        today: Flown::of(&today),
        windier_m_s: order.windier.wind_m_s,
        windier: Flown::of(&rows[from_windier..from_steady]),
        steady_m_s: landed.checked_sub(1).map(|last| order.steady[last].0),
        steady_tried_m_s: order.steady.last().map_or(0.0, |(wind_m_s, _)| *wind_m_s),
    })
}

fn numbered(recipe: &Recipe, numbers: core::ops::Range<u64>) -> Vec<(&Recipe, u64)> {
    numbers.map(|number| (recipe, number)).collect()
}
