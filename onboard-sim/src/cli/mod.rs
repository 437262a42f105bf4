//! The subcommands of the program, and their common parts: the texts that they read, and the
//! threads that they use.

pub(crate) mod campaign;
pub(crate) mod card;
pub(crate) mod check;
pub(crate) mod fly;
pub(crate) mod hazard;
pub(crate) mod new;
pub(crate) mod playback;
mod single;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use flight::vehicle::mission::StartPoint;
use flight::vehicles::mission;
use onboard_sim::files::{report_other_name, text_of};
use onboard_sim::progress::Progress;
use onboard_sim::run::threads;
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::program::{in_range, is_quiet};
use serde_json::Value;
use sim::dispersion::{self, Dispersion};
use sim::recipe::Recipe;
use sim::wire::field::with_field;
use sim::world::wind::aloft::WindsAloft;
use toml_edit::{Array, DocumentMut};

/// Winds over height.
#[derive(Args)]
pub(crate) struct WindsFile {
    /// Mean wind over height instead of one 10 m above the ground: a table (CSV: height_m,
    /// speed_m_s or speed_kn, from_deg), or a sounding of the University of Wyoming ("Text: List").
    #[arg(long = "winds", value_name = "FILE")]
    winds_file: Option<PathBuf>,
}

impl WindsFile {
    /// The same flights in the winds of the file, if there is one. The log stores their text.
    fn applied(&self, recipe: Recipe) -> anyhow::Result<Recipe> {
        let Some(path) = &self.winds_file else { return Ok(recipe) };
        let origin = path.display();
        let levels = flight::vehicles::winds::read(&read(path)?).with_context(|| format!("{origin}"))?;
        WindsAloft::try_from(levels.clone()).with_context(|| format!("{origin}"))?;
        let levels = levels.into_iter().map(|level| toml_edit::Value::from(Array::from_iter(level)));
        with_set_value(&recipe, "winds_aloft", levels.collect(), &format!("the winds of {origin}"))
    }
}

/// Mean winds that can be given, m/s.
const WINDS_M_S: std::ops::RangeInclusive<f64> = 0.0..=30.0;

/// Mean winds to compare.
#[derive(Args)]
pub(crate) struct MeanWinds {
    /// Mean winds 10 m above the ground, m/s, each with results of its own.
    #[arg(
        long = "wind",
        conflicts_with = "winds_file",
        value_delimiter = ',',
        default_value = "0,3,6,8.9",
        value_parser = in_range(WINDS_M_S),
        value_name = "M/S,..."
    )]
    winds_m_s: Vec<f64>,
}

impl MeanWinds {
    /// The same flights in each wind, rising; in their winds aloft if they have any.
    fn applied(&self, recipe: &Recipe) -> anyhow::Result<Vec<(f64, Recipe)>> {
        if let Some(winds) = &recipe.dispersion.winds_aloft {
            return Ok(vec![((10.0 * winds.near_ground().0).round() / 10.0, recipe.clone())]);
        }
        let mut winds_m_s = self.winds_m_s.clone();
        winds_m_s.sort_by(f64::total_cmp);
        winds_m_s.dedup();
        winds_m_s.into_iter().map(|wind_m_s| Ok((wind_m_s, in_wind(recipe, wind_m_s)?))).collect()
    }
}

/// What flies, under what chance.
#[derive(Args)]
pub(crate) struct Selection {
    /// Built-in mission or TOML file.
    #[arg(long, alias = "profile", default_value = mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or
    /// TOML file.
    #[arg(long, default_value = dispersion::DEFAULT, value_name = "NAME|FILE")]
    dispersion: String,
    #[command(flatten)]
    winds_aloft: WindsFile,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1, value_parser = in_range(0..=u64::MAX))]
    seed: u64,
    /// Flights at the same time; the results do not depend on it.
    #[arg(long, value_name = "N", value_parser = in_range(1..=usize::MAX))]
    jobs: Option<usize>,
}

impl Selection {
    fn recipe(&self, start: Option<StartPoint>) -> anyhow::Result<Recipe> {
        self.winds_aloft.applied(recipe(&self.mission, start, &self.dispersion, self.seed)?)
    }
}

/// Runs work on this many threads, or on as many as there are processors; the results do not depend
/// on it.
fn on_threads<T: Send>(
    jobs: Option<usize>,
    work: impl FnOnce() -> anyhow::Result<T> + Send,
) -> anyhow::Result<T> {
    threads(jobs).context("a thread could not be started")?.install(work)
}

/// Begins a log, under the next free name.
fn logging(path: &Path, header: &LogHeader) -> anyhow::Result<Recorder> {
    let recorder = Recorder::create(path, false, header)?;
    report_other_name(path, recorder.path());
    Ok(recorder)
}

/// Prints a notice on standard error, unless --quiet is given. Failure to print is ignored.
fn notify(text: &str) {
    if !is_quiet() {
        let _ = writeln!(std::io::stderr(), "{text}");
    }
}

/// A file's text; text other than UTF-8 is read as Latin-1, in which some programs export.
fn read(path: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| error.as_bytes().iter().copied().map(char::from).collect()))
}

/// The flights of a seed: a mission, with a start if one is given, and a set of dispersions, each
/// built in or a file.
fn recipe(mission_name: &str, start: Option<StartPoint>, set: &str, seed: u64) -> anyhow::Result<Recipe> {
    let mission_toml = text_of(mission_name, mission::BUILTIN, "mission")?;
    let set_toml = text_of(set, dispersion::BUILTIN, "set of dispersions")?;
    let recipe = Recipe::from_texts((mission_name, &mission_toml), (set, &set_toml))?;
    let recipe = Recipe { seed, ..with_field(recipe, mission_name)? };
    Ok(match start {
        Some(start) => recipe.starting_at(start)?,
        None => recipe,
    })
}

/// The same flights in another mean wind, m/s. The log stores the text of the set, and a replay
/// draws from it again.
fn in_wind(recipe: &Recipe, wind_m_s: f64) -> anyhow::Result<Recipe> {
    with_set_value(recipe, "wind_m_s", Array::from_iter([wind_m_s; 2]), &format!("{wind_m_s} m/s of wind"))
}

/// The same flights with another value of their set, described by `words`.
fn with_set_value(recipe: &Recipe, key: &str, value: Array, words: &str) -> anyhow::Result<Recipe> {
    let mut text: DocumentMut = recipe.dispersion_toml.parse()?;
    text[key] = toml_edit::value(value);
    let dispersion_toml = text.to_string();
    let dispersion_name = format!("{} with {words}", recipe.dispersion_name);
    let dispersion = Dispersion::from_toml(&dispersion_toml, &dispersion_name)?;
    Ok(Recipe { dispersion, dispersion_name, dispersion_toml, ..recipe.clone() })
}

/// The answer of a command: as JSON, or as text.
fn answer(json: Option<Value>, text: &impl ToString) -> String {
    json.map_or_else(|| text.to_string(), |json| format!("{json:#}\n"))
}

/// Shows how many flights are flown, of how many.
fn show_flights() -> impl Fn(usize, usize) + Sync {
    let progress = Progress::start();
    move |done, of| progress.show(done, of, "flights")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wind_is_set_in_every_set_of_dispersions_and_nothing_else() {
        for (name, _) in dispersion::BUILTIN {
            let before = Recipe::built_in("mk2", name).unwrap();
            let after = in_wind(&before, 4.5).unwrap();
            assert_eq!(after.dispersion, Dispersion { wind_m_s: [4.5; 2], ..before.dispersion }, "{name}");
        }
    }
}
