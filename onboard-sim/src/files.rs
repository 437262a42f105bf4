//! Texts that are built in or files; and files that are written whole: each is complete or absent, and replaces an existing one only
//! on request.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

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

/// Why a file is not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    #[error("{} exists already; --force replaces it", .0.display())]
    Exists(PathBuf),
    #[error("cannot write {}", path.display())]
    Io {
        path: PathBuf,
        #[source]
        source: io::Error,
    },
}

/// A pipe or a device has no content that could be lost.
///
/// # Errors
/// The file exists, and nobody asked to replace it.
pub fn refuse_loss(path: &Path, force: bool) -> Result<(), WriteError> {
    let there = path.symlink_metadata().is_ok_and(|found| found.is_file() || found.is_symlink());
    if there && !force && !is_device(path) { Err(WriteError::Exists(path.to_owned())) } else { Ok(()) }
}

fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes the files of a folder, which is made if it is not there, as [`write_all`].
///
/// # Errors
/// A file exists, or cannot be written.
pub fn write_folder(folder: &Path, files: Vec<(&str, Vec<u8>)>, force: bool) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let files = files.into_iter().map(|(name, bytes)| (folder.join(name), bytes));
    write_all(&files.collect::<Vec<_>>(), force)
}

/// Writes all files or none, under hidden temporary names first.
///
/// # Errors
/// A file exists, or cannot be written.
pub fn write_all(files: &[(PathBuf, Vec<u8>)], force: bool) -> Result<(), WriteError> {
    files.iter().try_for_each(|(path, _)| refuse_loss(path, force))?;
    let mut complete = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        if is_device(path) {
            std::fs::write(path, bytes).map_err(failed(path))?;
        } else {
            let mut file = unfinished(path).map_err(failed(path))?;
            file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(failed(path))?;
            complete.push((file, path));
        }
    }
    complete.into_iter().try_for_each(|(file, path)| {
        let kept = if force { file.persist(path) } else { file.persist_noclobber(path) };
        kept.map(drop).map_err(|error| failed(path)(error.error))
    })
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> WriteError {
    let path = path.to_owned();
    |source| WriteError::Io { path, source }
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
