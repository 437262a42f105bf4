//! Follows a log while a vehicle or a ground station writes it.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use replay::log::{FlightLog, LogError};

use crate::ExportError;
use crate::export::{Exported, Pace, Shown, fill};
use crate::file::{Overwrite, cannot_write, create_in_place, refuse_loss};
use crate::identity;
use crate::rrd::{Batches, RrdWriter};
use crate::survey::Survey;
use crate::viewer::Viewer;

/// A file that grows. It ends when `wait` says that nothing more is expected.
#[derive(Debug)]
pub struct Growing<R, W> {
    input: R,
    wait: W,
}

impl<R: Read, W: FnMut() -> bool> Growing<R, W> {
    /// `wait` is called at each end of what is written so far: it waits a while, and says whether to look again.
    pub fn new(input: R, wait: W) -> Self {
        Self { input, wait }
    }
}

impl<R: Read, W: FnMut() -> bool> Read for Growing<R, W> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            let count = self.input.read(buffer)?;
            if count > 0 || buffer.is_empty() || !(self.wait)() {
                return Ok(count);
            }
        }
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
    let file = BufReader::with_capacity(1 << 20, File::open(log_path).map_err(cannot_read)?);
    let mut log = FlightLog::read(log_path.display().to_string(), Growing::new(file, wait))?;
    let builder = identity::builder(log.name(), &survey);
    match towards {
        Towards::File(path, overwrite) => {
            // Without a buffer, so that whoever reads the file sees what is written.
            let output = create_in_place(path, overwrite)?;
            let writer = RrdWriter::new(builder, output, Batches::Prompt)?;
            Shown::expected(&survey).send(writer.recording())?;
            let exported = fill(writer.recording(), &mut log, &survey, Pace::Live)?;
            writer.finish()?.sync_data().map_err(|source| cannot_write(path, source))?;
            Ok(exported)
        }
        Towards::Viewer(address) => {
            let viewer = Viewer::connect(builder, address, Batches::Prompt)?;
            Shown::expected(&survey).send(viewer.recording())?;
            viewer.arrived()?;
            let exported = fill(viewer.recording(), &mut log, &survey, Pace::Live)?;
            viewer.arrived()?;
            Ok(exported)
        }
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

    /// What is written while the reader waits is read; when nothing more comes, the input ends.
    #[test]
    fn a_growing_input_goes_on_until_nothing_more_is_expected() {
        let written = RefCell::new(VecDeque::from(b"first ".to_vec()));
        struct Shared<'a>(&'a RefCell<VecDeque<u8>>);
        impl Read for Shared<'_> {
            fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
                self.0.borrow_mut().read(buffer)
            }
        }
        let mut later = VecDeque::from([b"second ".as_slice(), b"", b"third"]);
        let wait = || {
            let Some(more) = later.pop_front() else { return false };
            written.borrow_mut().extend(more);
            true
        };
        let mut all = String::new();
        Growing::new(Shared(&written), wait).read_to_string(&mut all).unwrap();
        assert_eq!(all, "first second third");
    }
}
