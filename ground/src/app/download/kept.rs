//! The files of a download: the pieces that have arrived (`.part`), what is remembered of them (`.part.txt`), and the
//! log once it is whole. An existing log is never overwritten.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use protocol::ftp::crc;
use protocol::ftp::part::Part;

/// Bytes read at once for a checksum.
const READ_AT_ONCE: usize = 256 * 1024;

/// The files of one download.
#[derive(Debug)]
pub(super) struct Kept {
    whole: PathBuf,
    pieces: PathBuf,
    memory: PathBuf,
    file: File,
}

impl Kept {
    /// Opens the files of the vehicle's log of this name, and returns what is remembered of an earlier download.
    ///
    /// # Errors
    /// The log is here already, or a file cannot be made.
    pub(super) fn open(folder: &Path, vehicle: u8, name: &str) -> anyhow::Result<(Self, Option<Part>)> {
        // The name comes over the air: it must not lead out of the folder.
        let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || "._-".contains(*letter);
        let plain: String = name.chars().filter(is_plain).collect();
        let whole = folder.join(format!("vehicle{vehicle}-{plain}"));
        anyhow::ensure!(
            whole.symlink_metadata().is_err(),
            "{} is here already; it is not overwritten",
            whole.display()
        );
        let beside = |extension: &str| {
            let mut name = whole.clone().into_os_string();
            name.push(extension);
            PathBuf::from(name)
        };
        let (pieces, memory) = (beside(".part"), beside(".part.txt"));
        let part = std::fs::read_to_string(&memory).ok().and_then(|text| Part::from_text(&text).ok());
        // Without its pieces the memory is of no use.
        let part = part.filter(|_| pieces.exists());
        let file = File::options()
            .create(true)
            .truncate(false)
            .read(true)
            .write(true)
            .open(&pieces)
            .with_context(|| format!("opening {}", pieces.display()))?;
        Ok((Self { whole, pieces, memory, file }, part))
    }

    /// Nothing of what was written is of this file.
    pub(super) fn begin_again(&mut self) -> std::io::Result<()> {
        self.file.set_len(0)
    }

    pub(super) fn write(&mut self, offset: u32, piece: &[u8]) -> std::io::Result<()> {
        self.file.write_all_at(piece, u64::from(offset))
    }

    /// Remembers what is there: first the pieces reach the disk, then the memory of them replaces the old one at once.
    pub(super) fn remember(&mut self, part: &Part) -> std::io::Result<()> {
        self.file.sync_data()?;
        let mut new = self.memory.clone().into_os_string();
        new.push(".new");
        let mut file = File::create(&new)?;
        file.write_all(part.to_text().as_bytes())?;
        file.sync_data()?;
        std::fs::rename(new, &self.memory)
    }

    /// The checksum of all pieces.
    pub(super) fn checksum(&self) -> std::io::Result<u32> {
        let mut file = File::open(&self.pieces)?;
        let (mut sum, mut piece) = (0, vec![0; READ_AT_ONCE]);
        loop {
            let read = file.read(&mut piece)?;
            if read == 0 {
                return Ok(sum);
            }
            sum = crc::continued(sum, &piece[..read]);
        }
    }

    /// The log is whole: gives it its name.
    ///
    /// # Errors
    /// There is a file of this name by now, or the disk fails.
    pub(super) fn finish(self) -> anyhow::Result<PathBuf> {
        let Self { whole, pieces, memory, file } = self;
        file.sync_all()?;
        // A link fails if the name is taken; a rename would overwrite.
        if std::fs::hard_link(&pieces, &whole).is_ok() {
            std::fs::remove_file(&pieces)?;
        } else {
            // Some file systems have no such links.
            anyhow::ensure!(
                whole.symlink_metadata().is_err(),
                "{} is here by now; the download is in {}",
                whole.display(),
                pieces.display()
            );
            std::fs::rename(&pieces, &whole)?;
        }
        // The memory of a download that is over is of no use; if it stays, the next one ignores it.
        let _ = std::fs::remove_file(memory);
        Ok(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::ftp::ranges::Ranges;

    #[test]
    fn pieces_and_memory_survive_and_become_a_log_that_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let (mut kept, part) = Kept::open(folder.path(), 1, "../flight.mcap").unwrap();
        assert_eq!(part, None);
        kept.write(3, b"defg").unwrap();
        let mut have = Ranges::default();
        have.add(3..7);
        let part = Part { path: "/log/flight.mcap".to_owned(), len: 7, crc: Some(5), have };
        kept.remember(&part).unwrap();
        drop(kept);
        let (mut kept, found) = Kept::open(folder.path(), 1, "../flight.mcap").unwrap();
        assert_eq!(found, Some(part));
        kept.write(0, b"abc").unwrap();
        assert_eq!(kept.checksum().unwrap(), crc::continued(0, b"abcdefg"));
        let whole = kept.finish().unwrap();
        assert_eq!(whole, folder.path().join("vehicle1-..flight.mcap"));
        assert_eq!(std::fs::read(&whole).unwrap(), b"abcdefg");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let refused = Kept::open(folder.path(), 1, "../flight.mcap").unwrap_err();
        assert!(refused.to_string().contains("is here already"), "{refused}");
    }

    #[test]
    fn a_log_that_appears_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (mut kept, _) = Kept::open(folder.path(), 1, "flight.mcap").unwrap();
        kept.write(0, b"new").unwrap();
        std::fs::write(folder.path().join("vehicle1-flight.mcap"), "old").unwrap();
        assert!(kept.finish().is_err());
        assert_eq!(std::fs::read(folder.path().join("vehicle1-flight.mcap")).unwrap(), b"old");
    }
}
