//! The landing card: what a team takes to the field for one vehicle, one motor and one wind.
//!
//! It is computed, not looked up: the mass and the height are chosen or checked, the mission is flown in the wind of the day
//! and in more, the certified vehicle in steady wind, and what cannot land is refused with the bound that says so and the
//! nearest vehicle that lands.

use core::fmt;

use flight::vehicle::mission::Mission;
use flight::vehicle::mission::StartPoint;
use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::recipe::Recipe;

use super::choice::{Choice, Limits, Refusal, StartHeight, Team, choose};
use super::frame::{Ballast, Frame, FrameError, start_height_m};
use super::ranking::{Flown, FlyError, Landing, RankError, fly_rows};
use super::sheet;
use super::source::{Candidate, Found};
use crate::attainable;
use crate::hazard::{self, Flights, HazardError, Radius, Rule, Way};
use crate::run::in_parallel;

/// What a card is made for.
pub struct Order<'a> {
    pub team: &'a Team,
    pub motor: &'a Candidate,
    /// Motors to suggest if this one cannot land.
    pub others: &'a [Found],
    /// Mass with the motor full, kg; the best one within the ballast if not given.
    pub mass_kg: Option<f64>,
    /// The wind of the day.
    pub today: &'a Day,
    /// More wind.
    pub windier: &'a Day,
    /// Steady winds, rising, in which the certified vehicle is flown.
    pub steady: &'a [Day],
    /// Flights in the wind of the day; as many as a few seconds allow if not given.
    pub flights: Option<u64>,
    /// Flights of the way of ending that reaches farthest.
    pub hazard_flights: u64,
}

/// A card.
#[derive(Debug, Clone)]
pub struct Card {
    /// With the mission to be loaded.
    pub recipe: Recipe,
    pub(super) landing: Landing,
    pub(super) frame: Frame,
    pub(super) set: String,
    pub(super) winds: Winds,
    pub(super) hazard: Hazard,
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
        "a landing exists, but none of {flights} flights of `{dispersion}` landed at {wind_m_s} m/s of wind; most \
         frequent reason: {reason}. A motor or mass with a larger scatter is wanted: `onboard-sim motors` ranks them"
    )]
    NoneLanded { flights: u64, dispersion: String, wind_m_s: f64, reason: String },
    #[error(transparent)]
    Text(#[from] RankError),
    #[error(transparent)]
    Fly(#[from] FlyError),
    #[error("where it comes down")]
    Hazard(#[from] HazardError),
}

impl Card {
    /// Computes a card. `progress` is told how many flights are flown, of how many.
    ///
    /// # Errors
    /// The vehicle does not land, or the mass cannot be had.
    pub fn new(order: &Order<'_>, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Self, CardError> {
        let mission = &order.team.recipe.mission;
        let frame = Frame::of(mission)?;
        let limits = order.limits(&frame)?;
        let choice = match choose(mission, &frame, &order.motor.curve, &limits) {
            Ok(choice) => choice,
            Err(refusal) => {
                return Err(Box::new(no_landing(order, &frame, &limits, refusal)).into());
            }
        };
        let landing = Landing { candidate: order.motor.clone(), choice, flown: None };
        let recipe = landing.recipe(&order.today.recipe)?;
        let winds = fly_in_winds(order, &recipe, progress)?;
        if winds.today.legs.count == 0 {
            let reason = winds.today.failure.as_ref().map_or("unknown", |(reason, _)| reason);
            return Err(CardError::NoneLanded {
                flights: winds.today.legs.of,
                dispersion: recipe.dispersion_name,
                wind_m_s: order.today.wind_m_s,
                reason: reason.to_owned(),
            });
        }
        let hazard = fly_the_hazard(order, &recipe, winds.limit_m_s(), progress)?;
        let attainable = certified_window(&recipe.mission);
        Ok(Self {
            recipe,
            landing,
            frame,
            set: order.team.recipe.dispersion_name.clone(),
            winds,
            hazard,
            attainable,
        })
    }

    /// The card as text.
    pub fn text(&self) -> String {
        sheet::text(&self.sheet())
    }

    /// The card as one page of HTML.
    pub fn html(&self) -> String {
        sheet::html(&self.sheet())
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
fn fly_the_hazard(
    order: &Order<'_>,
    recipe: &Recipe,
    limit_m_s: f64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Hazard, CardError> {
    let day = if limit_m_s > order.today.wind_m_s { order.windier } else { order.today };
    let mut recipe = in_weather_of(day, recipe);
    if recipe.mission.launch.is_some() && recipe.mission.start.at == StartPoint::Apogee {
        recipe = recipe.starting_at(StartPoint::Pad).map_err(HazardError::Recipe)?;
    }
    let rule = Rule::of(&recipe.mission);
    let flights = Flights { survey: SURVEY.min(order.hazard_flights), of_widest: order.hazard_flights };
    let impacts = hazard::study(&recipe, flights, &|done, of| progress(done as usize, of as usize))?;
    let (way, radius) = hazard::widest(&impacts).ok_or(HazardError::NoFlight)?;
    Ok(Hazard { wind_m_s: day.wind_m_s, survey: flights.survey, way, radius, rule })
}

fn in_weather_of(day: &Day, recipe: &Recipe) -> Recipe {
    let Recipe { mission, mission_toml, .. } = recipe.clone();
    Recipe { mission, mission_toml, ..day.recipe.clone() }
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

fn fly_in_winds(
    order: &Order<'_>,
    recipe: &Recipe,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Winds, FlyError> {
    let first = order.flights.unwrap_or(FIRST).min(FIRST);
    let mut today = fly_rows(&numbered(recipe, 0..first), &|_| {})?;
    let flights = order.flights.unwrap_or_else(|| {
        let each = today.iter().map(|row| row.solver_iterations).sum::<u64>() / FIRST + BESIDE;
        (BUDGET / each).clamp(FLIGHTS[0], FLIGHTS[1])
    });
    let windier = in_weather_of(order.windier, recipe);
    let steady: Vec<Recipe> = order.steady.iter().map(|day| in_weather_of(day, recipe)).collect();
    // All at once, so that no thread waits for the last flight of a wind.
    let mut tasks = numbered(recipe, first..flights);
    let from_windier = tasks.len();
    tasks.extend(numbered(&windier, 0..flights.div_ceil(2)));
    let from_steady = tasks.len();
    tasks.extend(steady.iter().map(|recipe| (recipe, 0)));
    let (before, of) = (today.len(), today.len() + tasks.len());
    let rows = fly_rows(&tasks, &|done| progress(before + done, of))?;
    today.extend_from_slice(&rows[..from_windier]);
    let set = &order.team.recipe.dispersion_name;
    let landed = rows[from_steady..].iter().take_while(|row| row.legs).count();
    Ok(Winds {
        today_m_s: order.today.wind_m_s,
        today: Flown::of(set, &today),
        windier_m_s: order.windier.wind_m_s,
        windier: Flown::of(set, &rows[from_windier..from_steady]),
        steady_m_s: landed.checked_sub(1).map(|last| order.steady[last].wind_m_s),
        steady_tried_m_s: order.steady.last().map_or(0.0, |day| day.wind_m_s),
    })
}

fn numbered(recipe: &Recipe, numbers: core::ops::Range<u64>) -> Vec<(&Recipe, u64)> {
    numbers.map(|number| (recipe, number)).collect()
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

fn no_landing(order: &Order<'_>, frame: &Frame, limits: &Limits, refusal: Refusal) -> NoLanding {
    let curve = &order.motor.curve;
    let without_kg = frame.mass_kg() + curve.total_mass_kg();
    let other_mass = refusal.landing_kg.and_then(|landing_kg| {
        let limits = Limits { masses_kg: landing_kg, ..*limits };
        let choice = choose(&order.team.recipe.mission, frame, curve, &limits).ok()?;
        let excess_kg = without_kg - choice.mass.loaded_kg;
        Some((choice, excess_kg))
    });
    let bound = bound(order, frame, limits);
    let other_motors = other_motors(order, frame, limits);
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
fn other_motors(order: &Order<'_>, frame: &Frame, limits: &Limits) -> Vec<(String, f64, f64)> {
    let others: Vec<&Candidate> = order
        .others
        .iter()
        .filter_map(|found| found.as_ref().ok())
        .filter(|other| other.curve != order.motor.curve)
        .collect();
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
        &|_| {},
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
        let mission = vehicles::mission::builtin("vlr").unwrap().unwrap();
        let bound = certified_window(&mission).unwrap();
        assert!(bound.low_m < 18.0 && 18.0 < bound.high_m && bound.high_m < 28.0, "{bound:?}");
    }
}
