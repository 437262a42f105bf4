//! The subcommands of the program, and what they have in common: the texts that they read, and the threads that they use.

pub(crate) mod campaign;
pub(crate) mod card;
pub(crate) mod check;
pub(crate) mod fly;
pub(crate) mod hazard;
pub(crate) mod new;
mod single;

use anyhow::Context as _;
use flight::vehicle::mission::StartPoint;
use onboard_sim::progress::Progress;
use onboard_sim::run::threads;
use sim::dispersion::{self, Dispersion};
use sim::recipe::{self, Recipe};

/// Does work on so many threads, or on as many as there are processors; the results do not depend on it.
fn on_threads<T: Send>(
    jobs: Option<usize>,
    work: impl FnOnce() -> anyhow::Result<T> + Send,
) -> anyhow::Result<T> {
    threads(jobs).context("a thread could not be started")?.install(work)
}

/// The text of a built-in mission or of a file, with the flights' start if one is given.
fn mission_text(profile: &str, start: Option<StartPoint>) -> anyhow::Result<String> {
    let text = text_of(profile, flight::vehicles::mission::BUILTIN, "mission")?;
    Ok(match start {
        Some(start) => recipe::toml_starting_at(&text, profile, start)?,
        None => text,
    })
}

/// The text of a built-in set, or of a file.
fn text_of(name: &str, builtin: &[(&str, &str)], what: &str) -> anyhow::Result<String> {
    if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
        return Ok((*text).to_owned());
    }
    std::fs::read_to_string(name).with_context(|| {
        let known = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("'{name}' is neither a built-in {what} ({known}) nor a readable file")
    })
}

/// The flights of a seed: a mission, with a start if one is given, and a set of dispersions, each built in or a file.
fn recipe(profile: &str, start: Option<StartPoint>, set: &str, seed: u64) -> anyhow::Result<Recipe> {
    let mission_toml = mission_text(profile, start)?;
    let set_toml = text_of(set, dispersion::BUILTIN, "set of dispersions")?;
    Ok(Recipe { seed, ..Recipe::from_texts((profile, &mission_toml), (set, &set_toml))? })
}

/// The same flights in another mean wind, m/s.
fn in_wind(recipe: &Recipe, wind_m_s: f64) -> anyhow::Result<Recipe> {
    let dispersion_name = format!("{} with {wind_m_s} m/s of wind", recipe.dispersion_name);
    let dispersion_toml = fly::with_wind(&recipe.dispersion_toml, wind_m_s);
    let dispersion = Dispersion::from_toml(&dispersion_toml, &dispersion_name)?;
    Ok(Recipe { dispersion, dispersion_name, dispersion_toml, ..recipe.clone() })
}

/// Shows how many flights are flown, of how many.
fn show_flights() -> impl Fn(usize, usize) + Sync {
    let progress = Progress::start();
    move |done, of| progress.show(done, of, "flights")
}
