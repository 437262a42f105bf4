//! Ranks motors by how well an airframe lands on them, and flies the best ones.

use flight::vehicle::mission::Mission;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;
use sim::sortie::SetUpError;

use super::choice::{Choice, Limits, Refusal, StartHeight, choose, usual_limits};
use super::frame::{Changes, Frame, MissionTextError, changed, name_of};
use super::source::{Candidate, Found, Unusable};
use crate::row::Row;
use crate::run::in_parallel;
use crate::statistics::Share;
use crate::tally;

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
    Frame(#[from] super::frame::FrameError),
    #[error("{origin}")]
    Text {
        /// The motor.
        origin: String,
        #[source]
        source: MissionTextError,
    },
    #[error(transparent)]
    Fly(#[from] FlyError),
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
        |found| {
            let candidate = found.as_ref().ok()?;
            Some(choose(request.mission, &frame, &candidate.curve, &request.limits(&frame, candidate)))
        },
        &|done| progress(Progress::Motors(done, of)),
    );
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
    let flown = fly(&recipes.iter().collect::<Vec<_>>(), request.flights, &|done| {
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

/// What the flights differ in, beside their mission.
#[derive(Debug, Clone)]
pub struct Weather {
    pub dispersion: Dispersion,
    /// Its name for a table.
    pub dispersion_name: String,
    /// Its text.
    pub dispersion_toml: String,
    /// Seed of everything random.
    pub seed: u64,
}

/// The outcome of some flights.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Name of the set of dispersions.
    pub set: String,
    /// Landed within the limits of the legs.
    pub legs: Share,
    /// Landed inside the landing paper's Table 2.
    pub strict: Share,
    /// The most frequent reason of the others, and its number.
    pub failure: Option<(String, u64)>,
    /// Work of the landing solver: the cost of the flights, the same on every machine.
    pub solver_iterations: u64,
}

/// Why flights cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// The mission's text is wrong.
    #[error(transparent)]
    Mission(#[from] vehicles::mission::MissionError),
    /// A flight cannot be set up.
    #[error("flight {number}")]
    Flight {
        number: u64,
        #[source]
        source: SetUpError,
    },
}

impl Weather {
    /// The recipe of the flights of a mission's text; `origin` names it in messages.
    ///
    /// # Errors
    /// The text is no mission.
    pub fn recipe(&self, mission_toml: &str, origin: &str) -> Result<Recipe, FlyError> {
        Ok(Recipe {
            mission: vehicles::mission::from_toml(mission_toml, origin)?,
            mission_toml: mission_toml.to_owned(),
            dispersion: self.dispersion,
            dispersion_name: self.dispersion_name.clone(),
            dispersion_toml: self.dispersion_toml.clone(),
            seed: self.seed,
            controller: flight::guidance::baseline::Controller::Nmpc,
            faults: Vec::new(),
        })
    }
}

/// Flies flights 0 to `flights` of each recipe: those of a campaign with the same recipe. `done` is told how many flights
/// of all are flown.
///
/// # Errors
/// The first flight that cannot be set up.
pub fn fly(recipes: &[&Recipe], flights: u64, done: &(dyn Fn(usize) + Sync)) -> Result<Vec<Flown>, FlyError> {
    let tasks: Vec<(&Recipe, u64)> =
        recipes.iter().flat_map(|recipe| (0..flights).map(|number| (*recipe, number))).collect();
    let rows = fly_rows(&tasks, done)?;
    // Without flights there are no chunks.
    let mut of_each = rows.chunks(flights.max(1) as usize);
    let flown = |recipe: &&Recipe| Flown::of(&recipe.dispersion_name, of_each.next().unwrap_or_default());
    Ok(recipes.iter().map(flown).collect())
}

/// The rows of some flights, in their order.
pub(crate) fn fly_rows(
    tasks: &[(&Recipe, u64)],
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Row>, FlyError> {
    let flown = in_parallel(tasks, |(recipe, number)| tally::fly(recipe, *number), done);
    let rows = tasks.iter().zip(flown);
    rows.map(|((_, number), row)| row.map_err(|source| FlyError::Flight { number: *number, source }))
        .collect()
}

impl Flown {
    /// What rows of a set of dispersions come to.
    pub(crate) fn of(set: &str, rows: &[Row]) -> Self {
        let of = rows.len() as u64;
        let count = |is: fn(&Row) -> bool| rows.iter().filter(|row| is(row)).count() as u64;
        let mut failures: Vec<(String, u64)> = Vec::new();
        for row in rows.iter().filter(|row| !row.legs) {
            let reason = if row.failure.is_empty() { "did not land" } else { &row.failure };
            match failures.iter_mut().find(|(known, _)| known == reason) {
                Some((_, count)) => *count += 1,
                None => failures.push((reason.to_owned(), 1)),
            }
        }
        // Among equally frequent ones the first flown.
        let failure = failures.into_iter().reduce(|most, next| if next.1 > most.1 { next } else { most });
        Self {
            set: set.to_owned(),
            legs: Share::new(count(|row| row.legs), of),
            strict: Share::new(count(|row| row.strict), of),
            failure,
            solver_iterations: rows.iter().map(|row| row.solver_iterations).sum(),
        }
    }
}
