//! The landing card: what a team takes to the field for one vehicle, one motor and one wind.
//!
//! It is computed, not looked up: the mass and the height are chosen or checked, the mission is flown in the wind of the day
//! and in more, and what cannot land is refused with the bound that says so.

mod flights;
mod page;
mod refusal;
mod sheet;

pub use flights::{Day, Hazard, Winds};
pub use refusal::NoLanding;

use campaign::attainable::{self, Window as Clairvoyant};
use campaign::hazard::HazardError;
use flight::vehicle::mission::Mission;
use flight::vehicle::profile::StartPoint;
use sim::dispersion::Dispersion;
use sim::draw::draw;

use crate::choice::{Limits, StartHeight, choose, usual_limits};
use crate::flown::{FlyError, Weather};
use crate::frame::{Frame, FrameError};
use crate::mission_text::start_height_m;
use crate::ranking::{Landing, RankError};
use crate::source::{Candidate, Found};

/// What a card is made for.
pub struct Order<'a> {
    pub mission: &'a Mission,
    /// Text of the mission.
    pub mission_toml: &'a str,
    pub motor: &'a Candidate,
    /// Motors to suggest if this one cannot land.
    pub others: &'a [Found],
    /// Mass with the motor full, kg; the best one within the ballast if not given.
    pub mass_kg: Option<f64>,
    /// Least and most ballast, kg.
    pub ballast_kg: [f64; 2],
    /// Where the ballast is, m above the nozzle; at the centre of gravity of the airframe without its motor if not given.
    pub ballast_station_m: Option<f64>,
    pub start: StartHeight,
    /// Widest motor that fits, m; that of the mission's own motor if not given.
    pub tube_m: Option<f64>,
    /// Name of the set of dispersions.
    pub set: &'a str,
    /// The wind of the day.
    pub today: &'a Day,
    /// More wind.
    pub windier: &'a Day,
    /// Steady winds, m/s, rising, and the certified vehicle's world in each.
    pub steady: &'a [(f64, Weather)],
    /// Flights in the wind of the day; as many as a few seconds allow if not given.
    pub flights: Option<u64>,
    /// Flights of the way of ending that reaches farthest.
    pub hazard_flights: u64,
    /// Threads.
    pub jobs: usize,
}

/// A card.
#[derive(Debug, Clone)]
pub struct Card {
    /// The mission and its text, to be loaded.
    pub mission: Mission,
    pub mission_toml: String,
    landing: Landing,
    frame: Frame,
    set: String,
    winds: Winds,
    hazard: Hazard,
    /// Command heights of the feet from which a controller that knows everything would land.
    clairvoyant: Option<Clairvoyant>,
    seed: u64,
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
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[from] std::io::Error),
}

impl Card {
    /// Computes a card. `progress` is told how many flights are flown, of how many.
    ///
    /// # Errors
    /// The vehicle does not land, or the mass cannot be had.
    pub fn new(order: &Order<'_>, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Self, CardError> {
        let frame = Frame::of(order.mission)?;
        let limits = order.limits(&frame)?;
        let choice = match choose(order.mission, &frame, &order.motor.curve, &limits) {
            Ok(choice) => choice,
            Err(refusal) => {
                return Err(Box::new(refusal::no_landing(order, &frame, &limits, refusal)?).into());
            }
        };
        let landing = Landing { candidate: order.motor.clone(), choice, flown: None };
        let mission_toml = landing.mission_toml(&order.mission.name, order.mission_toml)?;
        let recipe = order.today.weather.recipe(&mission_toml, "the mission of the card")?;
        let winds = flights::fly_in_winds(order, &recipe, progress)?;
        if winds.today.legs.count == 0 {
            let reason = winds.today.failure.as_ref().map_or("unknown", |(reason, _)| reason);
            return Err(CardError::NoneLanded {
                flights: winds.today.legs.of,
                dispersion: order.today.weather.dispersion_name.clone(),
                wind_m_s: order.today.wind_m_s,
                reason: reason.to_owned(),
            });
        }
        let hazard = flights::fly_the_hazard(order, &recipe, winds.limit_m_s(), progress)?;
        let clairvoyant = certified_window(&recipe.mission);
        Ok(Self {
            mission: recipe.mission,
            mission_toml,
            landing,
            frame,
            set: order.set.to_owned(),
            winds,
            hazard,
            clairvoyant,
            seed: order.today.weather.seed,
        })
    }

    /// The card as text.
    pub fn text(&self) -> String {
        page::text(&self.sheet())
    }

    /// The card as one page of HTML.
    pub fn html(&self) -> String {
        page::html(&self.sheet())
    }
}

/// What a controller that knows everything could do with the certified vehicle and motor in still air.
pub(crate) fn certified_window(mission: &Mission) -> Option<Clairvoyant> {
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
        let usual = usual_limits(self.mission, frame, curve, self.ballast_kg);
        let [least_kg, most_kg] = usual.masses_kg;
        if let Some(mass_kg) = self.mass_kg {
            // Scales show grams.
            if !(least_kg - 5e-4..=most_kg + 5e-4).contains(&mass_kg) {
                let (frame_kg, motor_kg) = (frame.mass_kg(), curve.total_mass_kg());
                return Err(CardError::Mass { mass_kg, frame_kg, motor_kg, least_kg, most_kg });
            }
        }
        Ok(Limits {
            masses_kg: self.mass_kg.map_or(usual.masses_kg, |mass_kg| [mass_kg; 2]),
            start: self.start,
            ballast_station_m: self.ballast_station_m.unwrap_or(usual.ballast_station_m),
            tube_m: self.tube_m.unwrap_or(usual.tube_m),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The clairvoyant's bound encloses the height that guidance chooses (16 m, from which 977 of 1,000 land).
    #[test]
    fn the_bound_of_a_drop_is_that_of_its_own_height() {
        let mission = vehicles::mission::builtin("vlr").unwrap().unwrap();
        let bound = certified_window(&mission).unwrap();
        assert!(bound.low_m < 18.0 && 18.0 < bound.high_m && bound.high_m < 28.0, "{bound:?}");
    }
}
