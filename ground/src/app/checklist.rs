//! The files of a checklist: its text, and beside it the list of its signatures.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use anyhow::Context as _;

use crate::checklist_file::{self, Remembered};
use crate::model::checklist::{Checklist, ChecklistEntry};

/// Longer files are no checklists.
const BYTES_MAX: u64 = 64 * 1024;

/// Keeps the signatures of one checklist. The file only grows.
pub(super) struct SignatureFile {
    path: PathBuf,
    /// `None` before the first signature.
    file: Option<File>,
    /// Open for its lock: it keeps other stations away while there is no file of signatures.
    _checklist: File,
    hash: String,
}

/// Opens a checklist, and marks what has been signed for it today. Also returns what the crew should be told.
///
/// # Errors
/// The checklist is wrong, its signatures cannot be written, or another station keeps them.
pub(super) fn open(path: &Path, now_unix_s: u64) -> anyhow::Result<(Checklist, SignatureFile, Vec<String>)> {
    let shown = path.display();
    let mut text = String::new();
    let written = File::open(path).with_context(|| format!("the checklist {shown}"))?;
    lock(&written, path)?;
    (&written).take(BYTES_MAX).read_to_string(&mut text).with_context(|| format!("the checklist {shown}"))?;
    let mut checklist = checklist_file::parse(&text).with_context(|| format!("the checklist {shown}"))?;
    let mut signed_path = path.as_os_str().to_owned();
    signed_path.push(".signed");
    let signed_path = PathBuf::from(signed_path);
    let signatures = || format!("the signatures {}", signed_path.display());
    let mut list = Vec::new();
    let file = match File::options().read(true).append(true).open(&signed_path) {
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        opened => {
            let mut file = opened.with_context(signatures)?;
            lock(&file, &signed_path)?;
            file.read_to_end(&mut list).with_context(signatures)?;
            Some(file)
        }
    };
    let Remembered { entries, outdated, broken } =
        checklist_file::remembered(&String::from_utf8_lossy(&list), &checklist.hash, now_unix_s);
    let mut told = Vec::new();
    for entry in &entries {
        checklist.apply(entry);
    }
    if outdated > 0 {
        told.push(format!("{outdated} signatures of the checklist are not of today and do not count"));
    }
    if broken > 0 {
        told.push(format!("{broken} entries of {} cannot be read and do not count", signed_path.display()));
    }
    let hash = checklist.hash.clone();
    let kept = SignatureFile { path: signed_path.clone(), file, _checklist: written, hash };
    Ok((checklist, kept, told))
}

/// Keeps other stations away from a file, as long as it is open.
fn lock(file: &File, path: &Path) -> anyhow::Result<()> {
    file.try_lock().map_err(|error| match error {
        std::fs::TryLockError::WouldBlock => anyhow::anyhow!(
            "another station keeps {}: attach a screen to it to sign (`ground attach`)",
            path.display()
        ),
        std::fs::TryLockError::Error(error) => {
            anyhow::Error::from(error).context(format!("locking {}", path.display()))
        }
    })
}

impl SignatureFile {
    /// Adds a change and waits until it is on the disk: a signature must survive the next power cut.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&mut self, entry: &ChecklistEntry) -> anyhow::Result<()> {
        let signatures = || format!("the signatures {}", self.path.display());
        let mut file = if let Some(file) = self.file.take() {
            file
        } else {
            let file = File::options().append(true).create(true).open(&self.path);
            let file = file.with_context(signatures)?;
            lock(&file, &self.path)?;
            file
        };
        let text = checklist_file::entry_text(&self.hash, entry);
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_data());
        let written = written.with_context(signatures);
        self.file = Some(file);
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::checklist::{Mark, Signature};

    #[test]
    fn signatures_survive_a_restart_and_another_text_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.toml");
        std::fs::write(&path, include_str!("../../checklist-example.toml")).unwrap();
        let now = 1_800_000_000;
        let signature = Signature { by: "Ann".to_owned(), unix_s: now, ..Signature::default() };
        let entry = ChecklistEntry::Signed { step: 2, signature: signature.clone() };
        let (list, mut kept, told) = open(&path, now).unwrap();
        assert!(!list.is_touched() && told.is_empty());
        let another = || open(&path, now).map(|_| ()).unwrap_err().to_string();
        assert!(another().contains("another station keeps"), "{}", another());
        let signed = folder.path().join("list.toml.signed");
        assert!(!signed.exists(), "nothing is signed");
        kept.add(&entry).unwrap();
        assert!(signed.exists());
        assert!(another().contains("another station keeps"), "{}", another());
        drop(kept);
        let (list, kept, _) = open(&path, now + 60).unwrap();
        assert_eq!(list.steps[2].mark, Mark::Signed(signature));
        drop(kept);
        let (list, kept, told) = open(&path, now + 13 * 3_600).unwrap();
        assert!(!list.is_touched());
        assert!(told[0].starts_with("1 signatures of the checklist are not of today"), "{told:?}");
        drop(kept);
        let edited = include_str!("../../checklist-example.toml").replace("3.0", "30.0");
        std::fs::write(&path, edited).unwrap();
        assert!(!open(&path, now + 60).unwrap().0.is_touched(), "it was signed for another text");
    }
}
