//! Texts that are built in or files; and files that are written whole: each is complete or absent. What exists is kept: a new file or
//! folder gets the next free name.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use protocol::log::recorder::{free_name, other_name};
use tempfile::{NamedTempFile, TempPath};

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

/// Writes the files of a folder, which is made if it is not there: all or none, under hidden temporary names first. They replace those
/// of an earlier part of the same work.
///
/// # Errors
/// A file cannot be written.
pub fn write_folder(folder: &Path, files: Vec<(&str, Vec<u8>)>) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder).map_err(WriteError::at(folder))?;
    let mut complete = Vec::with_capacity(files.len());
    for (name, bytes) in files {
        let mut file = NewFile::replace(&folder.join(name))?;
        file.write_all(&bytes).and_then(|()| file.file.sync_all()).map_err(WriteError::at(&file.path))?;
        complete.push(file);
    }
    complete.into_iter().try_for_each(|file| file.commit().map(drop))
}

/// A file being written, under a temporary name in the same directory until it is complete. If dropped, it is removed.
#[derive(Debug)]
pub struct NewFile {
    /// Its final name.
    pub path: PathBuf,
    replaces: bool,
    file: File,
    /// Its name until it is complete; a pipe or a device has no content that could be lost.
    unfinished: Option<TempPath>,
}

impl NewFile {
    /// Creates a file, under the next free name if there is one of this name.
    ///
    /// # Errors
    /// It cannot be created in its directory.
    pub fn create(asked: &Path) -> Result<Self, WriteError> {
        Self::begin(new_name(asked), false)
    }

    /// Begins the new content of a file.
    ///
    /// # Errors
    /// It cannot be created in its directory.
    pub fn replace(path: &Path) -> Result<Self, WriteError> {
        Self::begin(path.to_owned(), true)
    }

    fn begin(path: PathBuf, replaces: bool) -> Result<Self, WriteError> {
        let is_device = std::fs::metadata(&path).is_ok_and(|found| !found.is_file() && !found.is_dir());
        let begun = if is_device {
            File::options().write(true).open(&path).map(|file| (file, None))
        } else {
            unfinished(&path).map(NamedTempFile::into_parts).map(|(file, name)| (file, Some(name)))
        };
        let (file, unfinished) = begun.map_err(WriteError::at(&path))?;
        Ok(Self { path, replaces, file, unfinished })
    }

    /// Writes the content and finishes the file.
    ///
    /// # Errors
    /// It could not be written.
    pub fn fill(mut self, write: impl FnOnce(&mut Self) -> io::Result<()>) -> Result<PathBuf, WriteError> {
        write(&mut self).map_err(WriteError::at(&self.path))?;
        self.commit()
    }

    /// Finishes the file and gives it its name, which is returned.
    ///
    /// # Errors
    /// It could not be written to the disk, or a file has taken the name of a new one in the meantime.
    pub fn commit(self) -> Result<PathBuf, WriteError> {
        let Self { path, replaces, file, unfinished } = self;
        if let Some(unfinished) = unfinished {
            file.sync_all().map_err(WriteError::at(&path))?;
            let named =
                if replaces { unfinished.persist(&path) } else { unfinished.persist_noclobber(&path) };
            named.map_err(|error| WriteError::at(&path)(error.error))?;
        }
        Ok(path)
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// A file beside another, which disappears unless it is kept.
fn unfinished(beside: &Path) -> io::Result<NamedTempFile> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_exists_is_kept_and_a_file_is_there_whole_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file.txt");
        let write = |text: &str| {
            NewFile::create(&path).unwrap().fill(|file| file.write_all(text.as_bytes())).unwrap()
        };
        assert_eq!([write("first"), write("second")], [path.clone(), directory.path().join("file-2.txt")]);
        let mut half = NewFile::replace(&path).unwrap();
        half.write_all(b"half").unwrap();
        drop(half);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first");
        NewFile::replace(&path).unwrap().fill(|file| file.write_all(b"third")).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "third");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2, "nothing else is left");
    }

    /// Another program creates the file while this one is being written.
    #[test]
    fn a_file_that_appears_meanwhile_is_kept() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let file = NewFile::create(&path).unwrap();
        std::fs::write(&path, "theirs").unwrap();
        assert_eq!(file.commit().unwrap_err().source.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
    }
}
