//! Ranks motors by how well an airframe lands on them, and flies the best ones.

use flight::vehicles::mission::MissionError;
use sim::recipe::Recipe;
use sim::sortie::SetUpError;

use super::choice::{Choice, Refusal, Team, choose};
use super::frame::{Changes, Frame, MissionTextError, changed, name_of};
use super::source::{Candidate, Found, Unusable};
use crate::row::Row;
use crate::run::in_parallel;
use crate::statistics::Landings;
use crate::summary::failures;
use crate::tally;

/// What to look for.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    pub team: &'a Team,
    /// Motors that are flown.
    pub best: usize,
    /// Flights of each.
    pub flights: u64,
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
    Mission(#[from] MissionError),
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
    let team = request.team;
    let mission = &team.recipe.mission;
    let frame = Frame::of(mission)?;
    let of = found.len();
    progress(Progress::Motors(0, of));
    let chosen = in_parallel(
        &found,
        |found| {
            let candidate = found.as_ref().ok()?;
            Some(choose(mission, &frame, &candidate.curve, &team.limits(&frame, &candidate.curve)))
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
    let recipes = landings[..best].iter().map(|landing| landing.recipe(&request.team.recipe));
    let recipes = recipes.collect::<Result<Vec<_>, _>>()?;
    progress(Progress::Flights(0, of));
    let flown = fly(&recipes.iter().collect::<Vec<_>>(), request.flights, &|done| {
        progress(Progress::Flights(done, of));
    })?;
    for (landing, flown) in landings.iter_mut().zip(flown) {
        landing.flown = Some(Box::new(flown));
    }
    let rate = |landing: &Landing| landing.flown.as_ref().map_or(-1.0, |flown| flown.landings.stands.share);
    landings[..best].sort_by(|one, two| rate(two).total_cmp(&rate(one)));
    Ok(())
}

impl Landing {
    /// The flights of a recipe with the mission that lands on this motor.
    ///
    /// # Errors
    /// The recipe's text is no mission.
    pub fn recipe(&self, of: &Recipe) -> Result<Recipe, RankError> {
        let Self { candidate, choice, .. } = self;
        let (name, mass) = (&of.mission.name, choice.mass);
        let (mass_kg, from_m) = (mass.loaded_kg, choice.start_height_m);
        let changes = Changes {
            name: &name_of(name, candidate.curve.name()),
            summary: &format!(
                "{name} on the motor {}: {mass_kg:.3} kg, from {from_m:.0} m",
                candidate.name()
            ),
            motor: &candidate.motor,
            keeps_lot: candidate.curve == of.mission.motor_curve,
            mass,
            start_height_m: from_m,
        };
        let mission_toml = changed(&of.mission_toml, &changes)
            .map_err(|source| RankError::Text { origin: candidate.origin.clone(), source })?;
        let mission = flight::vehicles::mission::from_toml(&mission_toml, &candidate.origin)?;
        Ok(Recipe { mission, mission_toml, ..of.clone() })
    }
}

/// The outcome of some flights.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Name of the set of dispersions.
    pub set: String,
    pub landings: Landings,
    /// The most frequent reason of the others, and its number.
    pub failure: Option<(String, u64)>,
    /// Work of the landing solver: the cost of the flights, the same on every machine.
    pub solver_iterations: u64,
}

/// A flight cannot be set up.
#[derive(Debug, thiserror::Error)]
#[error("flight {number}")]
pub struct FlyError {
    number: u64,
    source: SetUpError,
}

/// Flies flights 0 to `flights` of each recipe: those of a campaign with the same recipe. `done` gets how many flights
/// of all are flown.
///
/// # Errors
/// The first flight that cannot be set up.
pub fn fly(recipes: &[&Recipe], flights: u64, done: &(dyn Fn(usize) + Sync)) -> Result<Vec<Flown>, FlyError> {
    let tasks: Vec<(&Recipe, u64)> =
        recipes.iter().flat_map(|recipe| (0..flights).map(|number| (*recipe, number))).collect();
    let flown = in_parallel(&tasks, |(recipe, number)| tally::fly(recipe, *number), done);
    let rows = tasks.iter().zip(flown);
    let rows = rows.map(|((_, number), row)| row.map_err(|source| FlyError { number: *number, source }));
    let rows = rows.collect::<Result<Vec<Row>, _>>()?;
    // Without flights there are no chunks.
    let mut of_each = rows.chunks(flights.max(1) as usize);
    let flown = |recipe: &&Recipe| Flown::of(&recipe.dispersion_name, of_each.next().unwrap_or_default());
    Ok(recipes.iter().map(flown).collect())
}

impl Flown {
    /// What rows of a set of dispersions come to.
    fn of(set: &str, rows: &[Row]) -> Self {
        let most = failures(rows).into_iter().next();
        Self {
            set: set.to_owned(),
            landings: Landings::of(rows.iter().map(Row::landing)),
            failure: most.map(|failure| (failure.reason, failure.flights)),
            solver_iterations: rows.iter().map(|row| row.solver_iterations).sum(),
        }
    }
}
