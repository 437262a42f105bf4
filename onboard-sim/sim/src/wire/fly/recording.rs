//! Selects the records in the log of a flight, and serves that log after landing.

use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::path::Path;

use flight::computer::LogState;
use flight::computer::messages::{CrewMessage, Severity};
use protocol::frame::Frame;
use protocol::ftp::server::{FileEntry, Files};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::ending;

use crate::wire::endpoint::{VehicleEndpoint, gives_out_its_log};
use crate::wire::record::{message_event, text_event};
use crate::wire::vehicle::{Vehicle, VehicleEvent};

pub(super) fn nanoseconds(time_s: f64) -> u64 {
    (1e9 * time_s) as u64
}

pub(super) fn record_raw(
    recorder: Option<&Recorder>,
    direction: Direction,
    link: &str,
    frame: &Frame,
    time_s: f64,
) {
    if let Some(recorder) = recorder
        && let Some(bytes) = frame.for_log()
    {
        let frame = RawFrame { direction, endpoint: "vehicle", link: link.to_owned(), bytes };
        recorder.record(Record::RawFrame(frame), nanoseconds(time_s));
    }
}

pub(super) fn note(recorder: Option<&Recorder>, time_s: f64, words: &str) {
    if let Some(recorder) = recorder {
        recorder.record(text_event(Severity::Info, words), nanoseconds(time_s));
    }
}

pub(super) fn record(recorder: &Recorder, vehicle: &Vehicle, events: &[VehicleEvent]) {
    let time_ns = nanoseconds(vehicle.time_s());
    for record in vehicle.computer_records() {
        recorder.record(record, time_ns);
    }
    for event in events {
        let record = match event {
            VehicleEvent::Verdict => match vehicle.verdict_record() {
                Some(verdict) => Record::LandingVerdict(Box::new(verdict)),
                None => continue,
            },
            VehicleEvent::Planned(timing) => Record::PilotTiming(*timing),
            VehicleEvent::Message(message) => message_event(message),
        };
        recorder.record(record, time_ns);
        if matches!(event, VehicleEvent::Message(CrewMessage::PhaseChanged { .. })) {
            recorder.sync_soon();
        }
    }
    for record in vehicle.records() {
        recorder.record(record, time_ns);
    }
}

/// A flight without a log is the operator's choice and not a failure.
pub(super) fn log_state(recorder: Option<&Recorder>) -> LogState {
    let Some(recorder) = recorder else {
        return LogState { running: true, space_bytes: u64::MAX };
    };
    let directory = recorder.path().parent().filter(|path| !path.as_os_str().is_empty());
    let space_bytes = fs4::available_space(directory.unwrap_or(Path::new("."))).unwrap_or(0);
    let running = recorder.is_intact() && recorder.dropped() == 0 && !recorder.is_removed();
    LogState { running, space_bytes }
}

// The vehicle's log as a file that it serves after landing: the part up to a mark, which does not
// change any more while recording continues, with the end of a log behind it.

/// Progress of offering the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Offer {
    #[default]
    NotYet,
    Marked,
    Made,
    /// The file cannot be read: there is nothing to offer.
    Impossible,
}

impl Offer {
    /// Advances it. If the log cannot be offered, returns the reason.
    pub(super) fn step(&mut self, recorder: &Recorder, vehicle: &Vehicle, endpoint: &mut VehicleEndpoint) {
        match self {
            Self::NotYet if vehicle.is_over() && gives_out_its_log(&vehicle.state()) => {
                if recorder.mark_soon() {
                    *self = Self::Marked;
                }
            }
            Self::Marked => {
                let Some(bytes) = recorder.marked_bytes() else { return };
                match MarkedLog::open(recorder, bytes) {
                    Ok(log) => {
                        *self = Self::Made;
                        endpoint.offer(Box::new(log));
                    }
                    Err(error) => {
                        *self = Self::Impossible;
                        let words = format!("the log is not offered for download: {error}");
                        note(Some(recorder), vehicle.time_s(), &words);
                    }
                }
            }
            Self::NotYet | Self::Made | Self::Impossible => {}
        }
    }
}

/// A log up to its mark.
struct MarkedLog {
    entries: [FileEntry; 1],
    file: File,
    marked_bytes: u64,
    ending: Vec<u8>,
}

impl MarkedLog {
    fn open(recorder: &Recorder, marked_bytes: u64) -> std::io::Result<Self> {
        let (path, ending) = (recorder.path(), ending());
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        // A name is part of a packet of 239 bytes, and of a list that is cut at tabs.
        let name: String = name.chars().filter(char::is_ascii_graphic).take(100).collect();
        let len = u32::try_from(marked_bytes + ending.len() as u64)
            .map_err(|_too_long| std::io::Error::other("it is longer than 4 GB"))?;
        Ok(Self { entries: [FileEntry { name, len }], file: File::open(path)?, marked_bytes, ending })
    }
}

impl Files for MarkedLog {
    fn entries(&self) -> &[FileEntry] {
        &self.entries
    }

    fn read(&mut self, _place: usize, offset: u32, into: &mut [u8]) -> Option<usize> {
        let offset = u64::from(offset);
        let in_file = self.marked_bytes.saturating_sub(offset).min(into.len() as u64) as usize;
        self.file.read_exact_at(&mut into[..in_file], offset).ok()?;
        let behind =
            (offset + in_file as u64).checked_sub(self.marked_bytes).and_then(|at| usize::try_from(at).ok());
        let rest =
            behind.filter(|_| in_file < into.len()).and_then(|at| self.ending.get(at..)).unwrap_or_default();
        let more = rest.len().min(into.len() - in_file);
        into[in_file..in_file + more].copy_from_slice(&rest[..more]);
        Some(in_file + more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::log::reader::{LogItem, LogReader};
    use protocol::log::record::{Event, EventLevel, Record};
    use protocol::log::writer::LogHeader;

    fn event(number: u32) -> Record {
        Record::Event(Event {
            level: EventLevel::Info,
            name: "vehicle".to_owned(),
            message: number.to_string(),
        })
    }

    /// The records that can be read of a log, and whether it ends as it should.
    fn read(bytes: &[u8]) -> (usize, bool) {
        let (mut reader, mut messages) = (LogReader::new(bytes), 0);
        while let Some(item) = reader.next_item().unwrap() {
            messages += usize::from(matches!(item, LogItem::Message { .. }));
        }
        (messages, reader.damage().is_none())
    }

    /// Recording continues behind the mark; the offered part is a complete log, the same in pieces
    /// of any length.
    #[test]
    fn a_log_up_to_its_mark_is_complete_and_does_not_change() {
        let folder = tempfile::tempdir().unwrap();
        let recorder =
            Recorder::create(&folder.path().join("flight.mcap"), false, &LogHeader::default()).unwrap();
        for number in 0..500 {
            recorder.record(event(number), u64::from(number));
        }
        assert!(recorder.mark_soon());
        for number in 500..2000 {
            recorder.record(event(number), u64::from(number));
        }
        let path = recorder.finish().unwrap();
        let mut log = MarkedLog::open(&recorder, recorder.marked_bytes().unwrap()).unwrap();
        let len = log.entries()[0].len;
        assert_eq!(log.entries()[0].name, "flight.mcap");
        for piece_len in [1, 7, 239, 5000] {
            let mut all = Vec::new();
            while all.len() < len as usize {
                let mut piece = vec![0; piece_len.min(len as usize - all.len())];
                let count = log.read(0, all.len() as u32, &mut piece).unwrap();
                assert_eq!(count, piece.len());
                all.extend(piece);
            }
            assert_eq!(read(&all), (500, true));
        }
        assert_eq!(log.read(0, len, &mut [0; 5]), Some(0));
        assert_eq!(read(&std::fs::read(path).unwrap()), (2000, true));
    }

    /// A storage that loses power retains a part of the log: all complete chunks before the cut are
    /// read, wherever it is.
    #[test]
    fn a_log_cut_at_any_byte_is_read_up_to_its_last_complete_chunk() {
        let folder = tempfile::tempdir().unwrap();
        let recorder =
            Recorder::create(&folder.path().join("flight.mcap"), false, &LogHeader::default()).unwrap();
        let mut ends = Vec::new();
        for number in 0..40 {
            recorder.record(event(number), u64::from(number));
            if number % 5 == 4 {
                let before = recorder.marked_bytes();
                assert!(recorder.mark_soon());
                while recorder.marked_bytes() == before {
                    std::thread::yield_now();
                }
                ends.push((recorder.marked_bytes().unwrap() as usize, number as usize + 1));
            }
        }
        let bytes = std::fs::read(recorder.finish().unwrap()).unwrap();
        let first = ends[0].0.saturating_sub(3000);
        for cut in first..=bytes.len() {
            // A chunk is followed by its index, which a reader from front to back does not need.
            let before = ends.iter().rev().find(|(end, _)| *end <= cut).map_or(0, |(_, records)| *records);
            let next = ends.iter().find(|(end, _)| *end > cut).map_or(40, |(_, records)| *records);
            let found = read(&bytes[..cut]).0;
            assert!(found == before || found == next, "cut at {cut}: {found}, not {before} or {next}");
        }
    }
}
