//! Opens the log and makes sure that it is finished whatever happens.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use protocol::log::recorder::{Recorder, RecorderError};
use protocol::log::writer::LogHeader;
use time::OffsetDateTime;
use time::macros::format_description;

use crate::cli::LogChoice;
use crate::model::station_log::LogSpace;

/// How many logs may start in the same second.
const SAME_SECOND_MAX: u32 = 100;

/// Opens the chosen log and the telemetry log beside it; `Ok(None)` if no log is wanted.
///
/// # Errors
/// A file exists or cannot be created, or a telemetry log is wanted without a log.
pub fn open(
    choice: Option<&LogChoice>,
    tlog: Option<&LogChoice>,
    header: &LogHeader,
) -> anyhow::Result<Option<Recorder>> {
    match choice {
        Some(LogChoice::None) => {
            let alone = matches!(tlog, Some(LogChoice::File(_)));
            anyhow::ensure!(!alone, "--tlog writes beside a log; do not give --log none");
            Ok(None)
        }
        Some(LogChoice::File(path)) => {
            Ok(Some(Recorder::create_with_tlog(path, tlog_path(tlog, path).as_deref(), header)?))
        }
        None => open_named_by_time(Path::new(""), tlog, header).map(Some),
    }
}

/// The named telemetry log, or the name of the log with the extension `.tlog`.
fn tlog_path(tlog: Option<&LogChoice>, log: &Path) -> Option<PathBuf> {
    match tlog {
        None => Some(log.with_extension("tlog")),
        Some(LogChoice::None) => None,
        Some(LogChoice::File(path)) => Some(path.clone()),
    }
}

fn open_named_by_time(
    directory: &Path,
    tlog: Option<&LogChoice>,
    header: &LogHeader,
) -> anyhow::Result<Recorder> {
    let start = OffsetDateTime::from_unix_timestamp_nanos(i128::from(header.start_unix_ns))
        .context("the system clock is invalid")?;
    let stamp = start.format(format_description!("[year][month][day]-[hour][minute][second]"))?;
    for number in 1..=SAME_SECOND_MAX {
        let suffix = if number == 1 { String::new() } else { format!("-{number}") };
        let path = directory.join(format!("touchdown-{stamp}{suffix}.mcap"));
        match Recorder::create_with_tlog(&path, tlog_path(tlog, &path).as_deref(), header) {
            Err(RecorderError::Create { path: refused, source })
                if refused == path && source.kind() == std::io::ErrorKind::AlreadyExists => {}
            other => return Ok(other?),
        }
    }
    anyhow::bail!(
        "touchdown-{stamp}.mcap and {SAME_SECOND_MAX} others exist already; name the log with --log"
    )
}

/// How often the space is looked at; the rate is a mean over this time.
const LOOKS_EVERY: Duration = Duration::from_secs(5);

/// Watches the space that is left for the log, and how fast it grows.
#[derive(Debug, Default)]
pub struct SpaceWatch {
    due: Duration,
    /// When the files had how many bytes.
    last: Option<(Duration, u64)>,
    space: Option<LogSpace>,
}

impl SpaceWatch {
    /// The space as it was last looked at; `None` where the system does not tell it.
    pub fn look(&mut self, recorder: &Recorder, now: Duration) -> Option<LogSpace> {
        if now < self.due {
            return self.space;
        }
        self.due = now + LOOKS_EVERY;
        let folder = recorder.path().parent().filter(|folder| !folder.as_os_str().is_empty());
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |facts| facts.len());
        let bytes = size(recorder.path()) + recorder.tlog_path().map_or(0, size);
        let last = self.last.replace((now, bytes));
        let grows_bytes_s = last.map_or(0.0, |(at, before)| {
            bytes.saturating_sub(before) as f64 / now.saturating_sub(at).as_secs_f64().max(1.0)
        });
        let free = fs4::available_space(folder.unwrap_or(Path::new("."))).ok();
        self.space = free.map(|free_bytes| LogSpace { free_bytes, grows_bytes_s: grows_bytes_s as u32 });
        self.space
    }
}

/// Finishes the log when it goes out of scope, also while a panic unwinds.
pub struct LogGuard {
    recorder: Option<Recorder>,
}

impl LogGuard {
    /// Guards a log, if there is one.
    pub fn new(recorder: Option<Recorder>) -> Self {
        Self { recorder }
    }

    /// Deletes the log again, because the run has failed before it began.
    pub fn discard(mut self) {
        if let Some(recorder) = self.recorder.take() {
            // Why the run has failed is being reported.
            let _ = recorder.discard();
        }
    }

    /// Finishes the log and returns its path.
    ///
    /// # Errors
    /// A record could not be written.
    pub fn finish(mut self) -> Result<Option<PathBuf>, RecorderError> {
        self.recorder.take().map(|recorder| recorder.finish()).transpose()
    }
}

impl Drop for LogGuard {
    fn drop(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            // Another error is already being reported.
            let _ = recorder.finish();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::log::reader::{LogItem, LogReader};
    use protocol::log::record::{Event, EventLevel, Record};

    #[test]
    fn a_log_is_never_overwritten() {
        let directory = tempfile::tempdir().unwrap();
        let header = LogHeader { start_unix_ns: 1_800_000_000_000_000_000, ..LogHeader::default() };
        let names: Vec<String> = (0..3)
            .map(|_| {
                let recorder = open_named_by_time(directory.path(), None, &header).unwrap();
                assert!(recorder.tlog_path().unwrap().with_extension("mcap") == recorder.path());
                recorder.finish().unwrap().file_name().unwrap().to_string_lossy().into_owned()
            })
            .collect();
        assert_eq!(
            names,
            [
                "touchdown-20270115-080000.mcap",
                "touchdown-20270115-080000-2.mcap",
                "touchdown-20270115-080000-3.mcap"
            ]
        );
    }

    #[test]
    fn a_panic_ends_the_log_properly() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("panic.mcap");
        let recorder = Recorder::create(&path, &LogHeader::default()).unwrap();
        let event =
            Event { level: EventLevel::Info, name: "ground".to_owned(), message: "before".to_owned() };
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _guard = LogGuard::new(Some(recorder.clone()));
            recorder.try_record(Record::Event(event), 0);
            panic!("drawing went wrong");
        }));
        assert!(panicked.is_err());
        let mut reader = LogReader::new(std::fs::File::open(&path).unwrap());
        let mut messages = 0;
        while let Some(item) = reader.next_item().unwrap() {
            messages += usize::from(matches!(item, LogItem::Message { .. }));
        }
        assert_eq!((messages, reader.damage()), (1, None));
    }
}
