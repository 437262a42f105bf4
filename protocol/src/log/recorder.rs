//! Writes a log file in a separate thread, so that neither the control loop nor the screen waits
//! for a disk.
//!
//! The queue is bounded. [`Recorder::record`] waits for room (for a simulation, whose clock can
//! wait); [`Recorder::try_record`] never waits and counts what it drops. At least every 200 ms and
//! at every [`Recorder::sync_soon`] the open chunk is ended and written to the operating system, so
//! a killed process loses no more than that. A second thread syncs the file to the disk, so that a
//! slow disk does not lengthen the 200 ms.
//!
//! The system reports a disk error once for an open file: the sync after it succeeds although data
//! is lost. So every failure is stored where it happens, and [`Recorder::is_intact`] and
//! [`Recorder::finish`] read it.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::record::Record;
use super::tlog::TlogWriter;
use super::writer::{LogHeader, LogWriteError, LogWriter};
use crate::text::printable;

/// A disk may stall for 16 s at the 2,000 records a second of a flight.
const QUEUE_RECORDS: usize = 32_768;
const FLUSH_INTERVAL: Duration = Duration::from_millis(200);
/// Minimum interval of requested syncs: each ends a chunk, for which the writer stores an entry of
/// the index at the end.
const SYNC_APART: Duration = Duration::from_millis(100);

/// Why recording could not start or did not end well.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// The file could not be created.
    #[error("cannot create the log {}", path.display())]
    Create {
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// Writing failed; data synced before can still be read.
    #[error("cannot write the log {}", path.display())]
    Write {
        path: PathBuf,
        /// The writer's error.
        source: LogWriteError,
    },
    /// The writing thread has panicked.
    #[error("the log writer of {} stopped unexpectedly", path.display())]
    Gone { path: PathBuf },
}

/// The file of a log as the disk sees it.
trait Disk: Send + Sync + 'static {
    fn sync(&self) -> io::Result<()>;
    fn len_bytes(&self) -> io::Result<u64>;
}

impl Disk for File {
    fn sync(&self) -> io::Result<()> {
        self.sync_data()
    }

    fn len_bytes(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }
}

enum Order {
    Write(Box<Record>, u64),
    SyncSoon,
    Mark,
    Finish,
}

/// A handle to a log that is being written. Clones write into the same log.
#[derive(Clone)]
pub struct Recorder {
    orders: SyncSender<Order>,
    shared: Arc<Shared>,
}

struct Shared {
    path: PathBuf,
    tlog_path: Option<PathBuf>,
    /// The open files: their content can be read even after somebody has removed them.
    files: Vec<(PathBuf, File)>,
    dropped: AtomicU64,
    failed: AtomicBool,
    /// Length of the log up to the mark, bytes; 0 without one.
    marked_bytes: AtomicU64,
    thread: Mutex<Option<JoinHandle<Result<(), LogWriteError>>>>,
}

/// Sets the flag if the thread that holds it panics.
struct FailedByPanic(Arc<Shared>);

impl Drop for FailedByPanic {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(true, Ordering::Release);
        }
    }
}

/// How many names are tried for a file or a folder.
const NAMES_MAX: u32 = 100;

/// Makes something under the first of `flight.mcap`, `flight-2.mcap`, `flight-3.mcap` and so on
/// that is free, and returns it with its name.
///
/// # Errors
/// It cannot be made, or no name is free. `make` fails with [`io::ErrorKind::AlreadyExists`] where
/// something is that could be lost.
pub fn under_free_name<T>(
    requested: &Path,
    mut make: impl FnMut(&Path) -> io::Result<T>,
) -> io::Result<(PathBuf, T)> {
    for name in (1..=NAMES_MAX).map(|number| numbered(requested, number)) {
        match make(&name) {
            Err(taken) if taken.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|made| (name, made)),
        }
    }
    Err(io::Error::new(io::ErrorKind::AlreadyExists, "it exists, and no name like it is free: give another"))
}

/// The message if the name differs from the requested one.
pub fn other_name(requested: &Path, free: &Path) -> Option<String> {
    let words = || format!("{} exists and is kept; {} is written", requested.display(), free.display());
    (requested != free).then(|| printable(words().as_bytes()))
}

/// Whether a path is a pipe or a device: it has no content that could be lost, and no alternative
/// name. The same holds for files in `/dev` itself: `/dev/stdout` may be a file.
pub fn is_device(path: &Path) -> bool {
    path.parent() == Some(Path::new("/dev"))
        || std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// `flight.mcap` for 1, `flight-2.mcap` for 2.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().filter(|_| number > 1 && !is_device(path));
    let Some(stem) = stem else { return path.to_owned() };
    let mut name = stem.to_owned();
    name.push(format!("-{number}"));
    path.with_file_name(name).with_added_extension(path.extension().unwrap_or_default())
}

impl Recorder {
    /// Creates the file and starts the writing thread, under the first free name of `flight.mcap`,
    /// `flight-2.mcap`, `flight-3.mcap` and so on: nothing is overwritten, and the same command
    /// works again after a crash. A telemetry log of the ground's raw frames beside
    /// it has the same name and the extension `.tlog`.
    ///
    /// # Errors
    /// No name is free, a file cannot be created, or the header cannot be written.
    pub fn create(at: &Path, with_tlog: bool, header: &LogHeader) -> Result<Self, RecorderError> {
        let mut tried = PathBuf::new();
        let mut create = |path: &Path| {
            path.clone_into(&mut tried);
            File::options().write(true).read(true).create_new(true).open(path)
        };
        let created = under_free_name(at, |log| {
            let file = create(log)?;
            if !with_tlog {
                return Ok((file, None));
            }
            let tlog = log.with_extension("tlog");
            // The log file was created a moment ago and is empty; if it stayed, the next attempt
            // would fail.
            let made = create(&tlog).inspect_err(|_refused| _ = std::fs::remove_file(log))?;
            Ok((file, Some((tlog, TlogWriter::new(BufWriter::new(made), header.start_unix_ns)))))
        });
        let (path, (file, tlog)) = created.map_err(|source| RecorderError::Create { path: tried, source })?;
        let create_error = |source| RecorderError::Create { path: path.clone(), source };
        let paths = [Some(&path), tlog.as_ref().map(|(tlog, _)| tlog)];
        let opened = paths.into_iter().flatten().map(|path| Ok((path.clone(), File::open(path)?)));
        let files = opened.collect::<io::Result<_>>().map_err(create_error)?;
        let disk = file.try_clone().map_err(create_error)?;
        let writer = LogWriter::new(BufWriter::new(file), header)
            .map_err(|source| RecorderError::Write { path: path.clone(), source })?;
        let (tlog_path, tlog) = tlog.unzip();
        Self::start((path.clone(), tlog_path, files), (writer, tlog), disk).map_err(create_error)
    }

    /// Starts the two threads.
    fn start<W: Write + Seek + Send + 'static>(
        (path, tlog_path, files): (PathBuf, Option<PathBuf>, Vec<(PathBuf, File)>),
        (writer, tlog): (LogWriter<W>, Option<TlogWriter<BufWriter<File>>>),
        disk: impl Disk,
    ) -> io::Result<Self> {
        let (orders, inbox) = sync_channel(QUEUE_RECORDS);
        let shared = Arc::new(Shared {
            path,
            tlog_path,
            files,
            dropped: AtomicU64::new(0),
            failed: AtomicBool::new(false),
            marked_bytes: AtomicU64::new(0),
            thread: Mutex::new(None),
        });
        let disk = Arc::new(disk);
        let (sync_wanted, wishes) = sync_channel::<()>(1);
        let (synced, for_syncing) = (Arc::clone(&disk), Arc::clone(&shared));
        let syncing = std::thread::Builder::new().name("log sync".to_owned()).spawn(move || {
            let _watch = FailedByPanic(Arc::clone(&for_syncing));
            let mut first_error = None;
            while wishes.recv().is_ok() {
                if let Err(error) = synced.sync() {
                    for_syncing.failed.store(true, Ordering::Release);
                    first_error.get_or_insert(error);
                }
            }
            first_error
        })?;
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            let _watch = FailedByPanic(Arc::clone(&for_thread));
            let mut ended =
                write_until_finished(writer, tlog, &*disk, &inbox, &sync_wanted, &for_thread.marked_bytes);
            // The other thread ends with its last sync.
            drop(sync_wanted);
            let lost = match syncing.join() {
                Ok(lost) => lost,
                Err(_panic) => Some(io::Error::other("the thread that syncs the log stopped unexpectedly")),
            };
            if let (Ok(()), Some(error)) = (&ended, lost) {
                ended = Err(mcap::McapError::from(error).into());
            }
            if ended.is_err() {
                for_thread.failed.store(true, Ordering::Release);
            }
            ended
        })?;
        if let Ok(mut slot) = shared.thread.lock() {
            *slot = Some(thread);
        }
        Ok(Self { orders, shared })
    }

    pub fn path(&self) -> &Path {
        &self.shared.path
    }

    /// Path of the `.tlog` file, if one is written.
    pub fn tlog_path(&self) -> Option<&Path> {
        self.shared.tlog_path.as_deref()
    }

    /// Returns how many records were dropped because the queue was full or the writer had stopped.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Returns whether nothing has failed so far: neither a write nor a sync nor a thread.
    pub fn is_intact(&self) -> bool {
        !self.shared.failed.load(Ordering::Acquire)
    }

    /// Writes a record and waits for room in the queue; `time_ns` counts from the start of the run.
    pub fn record(&self, record: Record, time_ns: u64) {
        if self.orders.send(Order::Write(Box::new(record), time_ns)).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Writes a record if there is room, and otherwise counts it as dropped.
    pub fn try_record(&self, record: Record, time_ns: u64) {
        if self.orders.try_send(Order::Write(Box::new(record), time_ns)).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Asks that everything up to here is synced to the disk now; called at every change of phase.
    pub fn sync_soon(&self) {
        // If the queue is full, it is being written anyway, and the timer syncs it.
        let _ = self.orders.try_send(Order::SyncSoon);
    }

    /// Asks for a mark here: everything before it can be read from the file, and does not change
    /// any more. Returns whether there was room in the queue.
    pub fn mark_soon(&self) -> bool {
        self.orders.try_send(Order::Mark).is_ok()
    }

    /// Length of the file up to the last mark, bytes, once that is written.
    pub fn marked_bytes(&self) -> Option<u64> {
        Some(self.shared.marked_bytes.load(Ordering::Acquire)).filter(|bytes| *bytes > 0)
    }

    /// Files whose names no longer lead to them: somebody has removed or replaced them.
    fn removed(&self) -> impl Iterator<Item = &(PathBuf, File)> {
        let is_there = |path: &Path, file: &File| {
            let [there, ours] = [std::fs::metadata(path).ok()?, file.metadata().ok()?];
            Some((there.dev(), there.ino()) == (ours.dev(), ours.ino()))
        };
        self.shared.files.iter().filter(move |(path, file)| is_there(path, file) != Some(true))
    }

    /// Returns whether somebody has removed a file. [`Self::finish`] writes it again.
    pub fn is_removed(&self) -> bool {
        self.removed().next().is_some()
    }

    /// Reserves the names of removed files for [`Self::finish`].
    pub fn take_names(&self) {
        for (path, _) in self.removed() {
            // If the name is in use by now, or the folder no longer exists, the end reports it.
            let _ = File::create_new(path);
        }
    }

    /// Length of the files, bytes.
    pub fn len_bytes(&self) -> u64 {
        self.shared.files.iter().map(|(_, file)| file.len_bytes().unwrap_or(0)).sum()
    }

    /// Ends the log with its summary and waits until it is written. Records that other handles send
    /// later count as dropped. Removed files are written again under their names.
    ///
    /// # Errors
    /// A record could not be written or, at any time, not synced; everything synced before it can
    /// still be read. Or a removed file cannot be written again.
    pub fn finish(&self) -> Result<PathBuf, RecorderError> {
        let path = self.shared.path.clone();
        let thread = self.shared.thread.lock().ok().and_then(|mut slot| slot.take());
        let Some(thread) = thread else {
            return Ok(path);
        };
        // If the thread has ended already, joining it returns its error.
        let _ = self.orders.send(Order::Finish);
        match thread.join() {
            Ok(Ok(())) => {}
            Ok(Err(source)) => return Err(RecorderError::Write { path, source }),
            Err(_panic) => return Err(RecorderError::Gone { path }),
        }
        for (path, file) in self.removed() {
            restore(path, file).map_err(|source| RecorderError::Create { path: path.clone(), source })?;
        }
        Ok(path)
    }

    /// Ends the log and removes its files, because the run has failed before it began: their names
    /// are free for the next try.
    ///
    /// # Errors
    /// A file cannot be removed. Whether it was written completely does not matter any more.
    pub fn discard(&self) -> io::Result<()> {
        let _ = self.finish();
        let files = [Some(self.path()), self.tlog_path()];
        files.into_iter().flatten().try_for_each(std::fs::remove_file)
    }
}

fn restore(path: &Path, mut file: &File) -> io::Result<()> {
    let mut again = File::options().append(true).create(true).open(path)?;
    if again.metadata()?.len() > 0 {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    file.rewind()?;
    io::copy(&mut file, &mut again)?;
    again.sync_data()
}

#[expect(clippy::disallowed_methods, reason = "the flush timer is about the disk, not about the flight")]
fn write_until_finished(
    mut writer: LogWriter<impl Write + Seek>,
    mut tlog: Option<TlogWriter<BufWriter<File>>>,
    disk: &impl Disk,
    inbox: &Receiver<Order>,
    sync_wanted: &SyncSender<()>,
    marked_bytes: &AtomicU64,
) -> Result<(), LogWriteError> {
    let mut flush_due: Option<Instant> = None;
    let mut synced_at: Option<Instant> = None;
    loop {
        let order = match flush_due {
            None => inbox.recv().map_err(|_closed| RecvTimeoutError::Disconnected),
            Some(due) => inbox.recv_timeout(due.saturating_duration_since(Instant::now())),
        };
        match order {
            Ok(Order::Write(record, time_ns)) => {
                writer.write(&record, time_ns)?;
                if let Some(tlog) = &mut tlog {
                    tlog.write(&record, time_ns).map_err(mcap::McapError::from)?;
                }
                let due = *flush_due.get_or_insert_with(|| Instant::now() + FLUSH_INTERVAL);
                // Under a steady stream of records the receive never times out.
                if Instant::now() >= due {
                    hand_over(&mut writer, tlog.as_mut(), sync_wanted)?;
                    flush_due = None;
                }
            }
            Ok(Order::SyncSoon) if synced_at.is_some_and(|at| at.elapsed() < SYNC_APART) => {
                let due = synced_at.unwrap_or_else(Instant::now) + SYNC_APART;
                flush_due = Some(flush_due.map_or(due, |at| at.min(due)));
            }
            Ok(Order::SyncSoon) | Err(RecvTimeoutError::Timeout) => {
                synced_at = Some(Instant::now());
                hand_over(&mut writer, tlog.as_mut(), sync_wanted)?;
                flush_due = None;
            }
            Ok(Order::Mark) => {
                hand_over(&mut writer, tlog.as_mut(), sync_wanted)?;
                flush_due = None;
                let bytes = disk.len_bytes().map_err(mcap::McapError::from)?;
                marked_bytes.store(bytes, Ordering::Release);
            }
            Ok(Order::Finish) | Err(RecvTimeoutError::Disconnected) => {
                if let Some(tlog) = &mut tlog {
                    tlog.flush().map_err(mcap::McapError::from)?;
                }
                let mut output = writer.finish()?;
                output.flush().map_err(mcap::McapError::from)?;
                return disk.sync().map_err(|error| mcap::McapError::from(error).into());
            }
        }
    }
}

/// Writes everything to the operating system, which preserves it even if this process is killed,
/// and lets the other thread sync it to the disk, which may take longer than one flush interval.
fn hand_over(
    writer: &mut LogWriter<impl Write + Seek>,
    tlog: Option<&mut TlogWriter<BufWriter<File>>>,
    sync_wanted: &SyncSender<()>,
) -> Result<(), LogWriteError> {
    writer.flush()?;
    if let Some(tlog) = tlog {
        tlog.flush().map_err(mcap::McapError::from)?;
    }
    // A full queue means that a sync is already requested.
    let _ = sync_wanted.try_send(());
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, SeekFrom};

    use super::*;
    use crate::log::record::{Event, EventLevel};

    /// Fails at one sync only, as Linux reports a disk error, and records here that it has.
    struct FailsOnce {
        failing_sync: u64,
        syncs: AtomicU64,
        happened: SyncSender<()>,
    }

    impl Disk for FailsOnce {
        fn sync(&self) -> io::Result<()> {
            if self.syncs.fetch_add(1, Ordering::Relaxed) == self.failing_sync {
                let _ = self.happened.try_send(());
                return Err(io::Error::other("no disk"));
            }
            Ok(())
        }

        fn len_bytes(&self) -> io::Result<u64> {
            Ok(1)
        }
    }

    /// Panics at the first write after `calm` of them.
    struct Panics {
        inner: Cursor<Vec<u8>>,
        calm: u32,
    }

    impl Write for Panics {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.calm = self.calm.checked_sub(1).expect("the writer panics here");
            self.inner.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Panics {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.inner.seek(to)
        }
    }

    fn event() -> Record {
        Record::Event(Event { level: EventLevel::Info, name: "test".to_owned(), message: "here".to_owned() })
    }

    fn started<W: Write + Seek + Send + 'static>(output: W, disk: impl Disk) -> Recorder {
        let writer = LogWriter::new(output, &LogHeader::default()).unwrap();
        Recorder::start((PathBuf::from("of a test"), None, Vec::new()), (writer, None), disk).unwrap()
    }

    #[test]
    fn a_disk_error_at_one_sync_of_many_persists_to_the_end() {
        let (happened, seen) = sync_channel(1);
        let disk = FailsOnce { failing_sync: 0, syncs: AtomicU64::new(0), happened };
        let recorder = started(Cursor::new(Vec::new()), disk);
        recorder.record(event(), 0);
        recorder.sync_soon();
        seen.recv().unwrap();
        let ended = recorder.finish();
        assert!(matches!(ended, Err(RecorderError::Write { .. })), "{ended:?}");
        assert!(!recorder.is_intact());
    }

    #[test]
    fn a_recorder_thread_that_panics_has_failed() {
        let (happened, _) = sync_channel(1);
        let disk = FailsOnce { failing_sync: u64::MAX, syncs: AtomicU64::new(0), happened };
        let recorder = started(Panics { inner: Cursor::new(Vec::new()), calm: 1_000 }, disk);
        // Every mark ends a chunk, which is a write at least.
        for k in 0..2_000 {
            recorder.record(event(), k);
            recorder.mark_soon();
        }
        let ended = recorder.finish();
        assert!(matches!(ended, Err(RecorderError::Gone { .. })), "{ended:?}");
        assert!(!recorder.is_intact());
    }

    #[test]
    fn without_an_error_a_log_stays_intact() {
        let (happened, _) = sync_channel(1);
        let disk = FailsOnce { failing_sync: u64::MAX, syncs: AtomicU64::new(0), happened };
        let recorder = started(Cursor::new(Vec::new()), disk);
        recorder.record(event(), 0);
        recorder.sync_soon();
        assert!(recorder.finish().is_ok());
        assert!(recorder.is_intact());
    }
}
