//! Exports a log file into a recording file without losing existing files.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read};
use std::path::Path;

use replay::log::{FlightLog, LogError};

use crate::ExportError;
use crate::export::{Exported, Pace, Shown, export, export_two, fill};
use crate::identity;
use crate::rrd::Batches;
use crate::survey::Survey;
use crate::viewer::Viewer;

/// What to do with an existing recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overwrite {
    /// Keep it and fail.
    Never,
    /// Replace it.
    Always,
}

/// Writes the recording of a log file. The file appears when it is complete.
///
/// # Errors
/// The log cannot be used, or the recording cannot be written.
pub fn export_file(log_path: &Path, rrd_path: &Path, overwrite: Overwrite) -> Result<Exported, ExportError> {
    refuse_loss(log_path, rrd_path, overwrite)?;
    let mut log = FlightLog::open(log_path)?;
    let survey = survey_file(log_path)?;
    whole_file(rrd_path, overwrite, |output| export(&mut log, &survey, output))
}

/// Writes one recording of two log files: the second flight in other colours beside the first, on the same clock.
///
/// # Errors
/// As [`export_file`].
pub fn export_file_with(
    log_path: &Path,
    other_path: &Path,
    rrd_path: &Path,
    overwrite: Overwrite,
) -> Result<(Exported, Exported), ExportError> {
    refuse_loss(log_path, rrd_path, overwrite)?;
    refuse_loss(other_path, rrd_path, overwrite)?;
    let (mut log, mut other) = (FlightLog::open(log_path)?, FlightLog::open(other_path)?);
    let (survey, other_survey) = (survey_file(log_path)?, survey_file(other_path)?);
    whole_file(rrd_path, overwrite, |output| {
        let (done, of_other, output) = export_two((&mut log, &survey), (&mut other, &other_survey), output)?;
        Ok(((done, of_other), output))
    })
}

/// Sends the recording of a log file to a viewer.
///
/// # Errors
/// The log cannot be used, or no viewer takes the recording.
pub fn send_file(log_path: &Path, address: &str) -> Result<Exported, ExportError> {
    let mut log = FlightLog::open(log_path)?;
    let survey = survey_file(log_path)?;
    show(&mut log, &survey, address, Pace::Afterwards)
}

/// Shows a log in a viewer: at first what its head promises, so that the viewer is laid out, then the flight.
pub(crate) fn show<R: Read>(
    log: &mut FlightLog<R>,
    survey: &Survey,
    address: &str,
    pace: Pace,
) -> Result<Exported, ExportError> {
    let viewer = Viewer::connect(identity::builder(log.name(), survey), address, Batches::Prompt)?;
    Shown::expected(survey).send(viewer.recording())?;
    viewer.arrived()?;
    let exported = fill(viewer.recording(), log, survey, pace)?;
    viewer.arrived()?;
    Ok(exported)
}

/// Writes a file that gets its name when it is complete.
fn whole_file<T>(
    rrd_path: &Path,
    overwrite: Overwrite,
    write: impl FnOnce(BufWriter<File>) -> Result<(T, BufWriter<File>), ExportError>,
) -> Result<T, ExportError> {
    let cannot_write = |source| cannot_write(rrd_path, source);
    let folder = rrd_path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut unfinished = tempfile::Builder::new();
    unfinished.prefix(".unfinished-").suffix(".rrd");
    #[cfg(unix)]
    let unfinished = {
        use std::os::unix::fs::PermissionsExt as _;
        // Apply the user's umask as for any new file; a temporary file would be readable by its owner only.
        unfinished.permissions(std::fs::Permissions::from_mode(0o666))
    };
    let unfinished = unfinished.tempfile_in(folder).map_err(cannot_write)?;
    let file = unfinished.as_file().try_clone().map_err(cannot_write)?;
    let (done, output) = write(BufWriter::new(file))?;
    output
        .into_inner()
        .map_err(|error| cannot_write(error.into_error()))?
        .sync_data()
        .map_err(cannot_write)?;
    match overwrite {
        Overwrite::Always => unfinished.persist(rrd_path),
        Overwrite::Never => unfinished.persist_noclobber(rrd_path),
    }
    .map_err(|error| cannot_write(error.error))?;
    Ok(done)
}

/// Opens a file that is seen while it is written.
pub(crate) fn create_in_place(path: &Path, overwrite: Overwrite) -> Result<File, ExportError> {
    let mut options = File::options();
    options.write(true);
    match overwrite {
        Overwrite::Always => options.create(true).truncate(true),
        Overwrite::Never => options.create_new(true),
    };
    options.open(path).map_err(|source| cannot_write(path, source))
}

pub(crate) fn cannot_write(path: &Path, source: std::io::Error) -> ExportError {
    ExportError::Write { path: path.to_owned(), source }
}

pub(crate) fn refuse_loss(log_path: &Path, rrd_path: &Path, overwrite: Overwrite) -> Result<(), ExportError> {
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if same(log_path, rrd_path) {
        return Err(ExportError::IsTheLog { path: rrd_path.to_owned() });
    }
    if overwrite == Overwrite::Never && rrd_path.symlink_metadata().is_ok() {
        return Err(ExportError::Exists { path: rrd_path.to_owned() });
    }
    Ok(())
}

fn survey_file(path: &Path) -> Result<Survey, ExportError> {
    let read = File::open(path).and_then(|file| Survey::of(BufReader::with_capacity(1 << 20, file)));
    Ok(read.map_err(|source| LogError::Read { name: path.display().to_string(), source })?)
}
