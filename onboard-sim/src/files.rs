//! Texts that are built in or files; and files that are written whole: each is complete or absent. What exists is kept: a new file or
//! folder gets the next free name.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use protocol::log::recorder::{free_name, other_name};
use tempfile::NamedTempFile;

/// Neither a built-in text nor a file.
#[derive(Debug, thiserror::Error)]
#[error("'{name}' is neither a built-in {what} ({known}) nor a readable file")]
pub struct UnknownText {
    name: String,
    what: &'static str,
    known: String,
    source: io::Error,
}

/// The text of what is built in under a name, or of a file.
///
/// # Errors
/// It is neither.
pub fn text_of(name: &str, builtin: &[(&str, &str)], what: &'static str) -> Result<String, UnknownText> {
    if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
        return Ok((*text).to_owned());
    }
    std::fs::read_to_string(name).map_err(|source| {
        let known = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        UnknownText { name: name.to_owned(), what, known, source }
    })
}

/// A file cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written", path.display())]
pub struct WriteError {
    pub path: PathBuf,
    /// Error from the operating system, or from the writer of a format.
    pub source: io::Error,
}

impl WriteError {
    /// The error at a path.
    pub fn at(path: &Path) -> impl Fn(io::Error) -> Self {
        |source| Self { path: path.to_owned(), source }
    }
}

/// The name of a new file or folder: the next free one. Says so if it is not the one that was asked for.
pub fn new_name(asked: &Path) -> PathBuf {
    let free = free_name(asked);
    if let Some(words) = other_name(asked, &free) {
        // If nobody reads it, the file is written anyway.
        let _ = writeln!(io::stderr(), "{words}");
    }
    free
}

/// Writes a new file under the next free name, and returns that name.
///
/// # Errors
/// It cannot be written.
pub fn write_new(asked: &Path, bytes: &[u8]) -> Result<PathBuf, WriteError> {
    let path = new_name(asked);
    if std::fs::metadata(&path).is_ok_and(|found| !found.is_dir()) {
        // A pipe or a device.
        std::fs::write(&path, bytes).map_err(WriteError::at(&path))?;
    } else {
        let kept = complete(&path, bytes)?.persist_noclobber(&path);
        kept.map_err(|error| WriteError::at(&path)(error.error))?;
    }
    Ok(path)
}

/// Writes the files of a folder, which is made if it is not there: all or none, under hidden temporary names first. They replace those
/// of an earlier part of the same work.
///
/// # Errors
/// A file cannot be written.
pub fn write_folder(folder: &Path, files: Vec<(&str, Vec<u8>)>) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder).map_err(WriteError::at(folder))?;
    let files = files.into_iter().map(|(name, bytes)| {
        let path = folder.join(name);
        Ok((complete(&path, &bytes)?, path))
    });
    files.collect::<Result<Vec<_>, _>>()?.into_iter().try_for_each(|(file, path)| {
        file.persist(&path).map(drop).map_err(|error| WriteError::at(&path)(error.error))
    })
}

/// The whole content on the disk, without its name yet.
fn complete(path: &Path, bytes: &[u8]) -> Result<NamedTempFile, WriteError> {
    let written = unfinished(path).and_then(|mut file| {
        file.write_all(bytes)?;
        file.as_file().sync_all().map(|()| file)
    });
    written.map_err(WriteError::at(path))
}

/// A file beside another, which disappears unless it is kept.
///
/// # Errors
/// It cannot be created in that folder.
pub fn unfinished(beside: &Path) -> io::Result<NamedTempFile> {
    let mut unfinished = tempfile::Builder::new();
    unfinished.prefix(".unfinished-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The user's umask applies as to any new file; a temporary file would be readable by its owner only.
        unfinished.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let folder = beside.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    unfinished.tempfile_in(folder)
}
