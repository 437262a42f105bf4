//! The subcommands of the program, and what they have in common: the texts that they read, the threads that they use, and
//! the files that they write: each is complete or absent, and replaces an existing one only on request.

pub(crate) mod campaign;
pub(crate) mod card;
pub(crate) mod check;
pub(crate) mod fly;
pub(crate) mod hazard;
pub(crate) mod new;
mod single;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::threads;
use onboard_sim::stopwatch::Stopwatch;
use sim::dispersion::{self, Dispersion};
use sim::recipe::{self, Recipe};
use tempfile::NamedTempFile;

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
    let stopwatch = Stopwatch::start();
    move |done, of| stopwatch.show(done, of, "flights")
}

/// An existing file is replaced only on request; a pipe or a device has no content that could be lost.
fn refuse_loss(path: &Path, force: bool) -> anyhow::Result<()> {
    let there = path.symlink_metadata().is_ok_and(|found| found.is_file() || found.is_symlink());
    anyhow::ensure!(
        force || is_device(path) || !there,
        "{} exists already; --force replaces it",
        path.display()
    );
    Ok(())
}

fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes what a function writes as a file.
fn write_file(
    path: &Path,
    force: bool,
    write: impl FnOnce(&mut Vec<u8>) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    let mut bytes = Vec::new();
    write(&mut bytes)?;
    write_all(&[(path.to_owned(), bytes)], force)
}

/// Writes texts as the files of a folder, which is made if it is not there.
fn write_folder(folder: &Path, files: &[(&str, String)], force: bool) -> anyhow::Result<()> {
    let files = files.iter().map(|(name, text)| (folder.join(name), text.clone().into_bytes()));
    let files: Vec<_> = files.collect();
    files.iter().try_for_each(|(path, _)| refuse_loss(path, force))?;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    write_all(&files, force)
}

/// Writes all files or none, under hidden temporary names first, so that a file with the final name is always complete.
fn write_all(files: &[(PathBuf, Vec<u8>)], force: bool) -> anyhow::Result<()> {
    let mut complete = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        refuse_loss(path, force)?;
        let cannot = || format!("cannot write {}", path.display());
        if is_device(path) {
            std::fs::write(path, bytes).with_context(cannot)?;
            continue;
        }
        let mut unfinished = unfinished_beside(path).with_context(cannot)?;
        unfinished.write_all(bytes).and_then(|()| unfinished.as_file().sync_all()).with_context(cannot)?;
        complete.push((unfinished, path));
    }
    complete.into_iter().try_for_each(|(unfinished, path)| {
        let kept = if force { unfinished.persist(path) } else { unfinished.persist_noclobber(path) };
        kept.map(drop)
            .map_err(|error| error.error)
            .with_context(|| format!("cannot write {}", path.display()))
    })
}

/// A file that disappears unless it is kept.
fn unfinished_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut unfinished = tempfile::Builder::new();
    unfinished.prefix(".unfinished-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The user's umask applies as to any new file; a temporary file would be readable by its owner only.
        unfinished.permissions(std::fs::Permissions::from_mode(0o666));
    }
    unfinished.tempfile_in(folder)
}
