//! Follows a log while a vehicle or a ground station writes it.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use replay::log::{FlightLog, LogError};

use crate::ExportError;
use crate::export::{Exported, Pace, Shown, fill};
use crate::file::{Overwrite, cannot_write, create_in_place, refuse_loss, show};
use crate::identity;
use crate::rrd::{Batches, RrdWriter};
use crate::survey::Survey;

/// A log that grows, as the whole records that it has so far. It ends when `wait` says that nothing more is expected: what
/// is left then is given out as it is, so that its reader says that it is cut.
///
/// A writer that cannot know a chunk's length beforehand writes a placeholder of ones, and corrects it once the chunk is
/// written. Up to then the record is not there.
#[derive(Debug)]
pub struct Growing<R, W> {
    input: R,
    wait: W,
    at: u64,
    /// Up to here the records are whole.
    whole: u64,
}

/// Of an MCAP file: its magic, a record's opcode and length, and the record behind which only the magic follows.
const MAGIC_LEN: u64 = mcap::MAGIC.len() as u64;
const HEAD_LEN: usize = 9;

impl<R: Read + Seek, W: FnMut() -> bool> Growing<R, W> {
    /// `wait` is called at each end of what is written so far: it waits a while, and says whether to look again.
    pub fn new(input: R, wait: W) -> Self {
        Self { input, wait, at: 0, whole: 0 }
    }

    /// Where the next record ends, if it is whole.
    fn next_end(&mut self) -> std::io::Result<Option<u64>> {
        let written = self.input.seek(SeekFrom::End(0))?;
        let end = if self.at == 0 {
            MAGIC_LEN
        } else {
            let mut head = [0; HEAD_LEN];
            if written < self.at + HEAD_LEN as u64 {
                return Ok(None);
            }
            self.input.seek(SeekFrom::Start(self.at))?;
            self.input.read_exact(&mut head)?;
            let [opcode, len @ ..] = head;
            let magic = if opcode == mcap::records::op::FOOTER { MAGIC_LEN } else { 0 };
            // The placeholder is longer than any file.
            self.at
                .saturating_add(HEAD_LEN as u64)
                .saturating_add(u64::from_le_bytes(len))
                .saturating_add(magic)
        };
        Ok(Some(end).filter(|end| *end <= written))
    }
}

impl<R: Read + Seek, W: FnMut() -> bool> Read for Growing<R, W> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        while self.at >= self.whole {
            if let Some(end) = self.next_end()? {
                self.whole = end;
            } else if !(self.wait)() {
                self.whole = u64::MAX;
            }
        }
        let most =
            usize::try_from(self.whole - self.at).map_or(buffer.len(), |whole| whole.min(buffer.len()));
        self.input.seek(SeekFrom::Start(self.at))?;
        let count = self.input.read(&mut buffer[..most])?;
        self.at += count as u64;
        Ok(count)
    }
}

/// Where the recording of a followed log goes.
#[derive(Debug, Clone, Copy)]
pub enum Towards<'a> {
    /// Into a file, which grows with the log.
    File(&'a Path, Overwrite),
    /// To the viewer at an address such as `rerun+http://127.0.0.1:9876/proxy`.
    Viewer(&'a str),
}

/// Records a log while it is written, until its end mark, or until `wait` says that nothing more is expected.
///
/// # Errors
/// The log cannot be used, or the recording cannot be written or sent.
pub fn follow_file(
    log_path: &Path,
    towards: Towards<'_>,
    mut wait: impl FnMut() -> bool,
) -> Result<Exported, ExportError> {
    if let Towards::File(path, overwrite) = towards {
        refuse_loss(log_path, path, overwrite)?;
    }
    let survey = beginning(log_path, &mut wait)?;
    let cannot_read = |source| LogError::Read { name: log_path.display().to_string(), source };
    let growing = Growing::new(File::open(log_path).map_err(cannot_read)?, wait);
    let mut log =
        FlightLog::read(log_path.display().to_string(), BufReader::with_capacity(1 << 20, growing))?;
    match towards {
        Towards::File(path, overwrite) => {
            // Without a buffer, so that whoever reads the file sees what is written.
            let output = create_in_place(path, overwrite)?;
            let writer = RrdWriter::new(identity::builder(log.name(), &survey), output, Batches::Prompt)?;
            Shown::expected(&survey).send(writer.recording())?;
            let exported = fill(writer.recording(), &mut log, &survey, Pace::Live)?;
            writer.finish()?.sync_data().map_err(|source| cannot_write(path, source))?;
            Ok(exported)
        }
        Towards::Viewer(address) => show(&mut log, &survey, address, Pace::Live),
    }
}

/// What the log says of its run, once its first record is there. The head of our own logs stands before that.
fn beginning(path: &Path, wait: &mut impl FnMut() -> bool) -> Result<Survey, ExportError> {
    loop {
        let read = File::open(path)
            .and_then(|file| Survey::of_beginning(BufReader::with_capacity(1 << 20, file)))
            .map_err(|source| LogError::Read { name: path.display().to_string(), source });
        match read {
            Ok(survey) if survey.first_log_time_ns.is_some() => return Ok(survey),
            // Its writer may not have begun.
            Err(LogError::Read { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(error.into()),
            Ok(_) => {}
        }
        if !wait() {
            // The reader says what is wrong with it.
            return Ok(Survey::default());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::io::Cursor;

    /// A file that others write while it is read.
    struct Shared<'a>(&'a RefCell<Cursor<Vec<u8>>>);

    impl Read for Shared<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            self.0.borrow_mut().read(buffer)
        }
    }

    impl Seek for Shared<'_> {
        fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
            self.0.borrow_mut().seek(to)
        }
    }

    fn record(len: u64, content: &[u8]) -> Vec<u8> {
        [&[mcap::records::op::CHUNK][..], &len.to_le_bytes(), content].concat()
    }

    /// A record is read once it is whole: not while its length is a placeholder, nor while its end is missing. What is left
    /// when nothing more is expected is read as it is.
    #[test]
    fn a_growing_log_is_read_in_whole_records() {
        let head = mcap::MAGIC.to_vec();
        let stages = [
            head[..3].to_vec(),
            head.clone(),
            [&head[..], &record(u64::MAX, b"abc")].concat(),
            [&head[..], &record(6, b"abc")].concat(),
            [&head[..], &record(6, b"abcdef")].concat(),
            [&head[..], &record(6, b"abcdef"), &record(u64::MAX, b"ghi")].concat(),
        ];
        let last = stages[5].clone();
        let written = RefCell::new(Cursor::new(Vec::new()));
        let mut later = VecDeque::from(stages);
        let wait = || {
            let Some(next) = later.pop_front() else { return false };
            *written.borrow_mut().get_mut() = next;
            true
        };
        let mut growing = Growing::new(Shared(&written), wait);
        let mut all = vec![0; 23];
        growing.read_exact(&mut all).unwrap();
        assert_eq!(all, last[..23], "the magic and the first record");
        assert_eq!(written.borrow().get_ref().len(), 23, "as soon as it is whole");
        growing.read_to_end(&mut all).unwrap();
        assert_eq!(all, last);
    }
}
