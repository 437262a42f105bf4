//! Ranks motors by how well an airframe lands on them.

use flight::vehicle::mission::Mission;

use crate::choice::{Choice, Limits, Refusal, StartHeight, choose, usual_limits};
use crate::flown::{Flown, FlyError, Weather, fly};
use crate::frame::Frame;
use crate::mission_text::{Changes, MissionTextError, changed, name_of};
use crate::source::{Candidate, Found, Unusable};
use campaign::work::in_parallel;

/// What to look for.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    pub mission: &'a Mission,
    /// Text of the mission.
    pub mission_toml: &'a str,
    /// Least and most ballast, kg.
    pub ballast_kg: [f64; 2],
    /// Where the ballast is, m above the nozzle; at the centre of gravity of the airframe without its motor if not given.
    pub ballast_station_m: Option<f64>,
    pub start: StartHeight,
    /// Widest motor that fits, m; that of the mission's own motor if not given.
    pub tube_m: Option<f64>,
    /// Motors that are flown.
    pub best: usize,
    /// Flights of each.
    pub flights: u64,
    pub weather: &'a Weather,
    /// Threads.
    pub jobs: usize,
}

/// A motor in its place.
#[derive(Debug, Clone, PartialEq)]
pub enum Ranked {
    /// A landing exists.
    Lands(Landing),
    /// No landing exists, and why.
    Refused(Candidate, Refusal),
    /// The motor's data cannot be used.
    Unusable(Unusable),
}

/// A motor on which the airframe lands.
#[derive(Debug, Clone, PartialEq)]
pub struct Landing {
    pub candidate: Candidate,
    pub choice: Choice,
    /// Its flights, if it is among the best.
    pub flown: Option<Box<Flown>>,
}

/// How far the ranking is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Motors looked at, of how many.
    Motors(usize, usize),
    /// Flights flown, of how many.
    Flights(usize, usize),
}

/// Why motors cannot be ranked.
#[derive(Debug, thiserror::Error)]
pub enum RankError {
    #[error(transparent)]
    Frame(#[from] crate::frame::FrameError),
    #[error("{origin}")]
    Text {
        /// The motor.
        origin: String,
        #[source]
        source: MissionTextError,
    },
    #[error(transparent)]
    Fly(#[from] FlyError),
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[from] std::io::Error),
}

/// The motors in order: those that were flown by the share of flights that landed, then those on which a landing exists by
/// the scatter that it stands, then those without a landing and those that cannot be used, as they came.
///
/// # Errors
/// The airframe cannot be taken apart, or a flight cannot be set up.
pub fn rank(
    request: &Request<'_>,
    found: Vec<Found>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Ranked>, RankError> {
    let frame = Frame::of(request.mission)?;
    let of = found.len();
    let chosen = in_parallel(
        &found,
        request.jobs,
        |found| {
            let candidate = found.as_ref().ok()?;
            Some(choose(request.mission, &frame, &candidate.curve, &request.limits(&frame, candidate)))
        },
        &|done| progress(Progress::Motors(done, of)),
    )?;
    let (mut landings, mut others) = (Vec::new(), Vec::new());
    for (found, choice) in found.into_iter().zip(chosen) {
        match (found, choice) {
            (Ok(candidate), Some(Ok(choice))) => landings.push(Landing { candidate, choice, flown: None }),
            (Ok(candidate), Some(Err(refusal))) => others.push(Ranked::Refused(candidate, refusal)),
            (Ok(_), None) => {}
            (Err(unusable), _) => others.push(Ranked::Unusable(unusable)),
        }
    }
    // Those that could not be used at all come last. The sort keeps the order of equals.
    others.sort_by_key(|other| matches!(other, Ranked::Unusable(_)));
    landings.sort_by(|one, two| two.choice.window.scatter.total_cmp(&one.choice.window.scatter));
    fly_the_best(request, &mut landings, progress)?;
    Ok(landings.into_iter().map(Ranked::Lands).chain(others).collect())
}

fn fly_the_best(
    request: &Request<'_>,
    landings: &mut [Landing],
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(), RankError> {
    let best = request.best.min(landings.len());
    let of = best * request.flights as usize;
    if of == 0 {
        return Ok(());
    }
    let mut recipes = Vec::with_capacity(best);
    for landing in &landings[..best] {
        let text = landing.mission_toml(&request.mission.name, request.mission_toml)?;
        recipes.push(request.weather.recipe(&text, &landing.candidate.origin)?);
    }
    let flown = fly(&recipes.iter().collect::<Vec<_>>(), request.flights, request.jobs, &|done| {
        progress(Progress::Flights(done, of));
    })?;
    for (landing, flown) in landings.iter_mut().zip(flown) {
        landing.flown = Some(Box::new(flown));
    }
    let rate = |landing: &Landing| landing.flown.as_ref().map_or(-1.0, |flown| flown.legs.share);
    landings[..best].sort_by(|one, two| rate(two).total_cmp(&rate(one)));
    Ok(())
}

impl Request<'_> {
    /// The limits for a motor.
    pub fn limits(&self, frame: &Frame, candidate: &Candidate) -> Limits {
        let usual = usual_limits(self.mission, frame, &candidate.curve, self.ballast_kg);
        Limits {
            start: self.start,
            ballast_station_m: self.ballast_station_m.unwrap_or(usual.ballast_station_m),
            tube_m: self.tube_m.unwrap_or(usual.tube_m),
            ..usual
        }
    }
}

impl Landing {
    /// The text of the mission that lands on this motor, from the name and text of the one it comes from.
    ///
    /// # Errors
    /// The text is no mission.
    pub fn mission_toml(&self, name: &str, mission_toml: &str) -> Result<String, RankError> {
        let motor = self.candidate.name();
        let mass = self.choice.mass;
        let summary = format!(
            "{name} on the motor {motor}: {:.3} kg, from {:.0} m",
            mass.loaded_kg, self.choice.start_height_m
        );
        let changes = Changes {
            name: &name_of(name, self.candidate.curve.name()),
            summary: &summary,
            motor: &self.candidate.motor,
            mass,
            start_height_m: self.choice.start_height_m,
        };
        changed(mission_toml, &changes)
            .map_err(|source| RankError::Text { origin: self.candidate.origin.clone(), source })
    }
}
