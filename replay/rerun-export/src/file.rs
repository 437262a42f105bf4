//! Exports a log file into a recording file without losing existing files.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::Path;

use replay::log::{FlightLog, LogError};

use crate::ExportError;
use crate::export::{Exported, export};
use crate::survey::Survey;

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
    let cannot_write = |source| ExportError::Write { path: rrd_path.to_owned(), source };
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
    let (exported, output) = export(&mut log, &survey, BufWriter::new(file))?;
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
    Ok(exported)
}

fn refuse_loss(log_path: &Path, rrd_path: &Path, overwrite: Overwrite) -> Result<(), ExportError> {
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
