//! Texts that are built in or files; and files written atomically: each is complete or absent.
//! Existing files are preserved: a new file or folder gets the next free name.

use std::fs::{File, Permissions, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::os::fd::AsFd as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use protocol::log::recorder::{is_device, other_name, under_free_name};
use sim::recipe::nearest;
use tempfile::{NamedTempFile, TempPath};

/// Neither a built-in text nor a file.
#[derive(Debug, thiserror::Error)]
#[error("'{name}' is neither a built-in {what} ({available}{hint}) nor a readable file")]
pub struct UnknownText {
    name: String,
    what: &'static str,
    available: String,
    /// The name that was probably meant, as a question.
    hint: String,
    source: io::Error,
}

/// Returns a built-in text by name, or the text of a file.
///
/// # Errors
/// It is neither.
pub fn text_of(name: &str, builtin: &[(&str, &str)], what: &'static str) -> Result<String, UnknownText> {
    if let Some((_, text)) = builtin.iter().find(|(key, _)| *key == name) {
        return Ok((*text).to_owned());
    }
    std::fs::read_to_string(name).map_err(|source| {
        let available = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        let close =
            nearest(name, builtin.iter().map(|(name, _)| *name)).filter(|(_, likeness)| *likeness > 0.8);
        let hint = close.map_or_else(String::new, |(close, _)| format!("; did you mean `{close}`?"));
        UnknownText { name: name.to_owned(), what, available, hint, source }
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

/// Reports that a file gets another name than the requested one. Failure to print is ignored.
pub fn report_other_name(requested: &Path, free: &Path) {
    if let Some(words) = other_name(requested, free) {
        let _ = writeln!(io::stderr(), "{words}");
    }
}

/// Creates a folder under the next free name, and reports a changed name. An empty folder is used
/// as it is. No other process takes it before the returned file is dropped; by then it should have
/// content.
///
/// # Errors
/// It cannot be made, or no name is free.
pub fn new_folder(requested: &Path) -> Result<(PathBuf, File), WriteError> {
    let make = |name: &Path| {
        std::fs::create_dir(name).or_else(|taken| if name.is_dir() { Ok(()) } else { Err(taken) })?;
        let folder = File::open(name)?;
        let held = matches!(folder.try_lock(), Err(TryLockError::WouldBlock));
        let is_ours = !held && std::fs::read_dir(name)?.next().is_none();
        is_ours.then_some(folder).ok_or(io::ErrorKind::AlreadyExists.into())
    };
    let parents = std::fs::create_dir_all(requested.parent().unwrap_or(requested));
    let made = parents.and_then(|()| under_free_name(requested, make)).map_err(WriteError::at(requested))?;
    report_other_name(requested, &made.0);
    Ok(made)
}

/// Writes the files of a folder, which is made if it is not there: all or none, under hidden
/// temporary names first. They replace those of an earlier part of the same work.
///
/// # Errors
/// A file cannot be written.
pub fn write_folder(folder: &Path, files: &[(&str, impl AsRef<[u8]>)]) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder).map_err(WriteError::at(folder))?;
    let mut complete = Vec::new();
    for (name, bytes) in files {
        let mut file = NewFile::replace(&folder.join(name))?;
        let written = file.write_all(bytes.as_ref()).and_then(|()| file.file.sync_all());
        written.map_err(WriteError::at(&file.path))?;
        complete.push(file);
    }
    complete.into_iter().try_for_each(|file| file.commit().map(drop))
}

/// A file being written, under a temporary name in the same directory until it is complete. If
/// dropped, it is removed.
#[derive(Debug)]
pub struct NewFile {
    /// The requested name.
    path: PathBuf,
    replaces: bool,
    file: File,
    /// Its name until it is complete; a pipe or a device has no content that could be lost.
    unfinished: Option<TempPath>,
}

impl NewFile {
    /// Creates a file. If one of this name exists when it is complete, it gets the next free name,
    /// which is reported.
    ///
    /// # Errors
    /// It cannot be created in its directory.
    pub fn create(requested: &Path) -> Result<Self, WriteError> {
        Self::begin(requested, false)
    }

    /// Begins the new content of a file.
    ///
    /// # Errors
    /// It cannot be created in its directory.
    pub fn replace(path: &Path) -> Result<Self, WriteError> {
        Self::begin(path, true)
    }

    fn begin(path: &Path, replaces: bool) -> Result<Self, WriteError> {
        let begun = if path == Path::new("/dev/stdout") {
            // If it is a file, later output is appended to it.
            io::stdout().as_fd().try_clone_to_owned().map(|stdout| (stdout.into(), None))
        } else if is_device(path) {
            File::options().write(true).open(path).map(|file| (file, None))
        } else {
            unfinished(path).map(NamedTempFile::into_parts).map(|(file, name)| (file, Some(name)))
        };
        let (file, unfinished) = begun.map_err(WriteError::at(path))?;
        Ok(Self { path: path.to_owned(), replaces, file, unfinished })
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
    /// It could not be written to the disk, or no name is free.
    pub fn commit(self) -> Result<PathBuf, WriteError> {
        let Self { path, replaces, file, mut unfinished } = self;
        let name = |name: &Path| {
            let Some(temporary) = unfinished.take() else { return Ok(()) };
            file.sync_all()?;
            let named = if replaces { temporary.persist(name) } else { temporary.persist_noclobber(name) };
            let Err(refused) = named else { return Ok(()) };
            unfinished = Some(refused.path);
            Err(refused.error)
        };
        let (named, ()) = under_free_name(&path, name).map_err(WriteError::at(&path))?;
        report_other_name(&path, &named);
        Ok(named)
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

/// A file beside another, removed unless it is persisted.
fn unfinished(beside: &Path) -> io::Result<NamedTempFile> {
    let mut unfinished = tempfile::Builder::new();
    // The user's umask applies as to any new file; a temporary file would be readable by its owner
    // only.
    unfinished.prefix(".unfinished-").permissions(Permissions::from_mode(0o666));
    let folder = beside.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The error of a missing folder does not name the temporary file.
    folder.metadata().and_then(|_| unfinished.tempfile_in(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_existing_file_is_preserved_and_a_new_one_is_complete_or_absent() {
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
    fn a_file_that_appears_meanwhile_is_preserved() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let file = NewFile::create(&path).unwrap();
        std::fs::write(&path, "theirs").unwrap();
        assert_eq!(file.commit().unwrap(), directory.path().join("file-2"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
    }

    /// A folder belongs to one process from its creation on, and its content is preserved.
    #[test]
    fn a_new_folder_is_one_process_s() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        let (made, held) = new_folder(&at("new/card")).unwrap();
        assert_eq!(made, at("new/card"));
        assert_eq!(new_folder(&made).unwrap().0, at("new/card-2"), "it is empty, but not ours");
        drop(held);
        assert_eq!(new_folder(&made).unwrap().0, made, "an empty folder is taken as it is");
        write_folder(&made, &[("card.txt", "precious")]).unwrap();
        assert_eq!(new_folder(&made).unwrap().0, at("new/card-2"));
        for number in 2..=100 {
            write_folder(&at(&format!("new/card-{number}")), &[("card.txt", "precious")]).unwrap();
        }
        for full in [made.as_path(), Path::new("."), Path::new("/dev/null")] {
            let refused = new_folder(full).unwrap_err();
            assert!(refused.source.to_string().contains("no name like it is free"), "{refused:?}");
        }
        assert_eq!(std::fs::read_dir(at("new")).unwrap().count(), 100);
    }
}
