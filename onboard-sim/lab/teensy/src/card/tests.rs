//! A complete flight's log on simulated cards: good, slow, pulled out, full.

use std::cell::{Cell, RefCell};
use std::io::{Cursor, Read as _, Write as _};
use std::rc::Rc;
use std::sync::OnceLock;

use allocation_counter::measure;
use embedded_sdmmc::{Block, BlockCount, BlockIdx};
use fatfs::{FatType, FileSystem, FormatVolumeOptions, FsOptions, format_volume};
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use replay::log::{Entry, FlightLog};

use super::*;
use crate::tests::fly;

/// Start of the partition, and size of a card, sectors: FAT32 needs 33 MB.
const PARTITION: usize = 8;
const SECTORS: usize = 80_000;

/// A record and its time, ns.
type Timed = (u64, Vec<u8>);

/// Frames and records of a flight, and the head of its log.
fn flown() -> &'static (Vec<Timed>, Vec<u8>) {
    static FLOWN: OnceLock<(Vec<Timed>, Vec<u8>)> = OnceLock::new();
    FLOWN.get_or_init(|| {
        let (bench, begun) = fly(None);
        let (toml, _) = crate::mission("mk3").unwrap();
        (bench.log, crate::head("mk3", toml, &begun).unwrap())
    })
}

/// Frames that come while the main context waits for the card.
struct Feeder {
    next: usize,
    appender: Appender<'static>,
}

impl Feeder {
    fn feed(&mut self, frames: usize) {
        for (frame, record) in flown().0.iter().skip(self.next).take(frames) {
            let heap = measure(|| self.appender.append(*frame, record));
            assert_eq!((heap.count_total, heap.bytes_current), (0, 0), "frame {frame} uses the heap");
        }
        self.next += frames;
    }
}

struct Card {
    bytes: RefCell<Vec<u8>>,
    writes: Cell<usize>,
    /// Each of so many writes takes so many frames.
    stalls: Option<[usize; 2]>,
    /// Frames after which it is pulled out.
    pulled_after: usize,
    feeder: RefCell<Feeder>,
}

#[derive(Clone)]
struct Slot(Rc<Card>);

#[derive(Debug, thiserror::Error)]
#[error("no card")]
struct NoCard;

impl Slot {
    fn there(&self) -> Result<(), NoCard> {
        if self.0.feeder.borrow().next < self.0.pulled_after { Ok(()) } else { Err(NoCard) }
    }
}

impl BlockDevice for Slot {
    type Error = NoCard;

    fn read(&self, blocks: &mut [Block], at: BlockIdx) -> Result<(), NoCard> {
        self.there()?;
        for (block, sector) in blocks.iter_mut().zip(at.0 as usize..) {
            block.copy_from_slice(&self.0.bytes.borrow()[512 * sector..][..512]);
        }
        Ok(())
    }

    fn write(&self, blocks: &[Block], at: BlockIdx) -> Result<(), NoCard> {
        self.there()?;
        self.0.writes.set(self.0.writes.get() + 1);
        if let Some([_, frames]) = self.0.stalls.filter(|[each, _]| self.0.writes.get().is_multiple_of(*each))
        {
            self.0.feeder.borrow_mut().feed(frames);
        }
        for (block, sector) in blocks.iter().zip(at.0 as usize..) {
            self.0.bytes.borrow_mut()[512 * sector..][..512].copy_from_slice(&block[..]);
        }
        Ok(())
    }

    fn num_blocks(&self) -> Result<BlockCount, NoCard> {
        self.there()?;
        Ok(BlockCount((self.0.bytes.borrow().len() / 512) as u32))
    }
}

/// A formatted card with the head, and a file that leaves so many bytes.
fn formatted(free_bytes: Option<usize>) -> Vec<u8> {
    let mut bytes = vec![0; 512 * SECTORS];
    let sectors = ((SECTORS - PARTITION) as u32).to_le_bytes();
    bytes[446 + 4] = 0x0C;
    bytes[446 + 8..][..4].copy_from_slice(&(PARTITION as u32).to_le_bytes());
    bytes[446 + 12..][..4].copy_from_slice(&sectors);
    bytes[510..512].copy_from_slice(&[0x55, 0xAA]);
    let mut partition = Cursor::new(&mut bytes[512 * PARTITION..]);
    let options = FormatVolumeOptions::new().fat_type(FatType::Fat32).bytes_per_cluster(512);
    format_volume(&mut partition, options).unwrap();
    let disk = FileSystem::new(partition, FsOptions::new()).unwrap();
    disk.root_dir().create_file(HEAD).unwrap().write_all(&flown().1).unwrap();
    if let Some(free_bytes) = free_bytes {
        let free = disk.stats().unwrap().free_clusters() as usize * 512;
        let filled = vec![0; free - free_bytes];
        disk.root_dir().create_file("FULL.BIN").unwrap().write_all(&filled).unwrap();
    }
    drop(disk);
    bytes
}

/// The files of a card by name, those of flights alone.
fn flights(card: &Card) -> Vec<(String, Vec<u8>)> {
    let mut bytes = card.bytes.borrow_mut();
    let disk = FileSystem::new(Cursor::new(&mut bytes[512 * PARTITION..]), FsOptions::new()).unwrap();
    let mut found = Vec::new();
    for entry in disk.root_dir().iter().map(Result::unwrap) {
        if entry.file_name().starts_with("FLIGHT") {
            let mut content = Vec::new();
            entry.to_file().read_to_end(&mut content).unwrap();
            found.push((entry.file_name(), content));
        }
    }
    found
}

/// Frames that `replay` finds in a file, and whether the file is intact.
fn read(content: &[u8]) -> (Vec<(u64, Vec<u8>)>, bool) {
    let mut log = FlightLog::read("card".to_owned(), content).unwrap();
    let (mut frames, mut started) = (Vec::new(), false);
    while let Some(stamped) = log.next_entry().unwrap() {
        match stamped.entry {
            Entry::ComputerStart(_) => started = true,
            Entry::ComputerFrame(frame) => {
                let record: &ComputerFrame = &frame.record;
                frames.push((record.input.frame, record.encode_to_vec()));
            }
            _ => {}
        }
    }
    assert!(started, "the start of the computer is missing");
    (frames, log.damage().is_none())
}

/// Writes the flight; the writer polls once in each frame in which the card does not hold it up.
fn written(bytes: Vec<u8>, stalls: Option<[usize; 2]>, pulled_after: usize) -> (Rc<Card>, CardLog<Slot>) {
    let (producer, mut consumer) = Box::leak(Box::new(Ring::new())).split();
    let feeder = RefCell::new(Feeder { next: 0, appender: Appender::new(producer) });
    let card =
        Rc::new(Card { bytes: RefCell::new(bytes), writes: Cell::new(0), stalls, pulled_after, feeder });
    let mut log = CardLog::new(Slot(card.clone()));
    while card.feeder.borrow().next < flown().0.len() {
        card.feeder.borrow_mut().feed(1);
        log.poll(&mut consumer);
    }
    log.poll(&mut consumer);
    log.finish();
    (card, log)
}

#[test]
fn a_flight_on_a_good_card_is_read_by_replay_frame_for_frame() {
    let (card, log) = written(formatted(None), None, usize::MAX);
    let files = flights(&card);
    assert_eq!(files[0].0, "FLIGHT00.MCA");
    let (frames, intact) = read(&files[0].1);
    assert!(intact && frames == flown().0, "{} of {} frames", frames.len(), flown().0.len());
    assert_eq!(card.feeder.borrow().appender.lost(), 0);
    let used_bytes = files[0].1.len() + flown().1.len();
    assert_eq!(log.state().space_bytes + used_bytes as u64, 512 * SECTORS as u64);
}

/// 250 ms are 50 frames; so often as after 70 kB, a second and a half of the flight.
#[test]
fn a_card_that_stalls_for_a_quarter_of_a_second_loses_nothing() {
    let (card, _) = written(formatted(None), Some([400, 50]), usize::MAX);
    let (frames, intact) = read(&flights(&card)[0].1);
    assert!(intact && frames == flown().0);
    assert_eq!(card.feeder.borrow().appender.lost(), 0);
}

#[test]
fn a_card_that_stalls_for_two_seconds_loses_what_it_reports() {
    let (card, _) = written(formatted(None), Some([400, 400]), usize::MAX);
    let content = &flights(&card)[0].1;
    let (frames, intact) = read(content);
    let lost = card.feeder.borrow().appender.lost() as usize;
    assert!(
        intact && lost > 100 && frames.len() + lost == flown().0.len(),
        "{lost} lost of {}",
        frames.len()
    );
    assert!(frames.iter().all(|frame| flown().0.contains(frame)));
    assert!(content.windows(LOST.len()).any(|bytes| bytes == LOST.as_bytes()));
}

#[test]
fn a_card_that_is_pulled_out_has_the_flight_until_then() {
    let (card, log) = written(formatted(None), None, 4_000);
    assert!(!log.state().running);
    let (frames, intact) = read(&flights(&card)[0].1);
    assert!(!intact && (3_700..=4_000).contains(&frames.len()), "{}", frames.len());
    assert_eq!(frames[..], flown().0[..frames.len()]);
    assert!(card.feeder.borrow().appender.lost() > 1_000);
}

#[test]
fn a_full_card_is_reported_and_has_what_fitted() {
    let (card, log) = written(formatted(Some(1 << 20)), None, usize::MAX);
    assert!(!log.state().running);
    let (frames, _) = read(&flights(&card)[0].1);
    assert!(frames.len() > 1_000 && frames.len() < flown().0.len(), "{}", frames.len());
    assert_eq!(frames[..], flown().0[..frames.len()]);
}

/// A second flight on the same card begins a file, and leaves the first as it is.
#[test]
fn no_flight_is_written_over() {
    let (card, _) = written(formatted(None), None, usize::MAX);
    let first = flights(&card);
    let (again, _) = written(card.bytes.take(), None, usize::MAX);
    let both = flights(&again);
    assert_eq!(both.len(), 2);
    assert!(both[0] == first[0] && both[1].0 == "FLIGHT01.MCA");
}
