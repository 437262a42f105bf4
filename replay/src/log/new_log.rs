//! Creates a log file for a re-flown or imported flight.

use std::io::{BufWriter, Write as _};
use std::path::Path;

use protocol::log::record::Record;
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};

use crate::output::{Destination, NewFile};

/// A log being written; see [`NewFile`].
pub(crate) struct NewLog {
    writer: LogWriter<BufWriter<NewFile>>,
}

/// Why a new log could not be written.
pub(crate) enum NewLogError {
    /// The file exists or cannot be created.
    Create(std::io::Error),
    /// Writing failed.
    Write(LogWriteError),
}

impl NewLog {
    pub(crate) fn create(
        destination: Destination,
        input: &Path,
        header: &LogHeader,
    ) -> Result<Self, NewLogError> {
        let file = NewFile::create(destination, input).map_err(NewLogError::Create)?;
        let writer = LogWriter::new(BufWriter::new(file), header).map_err(NewLogError::Write)?;
        Ok(Self { writer })
    }

    pub(crate) fn write(&mut self, record: &Record, time_ns: u64) -> Result<(), NewLogError> {
        self.writer.write(record, time_ns).map_err(NewLogError::Write)
    }

    pub(crate) fn finish(self) -> Result<(), NewLogError> {
        let failed = |error| NewLogError::Write(mcap::McapError::from(error).into());
        let mut file = self.writer.finish().map_err(NewLogError::Write)?;
        file.flush().map_err(failed)?;
        let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
        file.commit().map_err(failed)
    }
}
