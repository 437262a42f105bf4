//! Writes a recorded flight as the stream that a board reads, and its recorded decisions as the answers to be expected.

use std::io;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use avionics::board::stream::{Answer, Begin, Frame, put};
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};

use crate::controller::SETTINGS_IN_FLIGHT;
use crate::log::{Entry, FlightLog, LogError};
use crate::output::{Destination, NewFile, Overwrite, WriteError};

/// Why a flight cannot be given to a board.
#[derive(Debug, thiserror::Error)]
pub enum FramesError {
    #[error(transparent)]
    Log(#[from] LogError),
    #[error("{file}: {reason}")]
    NotWhole { file: String, reason: &'static str },
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A file of records, which gets its name when it is complete.
struct Records<'p> {
    path: &'p Path,
    file: BufWriter<NewFile>,
}

impl<'p> Records<'p> {
    fn create(path: &'p Path, overwrite: Overwrite, log: &Path) -> Result<Self, FramesError> {
        Ok(Self { path, file: BufWriter::new(NewFile::create(Destination { path, overwrite }, log)?) })
    }

    fn send(&mut self, record: &impl prost::Message) -> Result<(), FramesError> {
        let mut bytes = Vec::new();
        put(record, &mut bytes);
        Ok(self.file.write_all(&bytes).map_err(WriteError::at(self.path))?)
    }

    fn finish(self) -> Result<(), FramesError> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error);
        Ok(file.map_err(WriteError::at(self.path))?.commit()?)
    }
}

/// Writes the frames of the flight in `log` to the file `frames` of a directory, which is made if needed, and what it
/// decided in them to the file `recorded`. Returns the number of frames. A file gets its name when both are complete.
///
/// # Errors
/// A file exists and may not be replaced; the log cannot be read, is damaged, or does not hold one flight from its start
/// on; or a file cannot be written.
pub fn write_frames<'a>(log: &Path, directory: impl Into<Destination<'a>>) -> Result<u64, FramesError> {
    let Destination { path: directory, overwrite } = directory.into();
    let opened = FlightLog::open(log)?;
    let made = !directory.exists();
    std::fs::create_dir_all(directory).map_err(WriteError::at(directory))?;
    let written = write_into(directory, overwrite, log, opened);
    if written.is_err() && made {
        // Nothing is left behind. If this fails, an empty directory is.
        let _ = std::fs::remove_dir(directory);
    }
    written
}

fn write_into<R: io::Read>(
    directory: &Path,
    overwrite: Overwrite,
    path: &Path,
    mut log: FlightLog<R>,
) -> Result<u64, FramesError> {
    let files = [directory.join("frames"), directory.join("recorded")];
    let mut inputs = Records::create(&files[0], overwrite, path)?;
    let mut expected = Records::create(&files[1], overwrite, path)?;
    let (mut begin, mut written) = (None, 0);
    let not_whole =
        |log: &FlightLog<_>, reason| FramesError::NotWhole { file: log.name().to_owned(), reason };
    while let Some(stamped) = log.next_entry()? {
        match stamped.entry {
            // The computer of a flight from power-up needs no other start.
            Entry::ComputerStart(start) if start.released && written > 0 => {}
            Entry::ComputerStart(_) if begin.is_some() || written > 0 => {
                return Err(not_whole(&log, "has more than one flight"));
            }
            Entry::ComputerStart(start) => {
                begin = Some(beginning(&log, *start).map_err(|reason| not_whole(&log, reason))?);
            }
            Entry::ComputerFrame(frame) if begin.is_some() || written > 0 => {
                let ComputerFrame { input, output, state_digest } = frame.record;
                let frame = input.frame;
                inputs.send(&Frame { input, begin: begin.take() })?;
                expected.send(&Answer { frame, output, state_digest, heard: None })?;
                written += 1;
            }
            Entry::ComputerFrame(_) => {
                return Err(not_whole(&log, "the start of its flight is missing"));
            }
            Entry::Unreadable { .. } => {
                return Err(not_whole(&log, "has a record that this build cannot read"));
            }
            _ => {}
        }
    }
    if log.damage().is_some() {
        return Err(not_whole(&log, "is damaged"));
    }
    if written == 0 {
        return Err(not_whole(&log, "has no frames of a flight computer from its start on"));
    }
    inputs.finish()?;
    expected.finish()?;
    Ok(written)
}

/// What the computer of a log is built from, besides its record of the start.
fn beginning<R: io::Read>(log: &FlightLog<R>, start: ComputerStart) -> Result<Begin, &'static str> {
    let head = log.head();
    if head.run.contains_key(SETTINGS_IN_FLIGHT) {
        return Err("its settings were changed in flight");
    }
    let Some(Ok(toml)) = &head.profile_toml else {
        return Err("has no mission or profile before its first frame");
    };
    Ok(Begin { toml: toml.clone(), start, on_the_air: None, flight: 0 })
}
