//! Writes new files safely. A file gets its name once it is complete, and replaces an existing one only on request. The
//! log that is being read is never replaced.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

/// The destination of a new file.
#[derive(Debug, Clone, Copy)]
pub struct Destination<'a> {
    /// Its name.
    pub path: &'a Path,
    /// Replace an existing file.
    pub force: bool,
}

/// Of a new file.
impl<'a, P: AsRef<Path> + ?Sized> From<&'a P> for Destination<'a> {
    fn from(path: &'a P) -> Self {
        Self { path: path.as_ref(), force: false }
    }
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

/// Writes a whole file: it gets its name if `write` succeeds. `input` is the file that is being read.
///
/// # Errors
/// As [`NewFile::create`]; or it could not be written.
pub fn write_whole(
    destination: Destination<'_>,
    input: &Path,
    write: impl FnOnce(&mut NewFile) -> io::Result<()>,
) -> Result<(), WriteError> {
    let mut file = NewFile::create(destination, input)?;
    write(&mut file).map_err(WriteError::at(destination.path))?;
    file.commit()
}

/// A file being written, under a temporary name in the same directory until it is complete. If dropped, it is removed.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
    force: bool,
    file: File,
    /// Its name until it is complete; a pipe or a device has no content that could be lost.
    unfinished: Option<TempPath>,
}

impl NewFile {
    /// Creates a file for a destination; `input` is the file that is being read.
    ///
    /// # Errors
    /// The file exists and may not be replaced, it is the input, or it cannot be created in its directory.
    pub fn create(destination: Destination, input: &Path) -> Result<Self, WriteError> {
        Self::begin(destination, input).map_err(WriteError::at(destination.path))
    }

    fn begin(Destination { path, force }: Destination, input: &Path) -> io::Result<Self> {
        if same_file(path, input) {
            let words = "it is the file that is being read, and never overwritten";
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, words));
        }
        if std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
            let file = File::options().write(true).open(path)?;
            return Ok(Self { path: path.to_owned(), force, file, unfinished: None });
        }
        if !force && path.symlink_metadata().is_ok() {
            return Err(exists());
        }
        let (file, unfinished) = onboard_sim::files::unfinished(path)?.into_parts();
        Ok(Self { path: path.to_owned(), force, file, unfinished: Some(unfinished) })
    }

    /// The final name of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Finishes the file and gives it its name.
    ///
    /// # Errors
    /// It could not be written to the disk, or a file has appeared there in the meantime that may not be replaced.
    pub fn commit(self) -> Result<(), WriteError> {
        let Self { path, force, file, unfinished } = self;
        let Some(unfinished) = unfinished else { return Ok(()) };
        let failed = WriteError::at(&path);
        file.sync_all().map_err(&failed)?;
        let persisted = if force { unfinished.persist(&path) } else { unfinished.persist_noclobber(&path) };
        persisted.map_err(|error| match error.error.kind() {
            io::ErrorKind::AlreadyExists => failed(exists()),
            _ => failed(error.error),
        })
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

fn exists() -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, "it exists already; --force replaces it")
}

/// Whether two paths name the same file; a missing file is never the same as another.
pub fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path, text: &str, force: bool) -> io::Result<()> {
        let written = write_whole(Destination { path, force }, Path::new("input"), |file| {
            file.write_all(text.as_bytes())
        });
        written.map_err(|error| error.source)
    }

    #[test]
    fn a_file_is_replaced_whole_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        write(&path, "first", false).unwrap();
        assert_eq!(write(&path, "second", false).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        let mut half = NewFile::create(Destination { path: &path, force: true }, Path::new("input")).unwrap();
        half.write_all(b"half").unwrap();
        drop(half);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first");
        write(&path, "second", true).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "second");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1, "nothing else is left");
    }

    /// Another program creates the file while this one is being written.
    #[test]
    fn a_file_that_appears_meanwhile_is_kept() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let file = NewFile::create((&path).into(), Path::new("input")).unwrap();
        std::fs::write(&path, "theirs").unwrap();
        assert_eq!(file.commit().unwrap_err().source.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
    }

    #[test]
    fn the_input_is_never_replaced_by_any_of_its_names() {
        let directory = tempfile::tempdir().unwrap();
        let input = directory.path().join("log");
        std::fs::write(&input, "log").unwrap();
        let again = directory.path().join(".").join("log");
        for force in [false, true] {
            let refused = NewFile::create(Destination { path: &again, force }, &input).unwrap_err();
            assert!(refused.source.to_string().contains("is being read"), "{refused}");
        }
    }
}
