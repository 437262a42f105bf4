//! Fetches the vehicle's own log (MAVLink FTP) and keeps it on disk.
//!
//! `protocol::ftp::download` decides what to ask for. The whole log is read again by a thread of its own, so that neither the
//! link nor the crew waits for it.

use std::fs::File;
use std::io;
use std::io::{IsTerminal as _, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use anyhow::Context as _;
use protocol::dialect::MavMessage;
use protocol::frame::Frame;
use protocol::ftp::download::{Download, DownloadEvent, Progress};
use protocol::ftp::{Packet, crc};
use protocol::identity::Address;
use tokio::time::{MissedTickBehavior, interval};

use super::KeyRing;
use super::clock::{Clock, LogTime, Signals};
use super::output::print;
use super::programs::in_a_thread;
use super::wire::Wire;
use crate::cli::DownloadArgs;
use crate::exit::Exit;
use crate::update::Msg;

/// A download that is running.
pub(super) struct Downloading {
    download: Download,
    us: Address,
    vehicle: Address,
    folder: PathBuf,
    /// What has arrived, until it is whole.
    kept: Option<Kept>,
    /// The thread that gives it its name.
    finishing: Option<Receiver<anyhow::Result<PathBuf>>>,
    /// Tenths of the file that were reported.
    tenths: u32,
}

/// What a download has to say.
#[derive(Debug)]
pub(super) enum DownloadReport {
    /// How far it is.
    Progress(String),
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
            download: Download::new(name, first_sequence),
            us,
            vehicle,
            folder,
            kept: None,
            finishing: None,
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
        match self.download.take(&packet, now) {
            Some(DownloadEvent::Opened { crc }) => self.open(crc)?,
            Some(DownloadEvent::Data(data)) => {
                if let Some(kept) = &mut self.kept {
                    kept.file.write_all(&data)?;
                }
            }
            None => {}
        }
        Ok(())
    }

    /// Goes on: what to send, and what there is to say.
    pub(super) fn poll(&mut self, now: Duration) -> (Vec<MavMessage>, Option<DownloadReport>) {
        let packets = self.download.poll(now);
        let messages = packets.iter().map(|packet| packet.message(self.vehicle)).collect();
        let report = self.go_on().unwrap_or_else(|error| Some(DownloadReport::Failed(error)));
        (messages, report)
    }

    /// Stops, for a program that ends: what is whole gets its name.
    pub(super) fn stop(self) {
        let _ = self.finishing.map(|finishing| finishing.recv());
    }

    fn go_on(&mut self) -> anyhow::Result<Option<DownloadReport>> {
        let ended = self.download.ended().transpose()?;
        if let Some(Ok(finished)) = self.finishing.as_ref().map(Receiver::try_recv) {
            return finished.map(|path| Some(DownloadReport::Done(path)));
        }
        if ended.is_some()
            && let Some(kept) = self.kept.take()
        {
            self.finishing = Some(in_a_thread("download", || kept.finish())?);
        }
        Ok(self.next_tenth().map(DownloadReport::Progress))
    }

    /// The vehicle has opened its file: goes on with what is here of it.
    fn open(&mut self, crc: u32) -> anyhow::Result<()> {
        let name = self.download.name().unwrap_or_default();
        let (kept, bytes) = Kept::open(&self.folder, self.vehicle.system_id, name, crc)?;
        self.kept = Some(kept);
        self.download.resume(bytes);
        Ok(())
    }

    /// A report at the beginning and at every tenth of the file.
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
pub(in crate::app) async fn run_download(args: &DownloadArgs) -> anyhow::Result<Exit> {
    let DownloadArgs { name, to, link, .. } = args;
    let addresses = (link.us(), link.vehicle());
    anyhow::ensure!(
        !link.connect.is_empty(),
        "no link to a vehicle: give --connect. In a station that holds the link, the key L fetches the log"
    );
    let KeyRing { key, .. } = KeyRing::open(link)?;
    let clock = Clock::start();
    let mut wire = Wire::open(addresses, link.connect.clone(), key, clock, None, LogTime::Run(clock)).await?;
    let mut downloading = Downloading::begin(name.as_deref(), to.clone(), addresses, clock.start_unix_ns());
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
        let (messages, report) = downloading.poll(now);
        for message in &messages {
            wire.send(message, 0);
        }
        match report {
            Some(DownloadReport::Done(path)) => {
                shown.end();
                wire.save_timestamps();
                print(format!("log {}\n", path.display()).as_bytes())?;
                return Ok(Exit::Landed);
            }
            Some(DownloadReport::Failed(error)) => {
                shown.end();
                return Err(error);
            }
            Some(DownloadReport::Progress(words)) if !shown.in_place => {
                // Nobody may read it.
                let _ = writeln!(std::io::stderr(), "{words}");
            }
            Some(DownloadReport::Progress(_)) | None => {}
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

// The files of a download: the beginning of the log that has arrived, with the checksum of the whole in its name
// (`.1A2B3C4D.part`), and the log once it is whole. An existing log is never overwritten.

/// Bytes read at once for a checksum.
const READ_AT_ONCE: usize = 256 * 1024;

/// The files of one download.
#[derive(Debug)]
struct Kept {
    whole: PathBuf,
    beginning: PathBuf,
    file: File,
    crc: u32,
}

impl Kept {
    /// Opens the file for the vehicle's log of this name and checksum, and returns how much an earlier download has left.
    ///
    /// # Errors
    /// The log is here already, or a file cannot be made.
    fn open(folder: &Path, vehicle: u8, name: &str, crc: u32) -> anyhow::Result<(Self, u32)> {
        // The name comes over the air: it must not lead out of the folder.
        let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || "._-".contains(*letter);
        let plain: String = name.chars().filter(is_plain).collect();
        let whole = folder.join(format!("vehicle{vehicle}-{plain}"));
        anyhow::ensure!(
            whole.symlink_metadata().is_err(),
            "{} is here already; it is not overwritten",
            whole.display()
        );
        let beginning = folder.join(format!("vehicle{vehicle}-{plain}.{crc:08X}.part"));
        let opened = File::options().create(true).read(true).append(true).open(&beginning);
        let file = opened.with_context(|| format!("opening {}", beginning.display()))?;
        let bytes = u32::try_from(file.metadata()?.len())?;
        Ok((Self { whole, beginning, file, crc }, bytes))
    }

    /// The log is whole: gives it its name.
    ///
    /// # Errors
    /// It is not what the vehicle has, there is a file of this name by now, or the disk fails.
    fn finish(self) -> anyhow::Result<PathBuf> {
        let Self { whole, beginning, mut file, crc } = self;
        if checksum(&mut file)? != crc {
            std::fs::remove_file(&beginning)?;
            anyhow::bail!("what arrived is not what the vehicle has: the checksums differ; fetch it again");
        }
        file.sync_all()?;
        // A link fails if the name is taken; a rename would overwrite.
        if std::fs::hard_link(&beginning, &whole).is_ok() {
            std::fs::remove_file(&beginning)?;
        } else {
            // Some file systems have no such links.
            anyhow::ensure!(
                whole.symlink_metadata().is_err(),
                "{} is here by now; the download is in {}",
                whole.display(),
                beginning.display()
            );
            std::fs::rename(&beginning, &whole)?;
        }
        Ok(whole)
    }
}

fn checksum(file: &mut File) -> io::Result<u32> {
    file.rewind()?;
    let (mut sum, mut piece) = (0, vec![0; READ_AT_ONCE]);
    loop {
        let read = file.read(&mut piece)?;
        if read == 0 {
            return Ok(sum);
        }
        sum = crc::continued(sum, &piece[..read]);
    }
}

#[cfg(test)]
mod kept_tests {
    use super::*;

    const CRC: u32 = 0x5;

    fn open(folder: &Path, crc: u32) -> anyhow::Result<(Kept, u32)> {
        Kept::open(folder, 1, "../flight.mcap", crc)
    }

    #[test]
    fn the_beginning_survives_and_becomes_a_log_that_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let crc = crc::continued(0, b"abcdefg");
        let (mut kept, bytes) = open(folder.path(), crc).unwrap();
        assert_eq!(bytes, 0);
        kept.file.write_all(b"abc").unwrap();
        drop(kept);
        assert_eq!(open(folder.path(), CRC).unwrap().1, 0, "another log of this name");
        let (mut kept, bytes) = open(folder.path(), crc).unwrap();
        assert_eq!(bytes, 3);
        kept.file.write_all(b"defg").unwrap();
        let whole = kept.finish().unwrap();
        assert_eq!(whole, folder.path().join("vehicle1-..flight.mcap"));
        assert_eq!(std::fs::read(&whole).unwrap(), b"abcdefg");
        let refused = open(folder.path(), crc).unwrap_err();
        assert!(refused.to_string().contains("is here already"), "{refused}");
    }

    #[test]
    fn a_log_that_appears_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (mut kept, _) = open(folder.path(), crc::continued(0, b"new")).unwrap();
        kept.file.write_all(b"new").unwrap();
        let whole = folder.path().join("vehicle1-..flight.mcap");
        std::fs::write(&whole, "old").unwrap();
        assert!(kept.finish().is_err());
        assert_eq!(std::fs::read(whole).unwrap(), b"old");
    }

    #[test]
    fn a_log_that_is_not_the_vehicle_s_gets_no_name_and_is_fetched_anew() {
        let folder = tempfile::tempdir().unwrap();
        let (mut kept, _) = open(folder.path(), CRC).unwrap();
        kept.file.write_all(b"damaged").unwrap();
        assert!(kept.finish().is_err());
        assert_eq!(open(folder.path(), CRC).unwrap().1, 0);
    }
}
