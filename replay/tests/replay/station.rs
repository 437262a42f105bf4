//! Writes the log of a ground station that receives every frame of a vehicle.

use std::fs::File;
use std::path::{Path, PathBuf};

use protocol::frame::Framer;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::writer::{LogHeader, LogWriter};
use protocol::reported::ReportedState;
use replay::log::{Entry, FlightLog};

/// The station was started this long before the first frame, records the vehicle's state so often,
/// and its crew notes something in the burn, ns.
pub(crate) const EARLIER_NS: u64 = 3_000_000_000;
const PERIOD_NS: u64 = 100_000_000;
const NOTED_NS: u64 = 25_000_000_000;

/// The station's log, beside the vehicle's own.
pub(crate) fn station_log(own: &Path, name: &str) -> PathBuf {
    station_log_with(own, name, |at_ns| at_ns)
}

/// The same of a station whose clock runs as `clock` says.
pub(crate) fn station_log_with(own: &Path, name: &str, clock: impl Fn(u64) -> u64) -> PathBuf {
    let path = own.with_file_name(name);
    let mut from = FlightLog::open(own).unwrap();
    let header = LogHeader {
        writer: "ground".to_owned(),
        start_unix_ns: 1_760_000_000_000_000_000,
        ..LogHeader::default()
    };
    let mut log = LogWriter::new(File::create(&path).unwrap(), &header).unwrap();
    let (mut told, mut due_ns, mut noted, mut first_ns) = (ReportedState::default(), 0, false, None);
    while let Some(stamped) = from.next_entry().unwrap() {
        if stamped.entry != Entry::RawFrame {
            continue;
        }
        let at_ns = clock(EARLIER_NS + stamped.log_time_ns - *first_ns.get_or_insert(stamped.log_time_ns));
        let mut framer = Framer::new();
        framer.push_datagram(&stamped.data);
        let message = framer.next_frame().unwrap().decode().unwrap();
        let raw = RawFrame {
            direction: Direction::Rx,
            endpoint: "ground",
            link: "udpin:0.0.0.0:14550".to_owned(),
            bytes: stamped.data,
        };
        log.write(&Record::RawFrame(raw), at_ns).unwrap();
        if told.update(&message) && at_ns >= due_ns {
            due_ns = at_ns + PERIOD_NS;
            log.write(&Record::Telemetry(Box::new(told.record(at_ns as f64 / 1e9))), at_ns).unwrap();
        }
        if at_ns > NOTED_NS && !noted {
            noted = true;
            let (name, message) = ("ground".to_owned(), "note (screen 1, Ann): a gust".to_owned());
            log.write(&Record::Event(Event { level: EventLevel::Info, name, message }), at_ns).unwrap();
        }
    }
    log.finish().unwrap();
    path
}
