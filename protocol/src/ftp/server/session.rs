//! One open file of one client: what it has asked for and was not yet sent.

use alloc::collections::VecDeque;
use core::time::Duration;

use crate::ftp::packet::{DATA_LEN, Opcode, Packet, Refusal};
use crate::ftp::server::Files;
use crate::identity::Address;

/// Most pieces of one burst: a client that is gone is not sent more.
const BURST_PIECES: u32 = 256;
/// Most single pieces that may wait; a client that needs another asks again.
const MAX_READS: usize = 64;

#[derive(Debug, Clone)]
struct Burst {
    request: Packet,
    sequence: u16,
    offset: u32,
    pieces_left: u32,
}

impl Burst {
    /// Whether it will come to this offset.
    fn is_ahead(&self, offset: u32) -> bool {
        let end = u64::from(self.offset) + u64::from(self.pieces_left) * u64::from(self.request.size);
        offset > self.offset && u64::from(offset) <= end
    }
}

#[derive(Debug, Clone)]
pub(super) struct Session {
    pub(super) number: u8,
    pub(super) client: Address,
    pub(super) link: usize,
    /// The place of the file in its list, and its length.
    pub(super) place: usize,
    pub(super) len: u32,
    pub(super) used_at: Duration,
    reads: VecDeque<Packet>,
    burst: Option<Burst>,
    /// A piece of the burst comes next, because a single one came before it.
    burst_next: bool,
}

impl Session {
    pub(super) fn new(
        number: u8,
        client: Address,
        link: usize,
        (place, len): (usize, u32),
        now: Duration,
    ) -> Self {
        Self {
            number,
            client,
            link,
            place,
            len,
            used_at: now,
            reads: VecDeque::new(),
            burst: None,
            burst_next: false,
        }
    }

    pub(super) fn is(&self, client: Address, number: u8) -> bool {
        self.client == client && self.number == number
    }

    /// Takes a request to read inside the file.
    pub(super) fn ask(&mut self, request: &Packet) {
        if request.opcode == Opcode::BurstReadFile {
            // A request that comes again does not begin again what is under way, and one for pieces farther ahead in
            // it prolongs it. So a client need not wait for the end of a burst, nor for its last packet if that is lost.
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
    }

    pub(super) fn end_burst(&mut self) {
        self.burst = None;
    }

    /// The next packet. Single pieces and a burst take turns, so that neither waits for the other.
    pub(super) fn next(&mut self, piece: &mut [u8; DATA_LEN], files: &mut dyn Files) -> Option<Packet> {
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
        let wanted = if size == 0 { DATA_LEN } else { usize::from(size).min(DATA_LEN) };
        let there = self.len.saturating_sub(offset) as usize;
        if there == 0 {
            return Err(Refusal::EndOfFile);
        }
        let wanted = wanted.min(there);
        match files.read(self.place, offset, &mut piece[..wanted]) {
            Some(read) if read == wanted => Ok(read),
            _ => Err(Refusal::Fail),
        }
    }
}
