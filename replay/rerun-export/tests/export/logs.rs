//! Makes logs to export.

use std::path::{Path, PathBuf};

use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::LogWriter;
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::wire::record::{LastFrame, frame_and_phase, header, start, time_ns};

pub(crate) const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;
pub(crate) const FRAMES: u64 = 4;
const FRAME_S: f64 = 0.005;

/// A log of the first frames of a flight from apogee, with a verdict as if it had come down then.
pub(crate) fn write_log(path: &Path) {
    write_log_from(path, START_UNIX_NS);
}

/// The same from another time on.
pub(crate) fn write_log_from(path: &Path, start_unix_ns: u64) {
    let recipe = Recipe::built_in("mk2", "field").unwrap();
    let header = header("test", &recipe, 0, start_unix_ns);
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    let mut flight = Sortie::new(&recipe, 0).unwrap();
    log.write(&Record::ComputerStart(Box::new(start(flight.computer()))), 0).unwrap();
    let mut last = LastFrame::default();
    let (name, message) = ("vehicle".to_owned(), "landing motor commanded to light".to_owned());
    log.write(&Record::Event(Event { level: EventLevel::Warning, name, message }), 0).unwrap();
    for _ in 0..FRAMES {
        flight.step_with(&Outside::NOBODY, &mut last);
        let phase = flight.computer().mode().phase;
        for record in frame_and_phase(&flight, &mut last, phase) {
            log.write(&record, time_ns(&flight)).unwrap();
        }
        log.flush().unwrap();
    }
    let limit = v1::LimitResult {
        name: "vertical speed".to_owned(),
        value: -0.2,
        minimum: -0.4,
        maximum: 0.4,
        unit: "m/s".to_owned(),
        passed: true,
    };
    let time_s = FRAMES as f64 * FRAME_S;
    let landing = v1::Landing { stands: true, upright: true, envelope: true, table_2: true };
    let (envelope, table_2) = (vec![limit.clone()], vec![limit]);
    let verdict = v1::LandingVerdict { time_s, landing, envelope, table_2, ..Default::default() };
    log.write(&Record::LandingVerdict(Box::new(verdict)), time_ns(&flight)).unwrap();
    log.finish().unwrap();
}

/// Makes way for another recording.
pub(crate) fn cleared(path: &Path) -> &Path {
    let _ = std::fs::remove_file(path);
    path
}

/// A place in a log's third chunk, where it may be cut.
pub(crate) fn in_the_third_chunk(log: &[u8]) -> usize {
    const MAGIC_BYTES: usize = 8;
    const CHUNK: u8 = 6;
    let (mut at, mut chunks) = (MAGIC_BYTES, 0);
    loop {
        let length = u64::from_le_bytes(log[at + 1..at + 9].try_into().unwrap()) as usize;
        chunks += usize::from(log[at] == CHUNK);
        if chunks == 3 {
            return at + length / 2;
        }
        at += 9 + length;
    }
}

/// A new directory with a log and its recording.
pub(crate) fn folder() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (log, rrd) = (folder.path().join("flight.mcap"), folder.path().join("flight.rrd"));
    (folder, log, rrd)
}
