//! Writes files safely: each gets its name once it is complete. What exists is kept, the log that is read like any other: a new file
//! gets the next free name.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

pub use onboard_sim::files::{WriteError, new_name};
use tempfile::{NamedTempFile, TempPath};

/// Writes a whole new file: it gets its name, which is returned, if `write` succeeds.
///
/// # Errors
/// As [`NewFile::create`]; or it could not be written.
pub fn write_whole(
    asked: &Path,
    write: impl FnOnce(&mut NewFile) -> io::Result<()>,
) -> Result<PathBuf, WriteError> {
    NewFile::create(asked)?.fill(write)
}

/// A file being written, under a temporary name in the same directory until it is complete. If dropped, it is removed.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
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
            onboard_sim::files::unfinished(&path)
                .map(NamedTempFile::into_parts)
                .map(|(file, name)| (file, Some(name)))
        };
        let (file, unfinished) = begun.map_err(WriteError::at(&path))?;
        Ok(Self { path, replaces, file, unfinished })
    }

    /// The final name of the file.
    pub fn path(&self) -> &Path {
        &self.path
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_exists_is_kept_and_a_file_is_there_whole_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file.txt");
        let write = |text: &str| write_whole(&path, |file| file.write_all(text.as_bytes())).unwrap();
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
