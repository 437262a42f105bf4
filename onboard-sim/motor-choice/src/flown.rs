//! What quick flights of a mission come to.

use campaign::row::Row;
use campaign::statistics::Share;
use campaign::tally;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;
use sim::sortie::SetUpError;

use campaign::work::in_parallel;

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
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[from] std::io::Error),
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
pub fn fly(
    recipes: &[&Recipe],
    flights: u64,
    jobs: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Flown>, FlyError> {
    let tasks: Vec<(&Recipe, u64)> =
        recipes.iter().flat_map(|recipe| (0..flights).map(|number| (*recipe, number))).collect();
    let rows = fly_rows(&tasks, jobs, done)?;
    // Without flights there are no chunks.
    let mut of_each = rows.chunks(flights.max(1) as usize);
    let flown = |recipe: &&Recipe| Flown::of(&recipe.dispersion_name, of_each.next().unwrap_or_default());
    Ok(recipes.iter().map(flown).collect())
}

/// The rows of some flights, in their order.
pub(crate) fn fly_rows(
    tasks: &[(&Recipe, u64)],
    jobs: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Row>, FlyError> {
    let flown = in_parallel(tasks, jobs, |(recipe, number)| tally::fly(recipe, *number), done)?;
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
