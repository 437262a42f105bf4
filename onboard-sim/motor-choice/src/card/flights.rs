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

/// Flights from which the cost of one is learnt.
const FIRST: u64 = 4;
/// Fewest and most flights in the wind of the day.
const FLIGHTS: [u64; 2] = [12, 60];
/// Work in the wind of the day, as iterations of the landing solver: some 4 s on two cores. It is counted, not timed, so
/// that a card is the same on every machine.
const BUDGET: u64 = 250_000;
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
    let steady: Vec<Recipe> = order.steady.iter().map(|(_, weather)| in_weather(weather)).collect();
    let fewest = order.flights.unwrap_or(FIRST).min(FIRST);
    let mut rows = fly_rows(&[recipe], 0..fewest, order.jobs, &|_| {})?.concat();
    let flights = order.flights.unwrap_or_else(|| {
        let each = rows.iter().map(|row| row.solver_iterations).sum::<u64>() / FIRST + BESIDE;
        (BUDGET / each).clamp(FLIGHTS[0], FLIGHTS[1])
    });
    let more = flights.div_ceil(2);
    let of = (flights + more) as usize + steady.len();
    let before = rows.len();
    rows.extend(
        fly_rows(&[recipe], fewest..flights, order.jobs, &|done| progress(before + done, of))?.concat(),
    );
    let before = flights as usize;
    let windier = in_weather(&order.windier.weather);
    let windier = fly_rows(&[&windier], 0..more, order.jobs, &|done| progress(before + done, of))?.concat();
    let before = before + windier.len();
    let certified = fly_rows(&steady.iter().collect::<Vec<_>>(), 0..1, order.jobs, &|done| {
        progress(before + done, of);
    })?;
    let landed = certified.iter().take_while(|rows| rows.iter().all(|row| row.legs)).count();
    Ok(Winds {
        today_m_s: order.today.wind_m_s,
        today: Flown::of(&rows),
        windier_m_s: order.windier.wind_m_s,
        windier: Flown::of(&windier),
        steady_m_s: landed.checked_sub(1).map(|last| order.steady[last].0),
        steady_tried_m_s: order.steady.last().map_or(0.0, |(wind_m_s, _)| *wind_m_s),
    })
}
