//! The side of MAVLink FTP that fetches a file.
//!
//! Packets go in with [`Download::take`], packets to send come out of [`Download::poll`], and the
//! file comes out in order as [`DownloadEvent`]s. The caller writes it, passes the length of an
//! earlier part to [`Download::resume`], and compares the checksum of the complete file at the end.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use super::LOG_DIRECTORY;
use super::packet::{DATA_LEN, Opcode, Packet, Refusal};

/// A request that is not answered for this long is sent again; all requests to read, when none was
/// answered.
const RETRY_AFTER: Duration = Duration::from_millis(900);
/// Time without an answer about files after which the download fails.
pub const GIVE_UP: Duration = Duration::from_secs(30);
/// Requests to close the file before it is left to the vehicle to close it.
const CLOSE_TRIES: u32 = 3;
/// Most pieces requested at once. A line of 57,600 baud carries them in 1.5 s, so it stays busy
/// while a lost request is detected.
const MAX_WAITING: usize = 32;
/// Distance from the first missing piece beyond which pieces are not requested, bytes: they wait in
/// memory.
const AHEAD: u32 = 1024 * DATA_LEN as u32;
/// The rate is a mean over this many seconds.
const RATE_OVER_S: usize = 10;
/// A listing ends here, so that a vehicle that lists without end fills no memory: a flight every
/// minute for a week.
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
    #[error("the vehicle refused: {0:?}")]
    Refused(Refusal),
}

/// Result of a packet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DownloadEvent {
    /// The file is open: the caller resumes with its part of the file with this checksum.
    Opened { crc: u32 },
    /// The next bytes of the file.
    Data(Vec<u8>),
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
    /// Requests the checksum of the complete file.
    Summing,
    Reading,
    Closing,
    Over(Option<Failure>),
}

/// A request that is waiting for its answer.
#[derive(Debug, Clone)]
struct PendingRequest {
    packet: Packet,
    sent_at: Option<Duration>,
    tries: u32,
}

/// One file download.
#[derive(Debug, Clone)]
pub struct Download {
    phase: Phase,
    sequence: u16,
    /// The files that were listed, the newest last.
    listed: Vec<String>,
    path: Option<String>,
    pending: Option<PendingRequest>,
    session: u8,
    len: u32,
    crc: Option<u32>,
    /// The beginning of the file that is there.
    bytes: u32,
    /// Pieces behind a gap, by their offsets.
    ahead: BTreeMap<u32, Vec<u8>>,
    /// Requests to read, in the order in which they were sent.
    waiting: VecDeque<Packet>,
    repeated_at: Duration,
    answered_at: Option<Duration>,
    /// Bytes at the last full seconds.
    rate: VecDeque<(Duration, u32)>,
}

impl Download {
    /// A download of the file of this name, or of the newest. `first_sequence` should differ from
    /// that of an earlier process.
    pub fn new(name: Option<&str>, first_sequence: u16) -> Self {
        Self {
            phase: if name.is_some() { Phase::Opening } else { Phase::Listing },
            sequence: first_sequence,
            listed: Vec::new(),
            path: name.map(|name| format!("{LOG_DIRECTORY}/{name}")),
            pending: None,
            session: 0,
            len: 0,
            crc: None,
            bytes: 0,
            ahead: BTreeMap::new(),
            waiting: VecDeque::new(),
            repeated_at: Duration::ZERO,
            answered_at: None,
            rate: VecDeque::new(),
        }
    }

    /// The name of the file, once available.
    pub fn name(&self) -> Option<&str> {
        self.path.as_deref().and_then(|path| path.rsplit('/').next())
    }

    /// Goes on behind these first bytes of the file that was opened.
    pub fn resume(&mut self, bytes: u32) {
        if self.phase == Phase::Reading && bytes <= self.len {
            self.bytes = bytes;
            self.close_if_complete();
        }
    }

    /// How it has ended, if it has.
    pub fn ended(&self) -> Option<Result<(), Failure>> {
        match self.phase {
            Phase::Over(failure) => Some(failure.map_or(Ok(()), Err)),
            _ => None,
        }
    }

    /// How far it is; `None` before the file is open.
    pub fn progress(&self) -> Option<Progress> {
        self.crc.map(|_| {
            let bytes_s = match (self.rate.front(), self.rate.back()) {
                (Some((from, before)), Some((to, after))) if to > from => {
                    f64::from(after.saturating_sub(*before)) / to.saturating_sub(*from).as_secs_f64()
                }
                _ => 0.0,
            };
            let bytes = self.arrived();
            let left_s = (bytes_s > 0.0).then(|| f64::from(self.len - bytes) / bytes_s);
            Progress { bytes, len: self.len, bytes_s, left_s }
        })
    }

    /// Takes an answer of the vehicle.
    pub fn take(&mut self, packet: &Packet, now: Duration) -> Option<DownloadEvent> {
        if self.ended().is_some() {
            return None;
        }
        if packet.request == Opcode::READ_FILE {
            return self.take_piece(packet, now);
        }
        let expected = self.pending.as_ref().is_some_and(|pending| pending.packet.is_answered_by(packet));
        if !expected {
            return None;
        }
        self.answered_at = Some(now);
        self.pending = None;
        match (self.phase, packet.refusal()) {
            (Phase::Listing, None) => {
                let files = packet.data.split(|byte| *byte == 0).filter(|entry| !entry.is_empty());
                for entry in files {
                    self.listed.push(String::from_utf8_lossy(entry).into_owned());
                }
                if self.listed.len() > MAX_LISTED {
                    self.phase = Phase::Over(Some(Failure::TooManyFiles));
                }
            }
            (Phase::Listing, Some(Refusal::EndOfFile)) => {
                let newest = self.listed.iter().rev().find_map(|entry| entry.strip_prefix('F'));
                match newest.and_then(|entry| entry.split('\t').next()) {
                    Some(name) => {
                        self.path = Some(format!("{LOG_DIRECTORY}/{name}"));
                        self.phase = Phase::Opening;
                    }
                    None => self.phase = Phase::Over(Some(Failure::NoFiles)),
                }
            }
            (Phase::Opening, None) => {
                let len = packet.number().unwrap_or(0);
                if self.len != len {
                    (self.len, self.crc) = (len, None);
                }
                self.session = packet.session;
                self.phase = Phase::Summing;
            }
            (Phase::Summing, None) => return self.opened(packet.number().unwrap_or(0)),
            (Phase::Closing, _) => self.phase = Phase::Over(None),
            (_, Some(why)) => self.refused(why),
            (_, None) => {}
        }
        None
    }

    /// Returns the packets to send now; to be called often, also when nothing has arrived.
    pub fn poll(&mut self, now: Duration) -> Vec<Packet> {
        let answered_at = *self.answered_at.get_or_insert(now);
        if self.ended().is_none() && now.saturating_sub(answered_at) >= GIVE_UP {
            // Nothing is missing of a file that only waits to be closed.
            self.phase = Phase::Over((self.phase != Phase::Closing).then_some(Failure::NoAnswer));
        }
        self.measure(now);
        match self.phase {
            Phase::Over(_) => Vec::new(),
            Phase::Reading => self.read(now.saturating_sub(answered_at), now),
            Phase::Listing | Phase::Opening | Phase::Summing | Phase::Closing => {
                self.next_request(now).into_iter().collect()
            }
        }
    }

    fn next_request(&mut self, now: Duration) -> Option<Packet> {
        if self.pending.is_none() {
            let path = self.path.as_deref().unwrap_or_default();
            let (opcode, session, offset, path) = match self.phase {
                Phase::Listing => (Opcode::LIST_DIRECTORY, 0, self.listed.len() as u32, LOG_DIRECTORY),
                Phase::Opening => (Opcode::OPEN_FILE_RO, 0, 0, path),
                Phase::Summing => (Opcode::CALC_FILE_CRC32, self.session, 0, path),
                _ => (Opcode::TERMINATE_SESSION, self.session, 0, ""),
            };
            let packet = Packet::request(self.sequence, session, opcode, offset, path);
            self.sequence = self.sequence.wrapping_add(1);
            self.pending = Some(PendingRequest { packet, sent_at: None, tries: 0 });
        }
        let closing = self.phase == Phase::Closing;
        let pending = self.pending.as_mut()?;
        if pending.sent_at.is_some_and(|sent_at| now.saturating_sub(sent_at) < RETRY_AFTER) {
            return None;
        }
        if closing && pending.tries >= CLOSE_TRIES {
            self.phase = Phase::Over(None);
            return None;
        }
        pending.sent_at = Some(now);
        pending.tries += 1;
        Some(pending.packet.clone())
    }

    /// Asks for the first pieces that are missing.
    fn read(&mut self, silent: Duration, now: Duration) -> Vec<Packet> {
        let mut packets = Vec::new();
        if silent >= RETRY_AFTER && now.saturating_sub(self.repeated_at) >= RETRY_AFTER {
            self.repeated_at = now;
            // The same requests: the vehicle answers one that waits there once.
            packets.extend(self.waiting.iter().cloned());
        }
        let end = self.len.min(self.bytes.saturating_add(AHEAD));
        let mut offset = self.bytes;
        while offset < end && self.waiting.len() < MAX_WAITING {
            let size = (self.len - offset).min(DATA_LEN as u32);
            let is_requested = self.waiting.iter().any(|request| request.offset == offset);
            if !is_requested && !self.ahead.contains_key(&offset) {
                let request = Packet::request(self.sequence, self.session, Opcode::READ_FILE, offset, "");
                let request = Packet { size: size as u8, ..request };
                self.sequence = self.sequence.wrapping_add(1);
                self.waiting.push_back(request.clone());
                packets.push(request);
            }
            offset += size;
        }
        packets
    }

    /// The file is open, perhaps again: continues if it is the same one.
    fn opened(&mut self, crc: u32) -> Option<DownloadEvent> {
        self.phase = Phase::Reading;
        self.waiting.clear();
        if self.crc == Some(crc) {
            return None;
        }
        self.crc = Some(crc);
        self.bytes = 0;
        self.ahead.clear();
        self.rate.clear();
        self.close_if_complete();
        Some(DownloadEvent::Opened { crc })
    }

    fn close_if_complete(&mut self) {
        if self.bytes == self.len {
            self.phase = Phase::Closing;
        }
    }

    fn take_piece(&mut self, packet: &Packet, now: Duration) -> Option<DownloadEvent> {
        if self.phase != Phase::Reading || packet.session != self.session {
            return None;
        }
        match packet.refusal() {
            Some(Refusal::InvalidSession) => {
                self.answered_at = Some(now);
                self.phase = Phase::Opening;
                return None;
            }
            Some(why) => {
                self.refused(why);
                return None;
            }
            None => {}
        }
        let is_this = |request: &Packet| {
            request.offset == packet.offset && usize::from(request.size) == packet.data.len()
        };
        let place = self.waiting.iter().position(is_this)?;
        // Only a new piece resets the timeout: a vehicle that repeats itself forever times out.
        self.answered_at = Some(now);
        let request = self.waiting.remove(place)?;
        if request.is_answered_by(packet) {
            // The vehicle answers in order: earlier requests are lost.
            self.waiting.drain(..place);
        }
        self.ahead.insert(packet.offset, packet.data.clone());
        let mut data = Vec::new();
        while let Some(piece) = self.ahead.remove(&self.bytes) {
            self.bytes += piece.len() as u32;
            data.extend(piece);
        }
        self.close_if_complete();
        (!data.is_empty()).then_some(DownloadEvent::Data(data))
    }

    fn refused(&mut self, why: Refusal) {
        self.phase = Phase::Over(Some(match why {
            Refusal::Busy => Failure::NotNow,
            Refusal::FileNotFound if self.path.is_none() => Failure::NoFiles,
            Refusal::FileNotFound => Failure::NoSuchFile,
            why => Failure::Refused(why),
        }));
    }

    /// Bytes that have arrived.
    fn arrived(&self) -> u32 {
        self.bytes + self.ahead.values().map(|piece| piece.len() as u32).sum::<u32>()
    }

    fn measure(&mut self, now: Duration) {
        let due =
            self.rate.back().is_none_or(|(last, _)| now.saturating_sub(*last) >= Duration::from_secs(1));
        if due && self.phase == Phase::Reading {
            self.rate.push_back((now, self.arrived()));
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
        let mut download = Download::new(None, 0);
        for _ in 0..MAX_LISTED {
            for packet in download.poll(Duration::ZERO) {
                download.take(&packet.ack(b"Fone\t1\0Ftwo\t2\0"), Duration::ZERO);
            }
        }
        assert_eq!(download.ended(), Some(Err(Failure::TooManyFiles)));
        assert!(download.listed.len() <= MAX_LISTED + 2);
    }

    #[test]
    fn the_last_bytes_of_the_longest_possible_file_are_requested() {
        let mut download = Download::new(Some("flight.mcap"), 0);
        for _ in 0..2 {
            for packet in download.poll(Duration::ZERO) {
                download.take(&packet.ack(&u32::MAX.to_le_bytes()), Duration::ZERO);
            }
        }
        download.resume(u32::MAX - 5);
        let requests = download.poll(Duration::ZERO);
        assert_eq!(requests.len(), 1, "{requests:?}");
        assert_eq!((requests[0].offset, requests[0].size), (u32::MAX - 5, 5));
    }
}
