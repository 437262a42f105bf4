//! The side of MAVLink FTP that has the files, for reading only.
//!
//! Requests go in with [`Server::take`]; answers come out of [`Server::next_answer`], and the
//! pieces of files out of [`Server::next_piece`], one at a time, whenever the link has room for
//! one. So the caller sets the pace: nothing exceeds the capacity of the link.

use alloc::borrow::ToOwned as _;
use alloc::collections::VecDeque;
use alloc::string::String;
use alloc::vec::Vec;
use alloc::{format, vec};
use core::time::Duration;

use super::packet::{DATA_LEN, FileRequest, Opcode, Packet, Refusal};
use super::{LOG_DIRECTORY, crc};
use crate::dialect::MavMessage;
use crate::identity::Address;

/// Most open files; of one client at most [`MAX_SESSIONS_OF_ONE`], so that none locks out the
/// others.
const MAX_SESSIONS: usize = 8;
const MAX_SESSIONS_OF_ONE: usize = 4;
/// Idle time after which a file is closed.
const IDLE: Duration = Duration::from_mins(1);
/// Time for which the link serves files after a client's request.
const BUSY: Duration = Duration::from_secs(5);
/// Most answers that may wait; beyond it a client must repeat its request.
const MAX_READY: usize = 32;
/// Most checksums that may wait.
const MAX_SUMS: usize = 4;
/// Bytes of a file that one call of [`Server::work`] adds to a checksum.
const SUMMED_AT_ONCE: usize = 64 * 1024;
/// Most clients whose last answer is stored.
const MAX_REMEMBERED: usize = 8;

/// A file that can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileEntry {
    /// Its name in [`LOG_DIRECTORY`], at most 100 bytes.
    pub name: String,
    pub len: u32,
}

/// The files that a [`Server`] reads. They do not change while they are offered.
pub trait Files {
    /// Every file, the oldest first.
    fn entries(&self) -> &[FileEntry];

    /// Reads from a file (its place in the list) and returns how many bytes there were; `None` if
    /// it cannot be read.
    fn read(&mut self, place: usize, offset: u32, into: &mut [u8]) -> Option<usize>;
}

/// A vehicle without files.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn entries(&self) -> &[FileEntry] {
        &[]
    }

    fn read(&mut self, _place: usize, _offset: u32, _into: &mut [u8]) -> Option<usize> {
        None
    }
}

/// Files that are completely in memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InMemory {
    entries: Vec<FileEntry>,
    contents: Vec<Vec<u8>>,
}

impl InMemory {
    /// Files of these names and contents, the oldest first.
    pub fn new<'a>(files: impl IntoIterator<Item = (&'a str, Vec<u8>)>) -> Self {
        let entry = |(name, content): (&str, Vec<u8>)| {
            (FileEntry { name: name.to_owned(), len: content.len() as u32 }, content)
        };
        let (entries, contents) = files.into_iter().map(entry).unzip();
        Self { entries, contents }
    }
}

impl Files for InMemory {
    fn entries(&self) -> &[FileEntry] {
        &self.entries
    }

    fn read(&mut self, place: usize, offset: u32, into: &mut [u8]) -> Option<usize> {
        let from = self.contents.get(place)?.get(offset as usize..)?;
        let read = from.len().min(into.len());
        into[..read].copy_from_slice(&from[..read]);
        Some(read)
    }
}

/// Outcome of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    Answered,
    /// It was for a file, and files are not read now.
    NotNow,
}

#[derive(Debug, Clone)]
struct Answer {
    link: usize,
    to: Address,
    packet: Packet,
}

/// A checksum that is being computed.
#[derive(Debug, Clone)]
struct Sum {
    link: usize,
    to: Address,
    request: Packet,
    place: usize,
    done: u32,
    crc: u32,
}

/// The last request of a client that is not one to read, and its answer.
#[derive(Debug, Clone)]
struct Remembered {
    client: Address,
    request: Packet,
    answer: Packet,
}

/// The server.
#[derive(Debug, Clone, Default)]
pub struct Server {
    sessions: Vec<Session>,
    ready: VecDeque<Answer>,
    sums: VecDeque<Sum>,
    /// The last checksum, with the place of its file.
    summed: Option<(usize, u32)>,
    remembered: VecDeque<Remembered>,
    /// The session whose turn it is.
    turn: usize,
}

impl Server {
    /// Takes a request from a link. `open`: this client may read files now.
    pub fn take(
        &mut self,
        request: &FileRequest,
        link: usize,
        open: bool,
        files: &dyn Files,
        now: Duration,
    ) -> Taken {
        let FileRequest { source: client, packet, .. } = request;
        self.sessions.retain(|session| now.saturating_sub(session.used_at) < IDLE);
        let reads = matches!(packet.opcode, Opcode::READ_FILE | Opcode::BURST_READ_FILE);
        let of_file = reads
            || (!packet.path().is_empty() && place_of(packet.path(), files).is_some())
            || (packet.opcode == Opcode::LIST_DIRECTORY
                && matches!(parts(packet.path())[..], [directory] if names_log(directory)));
        if !open && of_file {
            self.answer(link, *client, packet.nak(Refusal::Busy));
            return Taken::NotNow;
        }
        if reads {
            let session = self.sessions.iter_mut().find(|session| session.is(*client, packet.session));
            let refusal = session.map_or(Some(Refusal::InvalidSession), |session| {
                (session.link, session.used_at) = (link, now);
                session.queue(packet)
            });
            if let Some(why) = refusal {
                self.answer(link, *client, packet.nak(why));
            }
            return Taken::Answered;
        }
        // A repeated request has lost its answer.
        let before = self.remembered.iter().find(|last| last.client == *client && last.request == *packet);
        if let Some(answer) = before.map(|last| last.answer.clone())
            && !self.is_void(*client, &answer)
        {
            self.answer(link, *client, answer);
            return Taken::Answered;
        }
        let answer = match packet.opcode {
            Opcode::NONE => packet.ack(&[]),
            Opcode::TERMINATE_SESSION => {
                let before = self.sessions.len();
                self.sessions.retain(|session| !session.is(*client, packet.session));
                if self.sessions.len() < before {
                    packet.ack(&[])
                } else {
                    packet.nak(Refusal::InvalidSession)
                }
            }
            Opcode::RESET_SESSIONS => {
                self.sessions.retain(|session| session.client != *client);
                packet.ack(&[])
            }
            Opcode::LIST_DIRECTORY => list(packet, files),
            Opcode::OPEN_FILE_RO => match place_of(packet.path(), files) {
                Some(place) => self.open(packet, *client, link, (place, files.entries()[place].len), now),
                None => packet.nak(Refusal::FileNotFound),
            },
            Opcode::CALC_FILE_CRC32 => match place_of(packet.path(), files) {
                Some(place) => match self.summed {
                    Some((summed, crc)) if summed == place => packet.ack(&crc.to_le_bytes()),
                    _ => {
                        self.sum(packet, *client, link, place);
                        return Taken::Answered;
                    }
                },
                None => packet.nak(Refusal::FileNotFound),
            },
            writes if writes.writes() => packet.nak(Refusal::FileProtected),
            _ => packet.nak(Refusal::UnknownCommand),
        };
        self.remember(*client, packet, &answer);
        self.answer(link, *client, answer);
        Taken::Answered
    }

    /// Closes every file: reading is not permitted now.
    pub fn close_all(&mut self) {
        self.sessions.clear();
        self.sums.clear();
    }

    /// Continues with a checksum; called regularly.
    pub fn work(&mut self, files: &mut dyn Files) {
        let Some(sum) = self.sums.front_mut() else { return };
        let len = files.entries().get(sum.place).map_or(0, |entry| entry.len);
        let mut piece = vec![0; SUMMED_AT_ONCE.min((len - sum.done.min(len)) as usize)];
        let read = if piece.is_empty() { Some(0) } else { files.read(sum.place, sum.done, &mut piece) };
        let answer = match read {
            Some(read) if read == piece.len() => {
                sum.crc = crc::continued(sum.crc, &piece);
                sum.done += read as u32;
                if sum.done < len {
                    return;
                }
                self.summed = Some((sum.place, sum.crc));
                sum.request.ack(&sum.crc.to_le_bytes())
            }
            _ => sum.request.nak(Refusal::Fail),
        };
        if let Some(Sum { link, to, request, .. }) = self.sums.pop_front() {
            self.remember(to, &request, &answer);
            self.answer(link, to, answer);
        }
    }

    /// Whether a client reads files over this link.
    pub fn is_busy(&self, link: usize, now: Duration) -> bool {
        self.sessions.iter().any(|session| session.link == link && now.saturating_sub(session.used_at) < BUSY)
    }

    /// The next answer for this link that is no piece of a file.
    pub fn next_answer(&mut self, link: usize) -> Option<MavMessage> {
        let place = self.ready.iter().position(|answer| answer.link == link)?;
        let Answer { to, packet, .. } = self.ready.remove(place)?;
        Some(packet.message(to))
    }

    /// The next message for this link.
    pub fn next(&mut self, link: usize, files: &mut dyn Files, now: Duration) -> Option<MavMessage> {
        self.next_answer(link).or_else(|| self.next_piece(link, files, now))
    }

    /// The next piece of a file for this link; clients take turns.
    pub fn next_piece(&mut self, link: usize, files: &mut dyn Files, now: Duration) -> Option<MavMessage> {
        let count = self.sessions.len();
        for step in 1..=count {
            let place = (self.turn + step) % count;
            let session = &mut self.sessions[place];
            if session.link != link {
                continue;
            }
            let mut piece = [0; DATA_LEN];
            if let Some(packet) = session.next(&mut piece, files) {
                // A burst counts as use: a client sends no requests during it.
                session.used_at = now;
                let to = session.client;
                self.turn = place;
                return Some(packet.message(to));
            }
        }
        None
    }

    fn answer(&mut self, link: usize, to: Address, packet: Packet) {
        if self.ready.len() < MAX_READY {
            self.ready.push_back(Answer { link, to, packet });
        }
    }

    fn remember(&mut self, client: Address, request: &Packet, answer: &Packet) {
        self.remembered.retain(|last| last.client != client);
        if self.remembered.len() >= MAX_REMEMBERED {
            self.remembered.pop_front();
        }
        self.remembered.push_back(Remembered { client, request: request.clone(), answer: answer.clone() });
    }

    /// Whether an answer that is remembered does not hold any more: its session is closed, or there
    /// are files now.
    fn is_void(&self, client: Address, answer: &Packet) -> bool {
        match answer.request {
            Opcode::OPEN_FILE_RO => {
                answer.opcode == Opcode::NAK
                    || !self.sessions.iter().any(|session| session.is(client, answer.session))
            }
            Opcode::LIST_DIRECTORY => true,
            _ => false,
        }
    }

    fn sum(&mut self, request: &Packet, to: Address, link: usize, place: usize) {
        let waits = self.sums.iter().any(|sum| sum.to == to && sum.request == *request);
        if !waits && self.sums.len() < MAX_SUMS {
            self.sums.push_back(Sum { link, to, request: request.clone(), place, done: 0, crc: 0 });
        }
    }

    /// Opens a file. A client that opens it again has been restarted: its old session would go on
    /// with its burst.
    fn open(
        &mut self,
        request: &Packet,
        client: Address,
        link: usize,
        (place, len): (usize, u32),
        now: Duration,
    ) -> Packet {
        let closed: Vec<u8> = self
            .sessions
            .extract_if(.., |session| session.client == client && session.place == place)
            .map(|session| session.number)
            .collect();
        if self.sessions.iter().filter(|session| session.client == client).count() >= MAX_SESSIONS_OF_ONE
            && let Some(oldest) = self.sessions.iter().position(|session| session.client == client)
        {
            self.sessions.remove(oldest);
        }
        if self.sessions.len() >= MAX_SESSIONS {
            return request.nak(Refusal::NoSessionsAvailable);
        }
        // Some clients expect the number that they have named. A number that was just closed may
        // still have packets under way.
        let is_free = |number: &u8| {
            !closed.contains(number) && !self.sessions.iter().any(|session| session.number == *number)
        };
        let numbers = (0..=u8::MAX).map(|step| request.session.wrapping_add(step));
        let Some(number) = numbers.into_iter().find(is_free) else {
            return request.nak(Refusal::NoSessionsAvailable);
        };
        self.sessions.push(Session {
            number,
            client,
            link,
            place,
            len,
            used_at: now,
            reads: VecDeque::new(),
            burst: None,
            burst_next: false,
        });
        Packet { session: number, ..request.ack(&len.to_le_bytes()) }
    }
}

/// A path as the clients write it: with or without the first slash.
fn parts(path: &str) -> Vec<&str> {
    path.split('/').filter(|part| !part.is_empty()).collect()
}

/// Whether a part of a path names the directory of the log. `@MAV_LOG` is its standard name.
fn names_log(part: &str) -> bool {
    part == "@MAV_LOG" || parts(LOG_DIRECTORY) == [part]
}

fn place_of(path: &str, files: &dyn Files) -> Option<usize> {
    match parts(path)[..] {
        [directory, name] if names_log(directory) => {
            files.entries().iter().position(|entry| entry.name == name)
        }
        _ => None,
    }
}

/// A part of a directory, from the entry with the number in `offset` on: each with its kind, its
/// name, and the length of a file behind a tab.
fn list(request: &Packet, files: &dyn Files) -> Packet {
    let entries: Vec<String> = match parts(request.path())[..] {
        [] => vec![format!("D{}", LOG_DIRECTORY.trim_start_matches('/'))],
        [directory] if names_log(directory) => {
            files.entries().iter().map(|FileEntry { name, len }| format!("F{name}\t{len}")).collect()
        }
        _ => return request.nak(Refusal::FileNotFound),
    };
    let mut data = Vec::new();
    for entry in entries.iter().skip(request.offset as usize) {
        if data.len() + entry.len() + 1 > DATA_LEN {
            break;
        }
        data.extend_from_slice(entry.as_bytes());
        data.push(0);
    }
    if data.is_empty() { request.nak(Refusal::EndOfFile) } else { request.ack(&data) }
}

// One open file of one client: its requests that are not yet served.

/// Most pieces of one burst: a client that has left is not sent more.
const BURST_PIECES: u32 = 256;
/// Most single pieces that may wait; beyond it a client must repeat its request.
const MAX_READS: usize = 64;

#[derive(Debug, Clone)]
struct Burst {
    request: Packet,
    sequence: u16,
    offset: u32,
    pieces_left: u32,
}

impl Burst {
    /// Whether it will reach this offset.
    fn is_ahead(&self, offset: u32) -> bool {
        let end = u64::from(self.offset) + u64::from(self.pieces_left) * u64::from(self.request.size);
        offset > self.offset && u64::from(offset) <= end
    }
}

#[derive(Debug, Clone)]
struct Session {
    number: u8,
    client: Address,
    link: usize,
    /// The place of the file in its list, and its length.
    place: usize,
    len: u32,
    used_at: Duration,
    reads: VecDeque<Packet>,
    burst: Option<Burst>,
    /// The next piece is from the burst, because a single one came before it.
    burst_next: bool,
}

impl Session {
    fn is(&self, client: Address, number: u8) -> bool {
        self.client == client && self.number == number
    }

    /// Takes a request to read. Returns the refusal of one that begins behind the end of the file.
    fn queue(&mut self, request: &Packet) -> Option<Refusal> {
        let is_burst = request.opcode == Opcode::BURST_READ_FILE;
        if request.offset >= self.len {
            self.burst.take_if(|_| is_burst);
            return Some(Refusal::EndOfFile);
        }
        if is_burst {
            // A repeated request does not restart a burst, and one for pieces farther ahead
            // prolongs it. So a client need not wait for the end of a burst, nor for its last
            // packet if that is lost.
            if let Some(burst) = &mut self.burst
                && burst.request.size == request.size
                && (burst.request == *request || burst.is_ahead(request.offset))
            {
                if burst.request != *request {
                    burst.pieces_left = BURST_PIECES;
                }
            } else {
                self.burst = Some(Burst {
                    request: request.clone(),
                    sequence: request.sequence,
                    offset: request.offset,
                    pieces_left: BURST_PIECES,
                });
            }
        } else if self.reads.len() < MAX_READS && !self.reads.contains(request) {
            self.reads.push_back(request.clone());
        }
        None
    }

    /// The next packet. Single pieces and a burst take turns, so that neither waits for the other.
    fn next(&mut self, piece: &mut [u8; DATA_LEN], files: &mut dyn Files) -> Option<Packet> {
        let burst_first = core::mem::replace(&mut self.burst_next, false);
        if let Some(request) =
            (!burst_first || self.burst.is_none()).then(|| self.reads.pop_front()).flatten()
        {
            self.burst_next = true;
            let read = self.read(request.offset, request.size, piece, files);
            return Some(read.map_or_else(|why| request.nak(why), |read| request.ack(&piece[..read])));
        }
        let Burst { request, sequence, offset, pieces_left } = self.burst.take()?;
        let numbered = Packet { sequence, offset, ..request.clone() };
        let read = match self.read(offset, request.size, piece, files) {
            Ok(read) => read,
            Err(why) => return Some(numbered.nak(why)),
        };
        let next = offset + read as u32;
        let complete = next >= self.len || pieces_left <= 1;
        if !complete {
            self.burst = Some(Burst {
                request,
                sequence: sequence.wrapping_add(1),
                offset: next,
                pieces_left: pieces_left - 1,
            });
        }
        Some(Packet { burst_complete: complete, ..numbered.ack(&piece[..read]) })
    }

    fn read(
        &self,
        offset: u32,
        size: u8,
        piece: &mut [u8; DATA_LEN],
        files: &mut dyn Files,
    ) -> Result<usize, Refusal> {
        // Some clients leave the size to the vehicle.
        let most = if size == 0 { DATA_LEN } else { usize::from(size).min(DATA_LEN) };
        let wanted = most.min(self.len.saturating_sub(offset) as usize);
        match files.read(self.place, offset, &mut piece[..wanted]) {
            Some(read) if read == wanted => Ok(read),
            _ => Err(Refusal::Fail),
        }
    }
}

#[cfg(test)]
mod tests;
