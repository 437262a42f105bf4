//! The files that a station writes: the log, the book in it, the signatures of a checklist, the
//! last position.

use std::fs;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use protocol::book::{Book, BookKey, Head, Line, OPENED, SignedHead};
use protocol::log::record::Record;
use protocol::log::recorder::{self, Recorder, RecorderError};
use protocol::log::writer::LogHeader;
use time::OffsetDateTime;
use time::macros::format_description;

use crate::cli::LogChoice;
use crate::model::{
    Checklist, ChecklistEntry, LastPlace, LogSpace, Remembered, Unfinished, entry_text, kml, parse_checklist,
    remembered,
};

/// Opens the chosen log, and with a real link a telemetry log beside it (`.tlog`, for other ground
/// stations); `Ok(None)` if no log is wanted. An existing log is preserved: the new one gets the
/// next free name.
///
/// # Errors
/// A file cannot be created.
pub fn open_log(log: Option<&LogChoice>, tlog: bool, header: &LogHeader) -> anyhow::Result<Option<Recorder>> {
    let path = match log {
        Some(LogChoice::None) => return Ok(None),
        Some(LogChoice::File(path)) => path.clone(),
        None => named_by_time(header)?,
    };
    Ok(Some(Recorder::create(&path, tlog, header)?))
}

fn named_by_time(header: &LogHeader) -> anyhow::Result<PathBuf> {
    let start = OffsetDateTime::from_unix_timestamp_nanos(i128::from(header.start_unix_ns))
        .context("the system clock is invalid")?;
    let stamp = start.format(format_description!("[year][month][day]-[hour][minute][second]"))?;
    Ok(PathBuf::from(format!("touchdown-{stamp}.mcap")))
}

/// The notice that the log has another name than the given one.
pub(super) fn other_name(choice: Option<&LogChoice>, log: Option<&Path>) -> Option<String> {
    let (Some(LogChoice::File(named)), Some(log)) = (choice, log) else { return None };
    recorder::other_name(named, log)
}

/// How often the space is measured; the rate is a mean over this time.
const MEASURED_EVERY: Duration = Duration::from_secs(5);

/// State of the log's files on the disk.
pub(super) struct LogFiles {
    path: PathBuf,
    bytes: u64,
    /// Free space beside them; `None` where the system does not report it.
    free_bytes: Option<u64>,
    removed: bool,
}

impl LogFiles {
    /// Queries the disk.
    pub(super) fn of(recorder: &Recorder) -> Self {
        let folder = recorder.path().parent().filter(|folder| !folder.as_os_str().is_empty());
        Self {
            path: recorder.path().to_owned(),
            bytes: recorder.len_bytes(),
            free_bytes: fs4::available_space(folder.unwrap_or(Path::new("."))).ok(),
            removed: recorder.is_removed(),
        }
    }
}

/// Tracks the space that is left for the log, how fast the log grows, and whether it still exists.
#[derive(Debug, Default)]
pub(super) struct LogWatch {
    /// A query of the disk is pending.
    pending: bool,
    due: Duration,
    /// When the files had how many bytes.
    last: Option<(Duration, u64)>,
    pub(super) space: Option<LogSpace>,
    pub(super) removed: bool,
}

impl LogWatch {
    /// Length of the log's files at the last measurement.
    pub(super) fn bytes(&self) -> u64 {
        self.last.map_or(0, |(_, bytes)| bytes)
    }

    /// Returns whether to query the disk now: the last query was answered.
    pub(super) fn begins(&mut self) -> bool {
        !std::mem::replace(&mut self.pending, true)
    }

    /// Stores the disk's answer about the files of the present log.
    pub(super) fn take(&mut self, found: &LogFiles, present: &Recorder, now: Duration) {
        self.pending = false;
        if found.path != present.path() {
            return;
        }
        self.removed = found.removed;
        if now < self.due {
            return;
        }
        self.due = now + MEASURED_EVERY;
        let last = self.last.replace((now, found.bytes));
        let grows_bytes_s = last.map_or(0.0, |(at, before)| {
            found.bytes.saturating_sub(before) as f64 / now.saturating_sub(at).as_secs_f64().max(1.0)
        });
        self.space =
            found.free_bytes.map(|free_bytes| LogSpace { free_bytes, grows_bytes_s: grows_bytes_s as u32 });
    }
}

/// The log that a guard finishes; a station that begins another log puts it here.
pub(super) type GuardedLog = Arc<Mutex<Option<Recorder>>>;

/// Finishes the log when it goes out of scope, also while a panic unwinds.
pub struct LogGuard(pub(super) GuardedLog);

impl LogGuard {
    /// Guards a log, if there is one.
    pub fn new(recorder: Option<Recorder>) -> Self {
        Self(Arc::new(Mutex::new(recorder)))
    }

    fn take(&self) -> Option<Recorder> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Deletes the log again, because the run has failed before it began.
    pub fn discard(self) {
        if let Some(log) = self.take() {
            // Why the run has failed is being reported.
            let _ = log.discard();
        }
    }

    /// Finishes the log and returns its path.
    ///
    /// # Errors
    /// A record could not be written.
    pub fn finish(self) -> Result<Option<PathBuf>, RecorderError> {
        self.take().map(|log| log.finish()).transpose()
    }
}

impl Drop for LogGuard {
    fn drop(&mut self) {
        if let Some(log) = self.take() {
            // Another error is already being reported.
            let _ = log.finish();
        }
    }
}

// Writes the station's book into its log, and signs its end.

/// How often the end is signed at most.
const SIGNED_EVERY: Duration = Duration::from_secs(2);

/// The book of this run.
pub(super) struct StationBook {
    book: Book,
    pub(super) key: Option<BookKey>,
    /// The last signed end, and when it was signed.
    signed: Option<(Head, Duration)>,
}

impl StationBook {
    /// Opens a book. `about` names its writer. Returns the book and its first record.
    pub(super) fn open(key: Option<BookKey>, about: &str, unix_ns: u64) -> (Self, Record) {
        let key_words = match &key {
            Some(key) => format!("signed with the key of public key {}", key.public()),
            None => "not signed: the station has no key".to_owned(),
        };
        let text = format!("{about}; {key_words}");
        let mut book = Self { book: Book::default(), key, signed: None };
        let record = book.enter(&Line { unix_ns, kind: OPENED, who: "", text: &text });
        (book, record)
    }

    pub(super) fn enter(&mut self, line: &Line) -> Record {
        Record::BookEntry(self.book.enter(line))
    }

    /// Signs the end if it has changed and the last signature is old enough, or `at_once`. Returns
    /// it with its record.
    pub(super) fn sign(&mut self, now: Duration, at_once: bool) -> Option<(SignedHead, Record)> {
        let head = self.book.head()?;
        let is_recent = |at: Duration| !at_once && now.saturating_sub(at) < SIGNED_EVERY;
        if self.signed.is_some_and(|(signed, at)| signed == head || is_recent(at)) {
            return None;
        }
        self.signed = Some((head, now));
        let signed = match &self.key {
            Some(key) => key.sign(head),
            None => SignedHead { head, signature: [0; 64] },
        };
        Some((signed, Record::BookHead(signed.record())))
    }
}

// The files of a checklist: its text, and beside it the list of its signatures.

/// Longer files are no checklists.
const BYTES_MAX: u64 = 64 * 1024;

/// The stored signatures of one checklist. The file only grows.
pub(super) struct SignatureFile {
    path: PathBuf,
    /// `None` before the first signature.
    file: Option<File>,
    /// Open for its lock: it excludes other stations while there is no file of signatures.
    checklist: File,
    hash: String,
}

/// Opens a checklist, and marks the steps signed today. Also returns the warnings for the crew.
///
/// # Errors
/// The checklist is wrong, its signatures cannot be written, or another station writes them.
pub(super) fn open_checklist(
    path: &Path,
    now_unix_s: u64,
) -> anyhow::Result<(Checklist, SignatureFile, Vec<String>)> {
    let shown = path.display();
    let mut text = String::new();
    let written = File::open(path).with_context(|| format!("the checklist {shown}"))?;
    lock(&written, path)?;
    (&written).take(BYTES_MAX).read_to_string(&mut text).with_context(|| format!("the checklist {shown}"))?;
    let mut checklist = parse_checklist(&text).with_context(|| format!("the checklist {shown}"))?;
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
        remembered(&String::from_utf8_lossy(&list), &checklist.hash, now_unix_s);
    let mut notes = Vec::new();
    for entry in &entries {
        checklist.apply(entry);
    }
    if outdated > 0 {
        notes.push(format!("{outdated} signatures of the checklist are not of today and do not count"));
    }
    if broken > 0 {
        notes.push(format!("{broken} entries of {} cannot be read and do not count", signed_path.display()));
    }
    let hash = checklist.hash.clone();
    let signatures_file = SignatureFile { path: signed_path.clone(), file, checklist: written, hash };
    Ok((checklist, signatures_file, notes))
}

/// Locks a file against other stations while it is open.
fn lock(file: &File, path: &Path) -> anyhow::Result<()> {
    file.try_lock().map_err(|error| match error {
        std::fs::TryLockError::WouldBlock => anyhow::anyhow!(
            "another station writes {}: attach a screen to it to sign (`ground attach`)",
            path.display()
        ),
        std::fs::TryLockError::Error(error) => {
            anyhow::Error::from(error).context(format!("locking {}", path.display()))
        }
    })
}

impl Drop for SignatureFile {
    /// A program that is being started has a copy of every open file until it runs, and a copy
    /// holds the lock.
    fn drop(&mut self) {
        for file in self.file.iter().chain([&self.checklist]) {
            // The file is closed next, which unlocks it, too.
            let _ = file.unlock();
        }
    }
}

impl SignatureFile {
    /// Adds a change and waits until it is on the disk: a signature must survive the next power
    /// cut.
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
        let text = entry_text(&self.hash, entry);
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_data());
        let written = written.with_context(signatures);
        self.file = Some(file);
        written
    }
}

// The files with the last position of a vehicle, beside the log, for each boot of a vehicle: one
// for a restart, and a KML.

/// What the names of the files begin with; the vehicle's boot number follows.
const PLACE_NAME: &str = "touchdown-place-";
/// Maximum age of a stored position, s: an older one does not help to find a vehicle.
const PLACE_VALID_S: u64 = 24 * 3_600;
/// Longer files are not ours.
const PLACE_BYTES_MAX: u64 = 64 * 1024;

/// Writes both files. A file gets its name when it is complete, so a crash leaves the former
/// position.
///
/// # Errors
/// The folder cannot be written.
pub(super) fn write_place(folder: &Path, place: &LastPlace) -> anyhow::Result<()> {
    let name = format!("{PLACE_NAME}{:08X}", place.boot);
    write_one(folder, &format!("{name}.json"), &serde_json::to_string_pretty(place)?)?;
    match kml(place) {
        Some(kml) => write_one(folder, &format!("{name}.kml"), &kml),
        None => Ok(()),
    }
}

fn write_one(folder: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let (part, complete) = (folder.join(format!("{name}.part")), folder.join(name));
    let failed = || format!("writing {}", complete.display());
    let mut file = File::create(&part).with_context(failed)?;
    file.write_all(text.as_bytes()).with_context(failed)?;
    fs::rename(&part, &complete).with_context(failed)
}

/// The files of places in a folder.
fn place_files(folder: &Path) -> impl Iterator<Item = fs::DirEntry> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let files = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    files.filter(|file| file.file_name().to_string_lossy().starts_with(PLACE_NAME))
}

/// The newest position stored in the folder of the log in the last day.
pub(super) fn newest_place(folder: Option<&Path>, now_unix_s: u64) -> Option<LastPlace> {
    let ours = place_files(folder?);
    // Other files, such as a KML, are skipped.
    let places = ours.filter_map(|file| {
        let text = File::open(file.path()).ok()?.take(PLACE_BYTES_MAX);
        let place: LastPlace = serde_json::from_reader(text).ok()?;
        Some(LastPlace { pad: place.pad.filter(|pad| pad.is_valid()), ..place })
    });
    places
        .filter(|place| now_unix_s.saturating_sub(place.received_unix_s) <= PLACE_VALID_S)
        .max_by_key(|place| place.received_unix_s)
}

// The file beside the log with the state that must survive the end of the station.

const UNFINISHED_NAME: &str = "touchdown-unfinished.json";

/// Stores the unfinished state.
///
/// # Errors
/// The folder cannot be written.
pub(super) fn write_unfinished(folder: &Path, unfinished: &Unfinished) -> anyhow::Result<()> {
    write_one(folder, UNFINISHED_NAME, &serde_json::to_string(unfinished)?)
}

/// The unfinished state of an earlier run in this folder; `None` if no vehicle has flown from here.
///
/// # Errors
/// The file is damaged, or it is missing beside the position of a vehicle, with which it is
/// written.
pub(super) fn read_unfinished(folder: Option<&Path>) -> anyhow::Result<Option<Unfinished>> {
    let Some(folder) = folder else { return Ok(None) };
    let path = folder.join(UNFINISHED_NAME);
    match fs::read_to_string(&path) {
        Ok(text) => serde_json::from_str(&text).map(Some).with_context(|| path.display().to_string()),
        Err(error) if error.kind() == ErrorKind::NotFound && place_files(folder).next().is_none() => Ok(None),
        Err(error) => Err(error).with_context(|| path.display().to_string()),
    }
}

#[cfg(test)]
mod log_tests {
    use super::*;
    use protocol::log::reader::{LogItem, LogReader};
    use protocol::log::record::{Event, EventLevel, Record};

    #[test]
    fn a_log_is_never_overwritten() {
        let directory = tempfile::tempdir().unwrap();
        let header = LogHeader { start_unix_ns: 1_800_000_000_000_000_000, ..LogHeader::default() };
        let names: Vec<String> = (0..3)
            .map(|_| {
                let choice = LogChoice::File(directory.path().join(named_by_time(&header).unwrap()));
                let recorder = open_log(Some(&choice), true, &header).unwrap().unwrap();
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

    /// The same command again after a crash.
    #[test]
    fn an_existing_log_is_preserved_and_the_new_one_reports_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let header = LogHeader::default();
        let named = directory.path().join("flight.mcap");
        let choice = Some(LogChoice::File(named.clone()));
        let open = || open_log(choice.as_ref(), true, &header).unwrap().unwrap().finish().unwrap();
        assert_eq!(open(), named);
        assert_eq!(other_name(choice.as_ref(), Some(&named)), None);
        let before = fs::read(&named).unwrap();
        // A telemetry log alone also takes its name.
        fs::write(directory.path().join("flight-2.tlog"), "somebody's").unwrap();
        let free = directory.path().join("flight-3.mcap");
        assert_eq!(open(), free);
        assert!(free.with_extension("tlog").exists() && !directory.path().join("flight-2.mcap").exists());
        assert_eq!(fs::read(&named).unwrap(), before);
        let said = other_name(choice.as_ref(), Some(&free)).unwrap();
        assert!(
            said.contains("flight.mcap exists and is kept; ") && said.ends_with("flight-3.mcap is written")
        );
    }

    #[test]
    fn a_panic_ends_the_log_properly() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("panic.mcap");
        let recorder = Recorder::create(&path, false, &LogHeader::default()).unwrap();
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

#[cfg(test)]
mod book_tests {
    use super::*;
    use protocol::signing::Key;

    #[test]
    fn the_end_is_signed_only_when_it_has_changed_and_not_too_often() {
        let key = BookKey::of(&Key::new([3; 32]));
        let (mut book, first) = StationBook::open(Some(key.clone()), "station 255/190", 1);
        assert!(matches!(&first, Record::BookEntry(entry) if entry.text.contains(&key.public().to_string())));
        let (signed, _) = book.sign(Duration::ZERO, false).unwrap();
        assert!(key.public().signed(&signed) && signed.head.entries == 1);
        assert!(book.sign(Duration::from_secs(9), true).is_none(), "nothing new");
        book.enter(&Line { unix_ns: 2, kind: "key", who: "Ann", text: "A" });
        assert!(book.sign(Duration::from_secs(1), false).is_none(), "too soon");
        assert!(book.sign(Duration::from_secs(1), true).is_some(), "the last one is signed at once");
        book.enter(&Line { unix_ns: 3, kind: "key", who: "Ann", text: "B" });
        let (signed, _) = book.sign(Duration::from_secs(10), false).unwrap();
        assert_eq!(signed.head.entries, 3);
    }
}

#[cfg(test)]
mod checklist_tests {
    use super::*;
    use crate::model::{Mark, Signature};

    #[test]
    fn signatures_survive_a_restart_and_another_text_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.toml");
        std::fs::write(&path, include_str!("../../checklist-example.toml")).unwrap();
        let now = 1_800_000_000;
        let signature = Signature { by: "Ann".to_owned(), unix_s: now, ..Signature::default() };
        let entry = ChecklistEntry::Marked { step: 2, mark: Mark::Signed(signature.clone()) };
        let (list, mut signatures, notes) = open_checklist(&path, now).unwrap();
        assert!(!list.is_touched() && notes.is_empty());
        let another = || open_checklist(&path, now).map(|_| ()).unwrap_err().to_string();
        let refusal = format!("another station writes {}", path.display());
        let refusal = format!("{refusal}: attach a screen to it to sign (`ground attach`)");
        assert_eq!(another(), refusal);
        let signed = folder.path().join("list.toml.signed");
        assert!(!signed.exists(), "nothing is signed");
        signatures.add(&entry).unwrap();
        assert!(signed.exists());
        assert_eq!(another(), refusal);
        drop(signatures);
        let (list, signatures, _) = open_checklist(&path, now + 60).unwrap();
        assert_eq!(list.steps[2].mark, Mark::Signed(signature));
        drop(signatures);
        let (list, signatures, notes) = open_checklist(&path, now + 13 * 3_600).unwrap();
        assert!(!list.is_touched());
        assert!(notes[0].starts_with("1 signatures of the checklist are not of today"), "{notes:?}");
        drop(signatures);
        let edited = include_str!("../../checklist-example.toml").replace("3.0", "30.0");
        std::fs::write(&path, edited).unwrap();
        assert!(!open_checklist(&path, now + 60).unwrap().0.is_touched(), "it was signed for another text");
    }
}

#[cfg(test)]
mod places_tests {
    use super::*;
    use crate::model::{Degrees, Spot};

    #[test]
    fn the_newest_place_of_today_survives_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let now = 1_800_000_000;
        let place = |boot, received_unix_s| LastPlace {
            boot,
            received_unix_s,
            received: Spot { north_m: 1.0, east_m: 2.0, error_m: 3.0 },
            height_m: 4.0,
            predicted: None,
            pad: Some(Degrees { latitude: 35.0, longitude: -117.0 }),
        };
        assert_eq!(newest_place(Some(folder.path()), now), None);
        for (boot, received) in [(1, now - 100), (2, now - 50), (3, now - 2 * PLACE_VALID_S)] {
            write_place(folder.path(), &place(boot, received)).unwrap();
        }
        // The place of a vehicle is written again and again.
        write_place(folder.path(), &place(2, now - 10)).unwrap();
        fs::write(folder.path().join(format!("{PLACE_NAME}broken.json")), "{").unwrap();
        assert_eq!(newest_place(Some(folder.path()), now), Some(place(2, now - 10)));
        let kml = fs::read_to_string(folder.path().join(format!("{PLACE_NAME}00000002.kml"))).unwrap();
        assert!(kml.contains("<name>last received</name>"));
        let parts = fs::read_dir(folder.path()).unwrap().filter_map(Result::ok);
        assert_eq!(parts.filter(|file| file.path().extension().is_some_and(|end| end == "part")).count(), 0);
    }
}
