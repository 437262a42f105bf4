//! A new log file, for what is flown again or imported.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use protocol::log::record::Record;
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};

/// A log being written; an existing file is never overwritten.
pub(crate) struct NewLog {
    writer: LogWriter<BufWriter<File>>,
}

/// Why a new log is not there.
pub(crate) enum NewLogError {
    /// The file exists, or cannot be made.
    Create(std::io::Error),
    /// Writing failed.
    Write(LogWriteError),
}

impl NewLog {
    pub(crate) fn create(path: &Path, header: &LogHeader) -> Result<Self, NewLogError> {
        let file = File::options().write(true).create_new(true).open(path).map_err(NewLogError::Create)?;
        let writer = LogWriter::new(BufWriter::new(file), header).map_err(NewLogError::Write)?;
        Ok(Self { writer })
    }

    pub(crate) fn write(&mut self, record: &Record, time_ns: u64) -> Result<(), NewLogError> {
        self.writer.write(record, time_ns).map_err(NewLogError::Write)
    }

    pub(crate) fn finish(self) -> Result<(), NewLogError> {
        let mut file = self.writer.finish().map_err(NewLogError::Write)?;
        file.flush().map_err(|error| NewLogError::Write(mcap::McapError::from(error).into()))
    }
}
