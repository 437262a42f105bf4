//! Fetches the vehicle's own log (MAVLink FTP) and keeps it on disk.
//!
//! `protocol::ftp::download` decides what to ask for. What arrives is written by a thread of its own, so that neither
//! the link nor the crew waits for the disk.

use std::fs::File;
use std::io;
use std::io::{IsTerminal as _, Read as _, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Context as _;
use protocol::dialect::MavMessage;
use protocol::frame::Frame;
use protocol::ftp::download::{Download, DownloadEvent, Progress};
use protocol::ftp::part::Part;
use protocol::ftp::{Packet, crc};
use protocol::identity::Address;
use tokio::time::{MissedTickBehavior, interval};

use super::KeyRing;
use super::clock::{Clock, LogTime, Signals};
use super::output::print;
use super::wire::Wire;
use crate::cli::Cli;
use crate::exit::Exit;
use crate::update::Msg;

/// How often the pieces that have arrived are remembered on disk.
const REMEMBER_EVERY: Duration = Duration::from_secs(2);

/// A download that is running.
pub(super) struct Downloading {
    download: Download,
    us: Address,
    vehicle: Address,
    folder: PathBuf,
    keeper: Option<Keeper>,
    /// The checksum, or the name, was asked for.
    summing: bool,
    finishing: bool,
    remembered_at: Duration,
    /// Tenths of the file that were told.
    tenths: u32,
}

/// What a download has to say.
#[derive(Debug)]
pub(super) enum Word {
    /// It goes on.
    Goes(String),
    /// The log is here.
    Done(PathBuf),
    Failed(anyhow::Error),
}

impl Downloading {
    /// Begins with the file of this name, or with the newest. The time makes its requests differ from those of an earlier
    /// download.
    pub(super) fn begin(
        name: Option<&str>,
        folder: PathBuf,
        (us, vehicle): (Address, Address),
        unix_ns: u64,
    ) -> Self {
        // Another number every millisecond.
        let first_sequence = (unix_ns >> 20) as u16;
        Self {
            download: Download::new(name, None, first_sequence),
            us,
            vehicle,
            folder,
            keeper: None,
            summing: false,
            finishing: false,
            remembered_at: Duration::ZERO,
            tenths: 0,
        }
    }

    pub(super) fn progress(&self) -> Option<Progress> {
        self.download.progress()
    }

    /// Takes a frame of the vehicle.
    ///
    /// # Errors
    /// The log is here already, or its files cannot be made.
    pub(super) fn take(&mut self, frame: &Frame, now: Duration) -> anyhow::Result<()> {
        let Some((target, packet)) = Packet::answer_in(frame) else { return Ok(()) };
        if target != self.us || frame.source() != self.vehicle {
            return Ok(());
        }
        let news = self.download.take(&packet, now);
        self.open()?;
        self.write(news)
    }

    /// Goes on: what to send, and what there is to say.
    pub(super) fn poll(&mut self, now: Duration) -> (Vec<MavMessage>, Option<Word>) {
        let packets = self.download.poll(now);
        let messages = packets.iter().map(|packet| packet.message(self.vehicle)).collect();
        let word = self.go_on(now).unwrap_or_else(|error| Some(Word::Failed(error)));
        (messages, word)
    }

    /// Stops, for a program that ends: waits until what has arrived is on disk and remembered.
    pub(super) fn stop(mut self) {
        // If the disk does not keep up, the next download fetches more.
        let _ = self.remember();
        if let Some(keeper) = self.keeper.take() {
            keeper.close();
        }
    }

    /// Remembers what is there, so that the next download goes on with it.
    fn remember(&self) -> anyhow::Result<()> {
        if let (Some(part), Some(keeper)) = (self.download.part(), &self.keeper) {
            keeper.order(Order::Remember(Box::new(part.clone())))?;
        }
        Ok(())
    }

    fn go_on(&mut self, now: Duration) -> anyhow::Result<Option<Word>> {
        self.open()?;
        while let Some(told) = self.keeper.as_ref().and_then(Keeper::told) {
            match told {
                Told::Sum(sum) => {
                    self.summing = false;
                    let news = self.download.compare(sum);
                    self.write(news)?;
                }
                Told::Finished(path) => return Ok(Some(Word::Done(path))),
                Told::Failed(error) => return Err(error),
            }
        }
        if now.saturating_sub(self.remembered_at) >= REMEMBER_EVERY {
            self.remembered_at = now;
            self.remember()?;
        }
        let Some(keeper) = &self.keeper else {
            return self.download.ended().transpose().map(|_| None).map_err(Into::into);
        };
        match self.download.ended() {
            Some(Ok(())) => {
                if !std::mem::replace(&mut self.finishing, true) {
                    keeper.order(Order::Finish)?;
                }
                Ok(None)
            }
            Some(Err(failure)) => anyhow::bail!(failure),
            None => {
                if self.download.is_whole() && !std::mem::replace(&mut self.summing, true) {
                    keeper.order(Order::Sum)?;
                }
                Ok(self.next_tenth().map(Word::Goes))
            }
        }
    }

    /// Opens the files once the name is known.
    fn open(&mut self) -> anyhow::Result<()> {
        if self.keeper.is_none()
            && self.download.ended().is_none()
            && let Some(name) = self.download.name()
        {
            let (kept, part) = Kept::open(&self.folder, self.vehicle.system_id, name)?;
            self.keeper = Some(Keeper::start(kept)?);
            if let Some(part) = part {
                self.download.keep(part);
            }
        }
        Ok(())
    }

    fn write(&self, news: Option<DownloadEvent>) -> anyhow::Result<()> {
        let Some(keeper) = &self.keeper else { return Ok(()) };
        match news {
            Some(DownloadEvent::Begins { fresh: true }) => keeper.order(Order::BeginAgain)?,
            Some(DownloadEvent::Piece { offset, data }) => {
                keeper.order(Order::Write { offset, piece: data })?;
            }
            Some(DownloadEvent::Begins { fresh: false }) | None => {}
        }
        Ok(())
    }

    /// A word at the beginning and at every tenth of the file.
    fn next_tenth(&mut self) -> Option<String> {
        let progress = self.progress()?;
        let tenth = 1 + (10 * u64::from(progress.bytes) / u64::from(progress.len.max(1))) as u32;
        (tenth > self.tenths).then(|| {
            self.tenths = tenth;
            format!("log {}: {}", self.download.name().unwrap_or_default(), in_words(&progress))
        })
    }
}

/// As in `1.20 of 10.00 MB, 3.6 kB/s, 41 min left`.
pub(super) fn in_words(progress: &Progress) -> String {
    let megabytes = |bytes: u32| f64::from(bytes) / 1e6;
    let left = match progress.left_s {
        None => String::new(),
        Some(left_s) if left_s >= 90.0 => format!(", {:.0} min left", left_s / 60.0),
        Some(left_s) => format!(", {left_s:.0} s left"),
    };
    format!(
        "{:.2} of {:.2} MB, {:.1} kB/s{left}",
        megabytes(progress.bytes),
        megabytes(progress.len),
        progress.bytes_s / 1000.0
    )
}

// `ground download`: fetches the log over a link of its own. It sends no heartbeat: nothing that it does may look like a
// station that watches over the vehicle.

const TICK: Duration = Duration::from_millis(20);
/// How often the progress is printed: on a terminal in place, otherwise as lines at every tenth.
const SHOW_EVERY: Duration = Duration::from_millis(500);

/// Fetches the log over this program's own link.
///
/// # Errors
/// The link cannot be opened, the vehicle refuses, or a file cannot be written.
pub(in crate::app) async fn run_download(
    cli: &Cli,
    name: Option<&str>,
    folder: &Path,
) -> anyhow::Result<Exit> {
    anyhow::ensure!(
        !cli.connect.is_empty(),
        "no link to a vehicle: give --connect. In a station that holds the link, the key L fetches the log"
    );
    let KeyRing { key, .. } = KeyRing::open(cli)?;
    let clock = Clock::start();
    let mut wire =
        Wire::open((cli.us(), cli.vehicle()), cli.connect.clone(), key, clock, None, LogTime::Run(clock))
            .await?;
    let mut downloading =
        Downloading::begin(name, folder.to_owned(), (cli.us(), cli.vehicle()), clock.start_unix_ns());
    let mut signals = Signals::listen()?;
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut shown = Shown { in_place: std::io::stderr().is_terminal(), at: Duration::ZERO, len: 0 };
    loop {
        let msgs = tokio::select! {
            biased;
            signal = signals.next() => {
                downloading.stop();
                shown.end();
                anyhow::bail!("stopped by {signal}; the same command goes on with what is here");
            }
            received = wire.receive() => wire.take(received),
            _ = ticks.tick() => Vec::new(),
        };
        let now = clock.now();
        for msg in msgs {
            if let Msg::Frame(frame) = msg {
                downloading.take(&frame, now)?;
            }
        }
        let (messages, word) = downloading.poll(now);
        for message in &messages {
            wire.send(message, 0);
        }
        match word {
            Some(Word::Done(path)) => {
                shown.end();
                wire.save_timestamps();
                print(format!("log {}\n", path.display()).as_bytes())?;
                return Ok(Exit::Landed);
            }
            Some(Word::Failed(error)) => {
                shown.end();
                return Err(error);
            }
            Some(Word::Goes(words)) if !shown.in_place => {
                // Nobody may read it.
                let _ = writeln!(std::io::stderr(), "{words}");
            }
            Some(Word::Goes(_)) | None => {}
        }
        if shown.in_place && now >= shown.at + SHOW_EVERY {
            shown.at = now;
            let words =
                downloading.progress().map_or_else(|| "asking the vehicle".to_owned(), |p| in_words(&p));
            shown.replace(&words);
        }
    }
}

/// The progress on standard error. If nobody reads it, the download goes on.
struct Shown {
    in_place: bool,
    at: Duration,
    len: usize,
}

impl Shown {
    fn replace(&mut self, words: &str) {
        let _ = write!(std::io::stderr(), "\r{words:<width$}", width = self.len);
        self.len = words.len();
    }

    fn end(&mut self) {
        if std::mem::take(&mut self.len) > 0 {
            let _ = writeln!(std::io::stderr());
        }
    }
}

// The thread that has the files of a download. Nothing else waits for the disk: a disk that hangs must not hold up an abort.

/// Most orders that may wait: about a minute of pieces of a radio.
const MAX_WAITING: usize = 1024;
/// Most that the thread has to say: two checksums, and how it ended.
const MAX_TOLD: usize = 4;

enum Order {
    BeginAgain,
    Write { offset: u32, piece: Vec<u8> },
    Remember(Box<Part>),
    Sum,
    Finish,
}

/// What the thread says.
#[derive(Debug)]
pub(super) enum Told {
    /// The checksum of all pieces.
    Sum(u32),
    /// The log has its name.
    Finished(PathBuf),
    Failed(anyhow::Error),
}

/// The disk does not keep up: what has arrived is lost.
#[derive(Debug, thiserror::Error)]
#[error("the disk does not keep up with the link; the next download goes on with what is there")]
pub(super) struct Behind;

/// A handle to the thread. Without it the thread does what it was told, and ends.
#[derive(Debug)]
pub(super) struct Keeper {
    orders: SyncSender<Order>,
    told: Receiver<Told>,
    thread: JoinHandle<()>,
}

impl Keeper {
    /// Gives the files to a thread of their own.
    ///
    /// # Errors
    /// No thread can be started.
    pub(super) fn start(kept: Kept) -> io::Result<Self> {
        let (orders, inbox) = sync_channel(MAX_WAITING);
        let (tell, told) = sync_channel(MAX_TOLD);
        let thread = std::thread::Builder::new()
            .name("download".to_owned())
            .spawn(move || serve(kept, &inbox, &tell))?;
        Ok(Self { orders, told, thread })
    }

    /// What the thread has said since.
    pub(super) fn told(&self) -> Option<Told> {
        self.told.try_recv().ok()
    }

    /// Waits until everything is on disk, for a program that ends.
    pub(super) fn close(self) {
        drop(self.orders);
        // A panic was printed already.
        let _ = self.thread.join();
    }

    /// Gives an order; it never waits.
    fn order(&self, order: Order) -> Result<(), Behind> {
        match self.orders.try_send(order) {
            // A thread that has ended has said why.
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(()),
            Err(TrySendError::Full(_)) => Err(Behind),
        }
    }
}

fn serve(mut kept: Kept, inbox: &Receiver<Order>, tell: &SyncSender<Told>) {
    while let Ok(order) = inbox.recv() {
        let done = match order {
            Order::BeginAgain => kept.begin_again().map(|()| None),
            Order::Write { offset, piece } => kept.write(offset, &piece).map(|()| None),
            Order::Remember(part) => kept.remember(&part).map(|()| None),
            Order::Sum => kept.checksum().map(|sum| Some(Told::Sum(sum))),
            Order::Finish => {
                // The download may have ended.
                let _ = tell.send(kept.finish().map_or_else(Told::Failed, Told::Finished));
                return;
            }
        };
        match done {
            Ok(None) => {}
            Ok(Some(told)) => drop(tell.send(told)),
            Err(error) => {
                let _ = tell.send(Told::Failed(error.into()));
                return;
            }
        }
    }
}

// The files of a download: the pieces that have arrived (`.part`), what is remembered of them (`.part.txt`), and the
// log once it is whole. An existing log is never overwritten.

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
mod keeper_tests {
    use super::*;

    /// The thread is not there to take anything: as with a disk that hangs.
    #[test]
    fn a_disk_that_hangs_fails_the_download_and_holds_nothing_up() {
        let (orders, _inbox) = sync_channel(2);
        let (_tell, told) = sync_channel(1);
        let thread = std::thread::Builder::new().name("idle".to_owned()).spawn(|| {}).unwrap();
        let keeper = Keeper { orders, told, thread };
        let write = |offset| keeper.order(Order::Write { offset, piece: vec![1] });
        assert!(write(0).is_ok() && write(1).is_ok());
        assert!(write(2).unwrap_err().to_string().contains("does not keep up"));
    }
}

#[cfg(test)]
mod kept_tests {
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
