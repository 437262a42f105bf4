//! Fetches the vehicle's own log (MAVLink FTP) and keeps it on disk.
//!
//! `protocol::ftp::download` decides what to ask for. What arrives is written by a thread of its own, so that neither
//! the link nor the crew waits for the disk.

pub(super) mod alone;
mod keeper;
mod kept;

use std::path::PathBuf;
use std::time::Duration;

use protocol::dialect::MavMessage;
use protocol::frame::Frame;
use protocol::ftp::Packet;
use protocol::ftp::download::{Download, News, Progress};
use protocol::identity::Address;

use self::keeper::{Keeper, Told};
use self::kept::Kept;

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
            keeper.remember(part)?;
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
                    keeper.finish()?;
                }
                Ok(None)
            }
            Some(Err(failure)) => anyhow::bail!(failure),
            None => {
                if self.download.is_whole() && !std::mem::replace(&mut self.summing, true) {
                    keeper.sum()?;
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

    fn write(&self, news: Option<News>) -> anyhow::Result<()> {
        let Some(keeper) = &self.keeper else { return Ok(()) };
        match news {
            Some(News::Begins { fresh: true }) => keeper.begin_again()?,
            Some(News::Piece { offset, data }) => keeper.write(offset, data)?,
            Some(News::Begins { fresh: false }) | None => {}
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
