//! The side of MAVLink FTP that fetches a file.
//!
//! Packets go in with [`Download::take`], packets to send come out of [`Download::poll`], and pieces of the file come
//! out as [`DownloadEvent`]. The caller writes them, keeps [`Download::part`] beside them, and computes the checksum of the
//! whole file when it is there. A download that begins with such a [`Part`] asks for nothing that is there already.

mod pieces;

use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use self::pieces::Pieces;
use super::LOG_DIRECTORY;
use super::packet::{DATA_LEN, Opcode, Packet, Refusal};
use super::part::Part;
use super::ranges::Ranges;

/// A request that is not answered for this long is sent again.
const ASK_AGAIN: Duration = Duration::from_millis(900);
/// A vehicle that has said nothing about files for this long is given up.
const GIVE_UP: Duration = Duration::from_secs(30);
/// Requests to close the file before it is left to the vehicle to close it.
const CLOSE_TRIES: u32 = 3;
/// The rate is a mean over this many seconds.
const RATE_OVER_S: usize = 10;
/// A listing ends here, so that a vehicle that lists without end fills no memory: a flight every minute for a week.
const MAX_LISTED: usize = 10_000;

/// Why a download has failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    #[error("the vehicle has not answered for {} s", GIVE_UP.as_secs())]
    NoAnswer,
    #[error("the vehicle has no log to offer")]
    NoFiles,
    #[error("the vehicle lists more than {MAX_LISTED} files; name the one to fetch")]
    TooManyFiles,
    #[error("the vehicle has no file of that name")]
    NoSuchFile,
    #[error("the vehicle does not give out its log now: it is armed or in flight")]
    NotNow,
    #[error("what arrived is not what the vehicle has: the checksums differ, twice")]
    Damaged,
    #[error("the vehicle refused: {0:?}")]
    Refused(Refusal),
}

/// What a packet has brought.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DownloadEvent {
    /// The file is open. If nothing of it was kept (`fresh`), what was written before is not of this file.
    Begins { fresh: bool },
    /// A piece of the file.
    Piece { offset: u32, data: Vec<u8> },
}

/// How far a download is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    pub bytes: u32,
    pub len: u32,
    pub bytes_s: f64,
    /// Time left at this rate, s.
    pub left_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Listing,
    Opening,
    /// Asks for the checksum of the whole file.
    Summing,
    Reading,
    /// All is there; the caller computes the checksum.
    Comparing,
    Closing,
    Over(Option<Failure>),
}

/// A request that is waiting for its answer.
#[derive(Debug, Clone)]
struct Asked {
    packet: Packet,
    sent_at: Option<Duration>,
    tries: u32,
}

/// One file on its way.
#[derive(Debug, Clone)]
pub struct Download {
    phase: Phase,
    sequence: u16,
    /// The files that were listed, the newest last.
    listed: Vec<String>,
    path: Option<String>,
    asked: Option<Asked>,
    kept: Option<Part>,
    session: u8,
    len: u32,
    crc: Option<u32>,
    have: Ranges,
    bytes: u32,
    pieces: Pieces,
    heard_at: Option<Duration>,
    /// The checksums have differed once.
    again: bool,
    /// Bytes at the last whole seconds.
    rate: VecDeque<(Duration, u32)>,
}

impl Download {
    /// A download of the file of this name, or of the newest. `first_sequence` should differ from that of an earlier
    /// process.
    pub fn new(name: Option<&str>, kept: Option<Part>, first_sequence: u16) -> Self {
        Self {
            phase: if name.is_some() { Phase::Opening } else { Phase::Listing },
            sequence: first_sequence,
            listed: Vec::new(),
            path: name.map(|name| format!("{LOG_DIRECTORY}/{name}")),
            asked: None,
            kept,
            session: 0,
            len: 0,
            crc: None,
            have: Ranges::default(),
            bytes: 0,
            pieces: Pieces::default(),
            heard_at: None,
            again: false,
            rate: VecDeque::new(),
        }
    }

    /// Continues with what is kept of a file, once its name is known.
    pub fn keep(&mut self, part: Part) {
        self.kept = Some(part);
    }

    /// The name of the file, once it is known.
    pub fn name(&self) -> Option<&str> {
        self.path.as_deref().and_then(|path| path.rsplit('/').next())
    }

    /// How it has ended, if it has.
    pub fn ended(&self) -> Option<Result<(), Failure>> {
        match self.phase {
            Phase::Over(failure) => Some(failure.map_or(Ok(()), Err)),
            _ => None,
        }
    }

    /// Whether all of the file is there, and the caller has to compare its checksum.
    pub fn is_whole(&self) -> bool {
        self.phase == Phase::Comparing
    }

    /// What to remember, once the file is open.
    pub fn part(&self) -> Option<Part> {
        let path = self.path.clone().filter(|_| matches!(self.phase, Phase::Reading | Phase::Comparing))?;
        Some(Part { path, len: self.len, crc: self.crc, have: self.have.clone() })
    }

    /// How far it is; `None` before the file is open.
    pub fn progress(&self) -> Option<Progress> {
        (self.len > 0).then(|| {
            let bytes_s = match (self.rate.front(), self.rate.back()) {
                (Some((from, before)), Some((to, after))) if to > from => {
                    f64::from(after.saturating_sub(*before)) / to.saturating_sub(*from).as_secs_f64()
                }
                _ => 0.0,
            };
            let left_s = (bytes_s > 0.0).then(|| f64::from(self.len - self.bytes) / bytes_s);
            Progress { bytes: self.bytes, len: self.len, bytes_s, left_s }
        })
    }

    /// Takes the checksum of what was written.
    pub fn compare(&mut self, crc: u32) -> Option<DownloadEvent> {
        if self.phase != Phase::Comparing {
            return None;
        }
        if self.crc.is_none_or(|expected| expected == crc) {
            self.turn_to(Phase::Closing);
            return None;
        }
        if core::mem::replace(&mut self.again, true) {
            self.phase = Phase::Over(Some(Failure::Damaged));
            return None;
        }
        self.begin(Ranges::default());
        Some(DownloadEvent::Begins { fresh: true })
    }

    /// Takes an answer of the vehicle.
    pub fn take(&mut self, packet: &Packet, now: Duration) -> Option<DownloadEvent> {
        if self.ended().is_some() {
            return None;
        }
        if matches!(packet.asked, Opcode::ReadFile | Opcode::BurstReadFile) {
            return self.take_piece(packet, now);
        }
        let expected = self.asked.as_ref().is_some_and(|asked| {
            asked.packet.opcode == packet.asked && asked.packet.sequence.wrapping_add(1) == packet.sequence
        });
        if !expected {
            return None;
        }
        self.heard_at = Some(now);
        self.asked = None;
        match (self.phase, packet.refusal()) {
            (Phase::Listing, None) => {
                let files = packet.data.split(|byte| *byte == 0).filter(|entry| !entry.is_empty());
                for entry in files {
                    self.listed.push(String::from_utf8_lossy(entry).into_owned());
                }
                if self.listed.len() > MAX_LISTED {
                    self.phase = Phase::Over(Some(Failure::TooManyFiles));
                }
                None
            }
            (Phase::Listing, Some(Refusal::EndOfFile)) => {
                let newest = self.listed.iter().rev().find_map(|entry| entry.strip_prefix('F'));
                match newest.and_then(|entry| entry.split('\t').next()) {
                    Some(name) => {
                        self.path = Some(format!("{LOG_DIRECTORY}/{name}"));
                        self.turn_to(Phase::Opening);
                    }
                    None => self.phase = Phase::Over(Some(Failure::NoFiles)),
                }
                None
            }
            (Phase::Opening, None) => {
                self.session = packet.session;
                self.len = packet.number().unwrap_or(0);
                self.turn_to(Phase::Summing);
                None
            }
            (Phase::Summing, None) => self.opened(packet.number()),
            // A vehicle that computes no checksums: the lengths have to do.
            (Phase::Summing, Some(Refusal::UnknownCommand)) => self.opened(None),
            (Phase::Closing, _) => {
                self.phase = Phase::Over(None);
                None
            }
            (_, Some(why)) => {
                self.refused(why);
                None
            }
            (_, None) => None,
        }
    }

    /// What to send now; to be called often, also without any news.
    pub fn poll(&mut self, now: Duration) -> Vec<Packet> {
        let heard_at = *self.heard_at.get_or_insert(now);
        if self.ended().is_none() && now.saturating_sub(heard_at) >= GIVE_UP {
            // Nothing is missing of a file that only waits to be closed.
            self.phase = Phase::Over((self.phase != Phase::Closing).then_some(Failure::NoAnswer));
        }
        self.measure(now);
        match self.phase {
            Phase::Comparing | Phase::Over(_) => Vec::new(),
            Phase::Reading => self.pieces.poll(&self.have, self.len, self.session, &mut self.sequence, now),
            Phase::Listing | Phase::Opening | Phase::Summing | Phase::Closing => {
                self.ask(now).into_iter().collect()
            }
        }
    }

    fn turn_to(&mut self, phase: Phase) {
        self.phase = phase;
        self.asked = None;
    }

    fn ask(&mut self, now: Duration) -> Option<Packet> {
        if self.asked.is_none() {
            let path = self.path.as_deref().unwrap_or_default();
            let (opcode, session, offset, path) = match self.phase {
                Phase::Listing => (Opcode::ListDirectory, 0, self.listed.len() as u32, LOG_DIRECTORY),
                Phase::Opening => (Opcode::OpenFileRo, 0, 0, path),
                Phase::Summing => (Opcode::CalcFileCrc32, self.session, 0, path),
                _ => (Opcode::TerminateSession, self.session, 0, ""),
            };
            let packet = Packet::request(self.sequence, session, opcode, offset, path);
            self.sequence = self.sequence.wrapping_add(1);
            self.asked = Some(Asked { packet, sent_at: None, tries: 0 });
        }
        let closing = self.phase == Phase::Closing;
        let asked = self.asked.as_mut()?;
        if asked.sent_at.is_some_and(|sent_at| now.saturating_sub(sent_at) < ASK_AGAIN) {
            return None;
        }
        if closing && asked.tries >= CLOSE_TRIES {
            self.phase = Phase::Over(None);
            return None;
        }
        asked.sent_at = Some(now);
        asked.tries += 1;
        Some(asked.packet.clone())
    }

    /// The file is open: continues with what is kept of it, if it is the same file.
    fn opened(&mut self, crc: Option<u32>) -> Option<DownloadEvent> {
        let path = self.path.clone()?;
        // A session that was opened again goes on with what is there.
        let so_far = (self.bytes > 0).then(|| core::mem::take(&mut self.have));
        let so_far = so_far.map(|have| Part { path: path.clone(), len: self.len, crc: self.crc, have });
        let kept = so_far.or_else(|| self.kept.take());
        let same = |part: &Part| part.path == path && part.len == self.len && part.crc == crc;
        let kept = kept.filter(same).filter(|part| part.have.iter().all(|range| range.end <= part.len));
        self.crc = crc;
        let fresh = kept.is_none();
        self.begin(kept.map(|part| part.have).unwrap_or_default());
        Some(DownloadEvent::Begins { fresh })
    }

    fn begin(&mut self, have: Ranges) {
        self.bytes = have.bytes();
        self.have = have;
        self.rate.clear();
        self.pieces = Pieces::default();
        self.turn_to(if self.bytes == self.len { Phase::Comparing } else { Phase::Reading });
    }

    fn take_piece(&mut self, packet: &Packet, now: Duration) -> Option<DownloadEvent> {
        if self.phase != Phase::Reading || packet.session != self.session {
            return None;
        }
        match packet.refusal() {
            Some(Refusal::InvalidSession) => {
                self.heard_at = Some(now);
                self.turn_to(Phase::Opening);
                return None;
            }
            // The end of a burst that began at the end.
            Some(Refusal::EndOfFile) => {
                self.heard_at = Some(now);
                self.pieces.on_end(packet);
                return None;
            }
            Some(why) => {
                self.refused(why);
                return None;
            }
            None => {}
        }
        let end = packet.offset.checked_add(packet.data.len() as u32).filter(|end| *end <= self.len)?;
        if packet.opcode != Opcode::Ack || packet.data.is_empty() || packet.data.len() > DATA_LEN {
            return None;
        }
        let range = packet.offset..end;
        let known = self.have.contains(&range);
        self.pieces.on_piece(packet, &range, known, now);
        let added = self.have.add(range);
        if added == 0 {
            return None;
        }
        // Only news keep the download alive: a vehicle that repeats itself for ever is given up.
        self.heard_at = Some(now);
        self.bytes += added;
        if self.bytes == self.len {
            self.turn_to(Phase::Comparing);
        }
        Some(DownloadEvent::Piece { offset: packet.offset, data: packet.data.clone() })
    }

    fn refused(&mut self, why: Refusal) {
        self.phase = Phase::Over(Some(match why {
            Refusal::Busy => Failure::NotNow,
            Refusal::FileNotFound if self.path.is_none() => Failure::NoFiles,
            Refusal::FileNotFound => Failure::NoSuchFile,
            why => Failure::Refused(why),
        }));
    }

    fn measure(&mut self, now: Duration) {
        let due =
            self.rate.back().is_none_or(|(last, _)| now.saturating_sub(*last) >= Duration::from_secs(1));
        if due && self.phase == Phase::Reading {
            self.rate.push_back((now, self.bytes));
            if self.rate.len() > RATE_OVER_S {
                self.rate.pop_front();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listing_without_end_is_given_up() {
        let mut download = Download::new(None, None, 0);
        for _ in 0..MAX_LISTED {
            for packet in download.poll(Duration::ZERO) {
                download.take(&packet.ack(b"Fone\t1\0Ftwo\t2\0"), Duration::ZERO);
            }
        }
        assert_eq!(download.ended(), Some(Err(Failure::TooManyFiles)));
        assert!(download.listed.len() <= MAX_LISTED + 2);
    }
}
