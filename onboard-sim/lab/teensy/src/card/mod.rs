//! The flight's log on an SD card, as MCAP (<https://mcap.dev/spec>): what `replay` reads.
//!
//! A frame puts its record into a [`Ring`] and never waits. The main context writes the ring to the
//! card ([`CardLog::poll`]), and may wait there: cards stall for 250 ms now and then. While it
//! waits, the ring fills; a record without room is lost, counted, and named in the file.

#[cfg(test)]
mod tests;

use alloc::string::ToString as _;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use embedded_sdmmc::{
    BlockDevice, Error, Mode, RawDirectory, RawFile, ShortFileName, TimeSource, Timestamp, VolumeIdx,
    VolumeManager,
};
use flight::computer::{FRAME_MS, LogState};
use heapless::spsc::{Consumer, Producer, Queue};

/// Bytes between frames and writer: records of 0.5 s at 57 kB/s.
pub const RING_BYTES: usize = 32 * 1024;

/// The queue between frames and writer.
pub type Ring = Queue<u8, RING_BYTES>;

/// Length, losses before it, and number of a record's frame, in front of its bytes in the ring.
const PREFIX_BYTES: usize = 2 + 4 + 8;
/// Bytes that are written at once: whole sectors, or each write reads its sector first.
const WRITE_BYTES: usize = 4096;
/// Records after which the file's length is written: a power cut loses a second.
const FLUSH_RECORDS: u32 = 200;
/// Polls after which a card that failed is tried again.
const RETRY_POLLS: u32 = 200;

/// Records and channel of the MCAP file: its numbers for opcodes, and the channel of the frames,
/// which the head opens.
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const METADATA: u8 = 0x0C;
pub(crate) const CHANNEL: u16 = 0x7001;

/// A frame's end of the ring.
pub struct Appender<'a> {
    ring: Producer<'a, u8>,
    lost_since: u32,
    lost: u64,
}

impl<'a> Appender<'a> {
    /// The end of a ring into which frames write.
    pub fn new(ring: Producer<'a, u8>) -> Self {
        Self { ring, lost_since: 0, lost: 0 }
    }

    /// Appends the record of a frame, or loses it if the ring has no room.
    pub fn append(&mut self, frame: u64, record: &[u8]) {
        let length = u16::try_from(record.len());
        let room = self.ring.capacity() - self.ring.len();
        let (Ok(length), true) = (length, room >= PREFIX_BYTES + record.len()) else {
            (self.lost_since, self.lost) = (self.lost_since.saturating_add(1), self.lost + 1);
            return;
        };
        let lost = core::mem::take(&mut self.lost_since).to_le_bytes();
        let prefix = length.to_le_bytes().into_iter().chain(lost).chain(frame.to_le_bytes());
        for byte in prefix.chain(record.iter().copied()) {
            // Room was checked, and only the writer changes it: to more.
            let _ = self.ring.enqueue(byte);
        }
    }

    /// Records lost since power-up.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// The board has no calendar: files have no date.
struct NoClock;

impl TimeSource for NoClock {
    fn get_timestamp(&self) -> Timestamp {
        Timestamp {
            year_since_1970: 0,
            zero_indexed_month: 0,
            zero_indexed_day: 0,
            hours: 0,
            minutes: 0,
            seconds: 0,
        }
    }
}

/// The main context's end: writes the ring to a card.
pub struct CardLog<D: BlockDevice> {
    /// `None` only while it is made again.
    card: Option<VolumeManager<D, NoClock>>,
    file: Option<RawFile>,
    pending: Vec<u8>,
    /// Messages of the next chunk, with the times of the first and the last, ns: a reader trusts
    /// only messages that a checksum protects.
    chunk: Vec<u8>,
    chunk_ns: [u64; 2],
    sequence: u32,
    unflushed: u32,
    waits: u32,
    state: LogState,
}

impl<D: BlockDevice> CardLog<D> {
    /// A log on a card with the file [`HEAD`].
    pub fn new(card: D) -> Self {
        Self {
            card: Some(VolumeManager::new(card, NoClock)),
            file: None,
            pending: Vec::with_capacity(WRITE_BYTES + usize::from(u16::MAX)),
            chunk: Vec::with_capacity(WRITE_BYTES + usize::from(u16::MAX)),
            chunk_ns: [0; 2],
            sequence: 0,
            unflushed: 0,
            waits: 0,
            state: LogState { running: false, space_bytes: 0 },
        }
    }

    /// Whether the card takes what it is given, and its space: its size less that of its files.
    pub fn state(&self) -> LogState {
        self.state
    }

    /// Writes what is in the ring. It may wait for the card, but never keeps a frame waiting.
    pub fn poll(&mut self, ring: &mut Consumer<'_, u8>) {
        if self.file.is_none() {
            self.waits = self.waits.saturating_sub(1);
            if self.waits > 0 {
                return;
            }
            self.waits = RETRY_POLLS;
        }
        if self.written(ring).is_err() {
            self.lose_the_card();
        }
    }

    /// Ends the file. One that was not ended is read, too, up to its last flush.
    pub fn finish(&mut self) {
        // The lengths of the data's end and of the footer, and no checksum, summary or offset.
        const END: [(u8, usize); 2] = [(0x0F, 4), (0x02, 20)];
        self.end_chunk();
        let (Some(card), Some(file)) = (&self.card, self.file.take()) else { return };
        for (opcode, length) in END {
            put_header(&mut self.pending, opcode, length);
            self.pending.resize(self.pending.len() + length, 0);
        }
        self.pending.extend(MAGIC);
        self.state.space_bytes = self.state.space_bytes.saturating_sub(self.pending.len() as u64);
        let ended = card.write(file, &self.pending).and_then(|()| card.close_file(file));
        self.pending.clear();
        self.state.running = false;
        if ended.is_err() {
            self.lose_the_card();
        }
    }

    fn written(&mut self, ring: &mut Consumer<'_, u8>) -> Result<(), Error<D::Error>> {
        let Some(card) = &self.card else { return Ok(()) };
        let file = if let Some(file) = self.file {
            file
        } else {
            let (file, space_bytes) = begun(card)?;
            (self.sequence, self.unflushed) = (0, 0);
            self.state = LogState { running: true, space_bytes };
            *self.file.insert(file)
        };
        while ring.len() >= PREFIX_BYTES {
            self.take(ring);
            while self.pending.len() >= WRITE_BYTES {
                let card = self.card.as_ref().ok_or(Error::NoSuchVolume)?;
                card.write(file, &self.pending[..WRITE_BYTES])?;
                self.state.space_bytes = self.state.space_bytes.saturating_sub(WRITE_BYTES as u64);
                self.pending.drain(..WRITE_BYTES);
            }
            if self.unflushed >= FLUSH_RECORDS {
                self.unflushed = 0;
                self.card.as_ref().ok_or(Error::NoSuchVolume)?.flush_file(file)?;
            }
        }
        Ok(())
    }

    /// Takes a record out of the ring. A frame is an interrupt, so it is there from end to end.
    fn take(&mut self, ring: &mut Consumer<'_, u8>) {
        let mut next = || ring.dequeue().unwrap_or(0);
        let length = usize::from(u16::from_le_bytes(core::array::from_fn(|_| next())));
        let lost = u32::from_le_bytes(core::array::from_fn(|_| next()));
        let frame = u64::from_le_bytes(core::array::from_fn(|_| next()));
        if lost > 0 {
            self.put_losses(lost, frame);
        }
        let time_ns = frame * u64::from(FRAME_MS) * 1_000_000;
        self.chunk_ns = [if self.chunk.is_empty() { time_ns } else { self.chunk_ns[0] }, time_ns];
        put_header(&mut self.chunk, MESSAGE, 2 + 4 + 8 + 8 + length);
        self.chunk.extend(CHANNEL.to_le_bytes());
        self.chunk.extend(self.sequence.to_le_bytes());
        self.chunk.extend([time_ns.to_le_bytes(); 2].as_flattened());
        self.chunk.extend((0..length).map(|_| next()));
        (self.sequence, self.unflushed) = (self.sequence + 1, self.unflushed + 1);
        if self.chunk.len() >= WRITE_BYTES || self.unflushed >= FLUSH_RECORDS {
            self.end_chunk();
        }
    }

    /// Puts the chunk, uncompressed, behind what is pending.
    fn end_chunk(&mut self) {
        if self.chunk.is_empty() {
            return;
        }
        let length = self.chunk.len() as u64;
        put_header(&mut self.pending, CHUNK, 3 * 8 + 4 + 4 + 8 + self.chunk.len());
        for number in [self.chunk_ns[0], self.chunk_ns[1], length] {
            self.pending.extend(number.to_le_bytes());
        }
        self.pending.extend(crc32fast::hash(&self.chunk).to_le_bytes());
        put_text(&mut self.pending, "");
        self.pending.extend(length.to_le_bytes());
        self.pending.append(&mut self.chunk);
    }

    /// Names lost records in the file, as metadata.
    fn put_losses(&mut self, lost: u32, before: u64) {
        self.end_chunk();
        let [lost, before] = [u64::from(lost), before].map(|number| number.to_string());
        let pairs = [("frames", &lost), ("before", &before)];
        let map_bytes: usize = pairs.iter().map(|(key, value)| 8 + key.len() + value.len()).sum();
        put_header(&mut self.pending, METADATA, 4 + LOST.len() + 4 + map_bytes);
        put_text(&mut self.pending, LOST);
        self.pending.extend((map_bytes as u32).to_le_bytes());
        for (key, value) in pairs {
            put_text(&mut self.pending, key);
            put_text(&mut self.pending, value);
        }
    }

    /// A card that has failed was pulled out, or is full: nothing that is known about it holds.
    fn lose_the_card(&mut self) {
        self.state.running = false;
        if self.file.is_some() {
            self.state.space_bytes = 0;
        }
        self.file = None;
        self.pending.clear();
        self.chunk.clear();
        self.waits = RETRY_POLLS;
        if let Some(card) = self.card.take() {
            let (device, time) = card.free();
            self.card = Some(VolumeManager::new(device, time));
        }
    }
}

/// File with which each log begins: made on a desk by this package's program, and copied to the
/// card by a person. Without it nothing is recorded, and so nothing armed.
pub const HEAD: &str = "HEAD.MCA";

/// Name of the metadata about lost records.
pub const LOST: &str = "lost";

/// First and last bytes of an MCAP file.
const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

pub(crate) fn put_header(into: &mut Vec<u8>, opcode: u8, length: usize) {
    into.push(opcode);
    into.extend((length as u64).to_le_bytes());
}

pub(crate) fn put_text(into: &mut Vec<u8>, text: &str) {
    into.extend((text.len() as u32).to_le_bytes());
    into.extend(text.bytes());
}

/// Begins the next file, `FLIGHT00.MCA` and on, in the root of the first partition; returns it and
/// the space that the card has.
fn begun<D: BlockDevice>(card: &VolumeManager<D, NoClock>) -> Result<(RawFile, u64), Error<D::Error>> {
    let volume = card.open_raw_volume(VolumeIdx(0))?;
    let folder: RawDirectory = card.open_root_dir(volume)?;
    let (mut next, mut used_bytes) = (0, 0);
    card.iterate_dir(folder, |entry| {
        used_bytes += u64::from(entry.size);
        let number = core::str::from_utf8(entry.name.base_name()).ok();
        let number = number.and_then(|name| name.strip_prefix("FLIGHT")?.parse::<u8>().ok());
        next = number.map_or(next, |number| next.max(number.saturating_add(1)));
        ControlFlow::Continue(())
    })?;
    let size_blocks = card.device(|device| device.num_blocks()).map_err(Error::DeviceError)?;
    let mut name = *b"FLIGHT00.MCA";
    (name[6], name[7]) = (b'0' + next / 10 % 10, b'0' + next % 10);
    let name = core::str::from_utf8(&name).ok().and_then(|name| ShortFileName::create_from_str(name).ok());
    let file = card.open_file_in_dir(folder, name.ok_or(Error::Unsupported)?, Mode::ReadWriteCreate)?;
    let head = card.open_file_in_dir(folder, HEAD, Mode::ReadOnly)?;
    let mut sector = [0; 512];
    loop {
        let read = card.read(head, &mut sector)?;
        if read == 0 {
            break;
        }
        used_bytes += read as u64;
        card.write(file, &sector[..read])?;
    }
    card.close_file(head)?;
    card.flush_file(file)?;
    Ok((file, (u64::from(size_blocks.0) * 512).saturating_sub(used_bytes)))
}
