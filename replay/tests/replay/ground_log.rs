//! Tests the log of a ground station, which has what was heard and nothing that the vehicle recorded.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::tlog::TlogReader;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::export::export_tables;
use replay::info::info;
use replay::log::{Clock, ClockTime, Entry, FlightLog, Recording, import_tlog};

use crate::simulated::{Simulated, WITH_FRAMES, tlog};

/// The station was started this long before the vehicle, ns.
const EARLIER_NS: u64 = 3_000_000_000;
const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;

/// The log that a station writes which hears every frame of a vehicle.
fn heard(flight: &Simulated) -> PathBuf {
    let imported = flight.beside("sent-ground.mcap");
    import_tlog(&tlog(flight, "sent-ground.tlog"), &imported).unwrap();
    let path = flight.beside("ground.mcap");
    let header =
        LogHeader { writer: "ground".to_owned(), start_unix_ns: START_UNIX_NS, ..LogHeader::default() };
    let mut log = LogWriter::new(std::fs::File::create(&path).unwrap(), &header).unwrap();
    let mut from = FlightLog::open(&imported).unwrap();
    let (mut first_ns, mut noted) = (None, false);
    while let Some(stamped) = from.next_entry().unwrap() {
        let since_ns = stamped.log_time_ns - *first_ns.get_or_insert(stamped.log_time_ns);
        let at_ns = EARLIER_NS + since_ns;
        let record = match stamped.entry {
            Entry::RawFrame => Record::RawFrame(RawFrame {
                direction: Direction::Rx,
                endpoint: "ground",
                link: "udpin:0.0.0.0:14550".to_owned(),
                bytes: stamped.data,
            }),
            Entry::Telemetry(mut telemetry) => {
                telemetry.time_s = at_ns as f64 / 1e9;
                Record::Telemetry(telemetry)
            }
            _ => continue,
        };
        log.write(&record, at_ns).unwrap();
        if !noted && since_ns > NOTED_NS {
            let (name, message) = ("ground".to_owned(), "note (screen 1, Ann): a gust".to_owned());
            log.write(&Record::Event(Event { level: EventLevel::Info, name, message }), at_ns).unwrap();
            noted = true;
        }
    }
    log.finish().unwrap();
    path
}

/// In the burn.
const NOTED_NS: u64 = 22_000_000_000;

static GROUND: LazyLock<PathBuf> = LazyLock::new(|| heard(&WITH_FRAMES));

/// A laptop at the field gets its time from the network when it has one, and a clock that nobody has set begins in 1970.
#[test]
fn a_clock_that_is_set_while_it_records_loses_no_frame() {
    let read = |path: &Path| {
        let mut frames = TlogReader::new(std::fs::File::open(path).unwrap());
        std::iter::from_fn(|| frames.next_frame().unwrap()).collect::<Vec<_>>()
    };
    let directory = tempfile::tempdir().unwrap();
    let plain = tlog(&WITH_FRAMES, "as-sent.tlog");
    let imported = |name: &str, path: &Path| import_tlog(path, &directory.path().join(name)).unwrap();
    let as_sent = imported("as-sent.mcap", &plain);
    let frames = read(&plain);
    let begins_us = frames[0].time_us;
    // What passes between two frames is lost with the clock: set it where the second follows at once.
    let half = (frames.len() / 3..2 * frames.len() / 3)
        .min_by_key(|number| frames[*number].time_us.abs_diff(frames[number - 1].time_us))
        .unwrap();
    let clocks: [fn(u64, u64) -> u64; 2] =
        [|time_us, _| time_us - 3_600_000_000, |time_us, begins_us| time_us - begins_us + 1];
    for (place, set) in clocks.into_iter().enumerate() {
        for first_half in [true, false] {
            if place == 0 && first_half {
                // An hour ahead is an hour of silence for all that anybody knows.
                continue;
            }
            let bytes = frames.iter().enumerate().flat_map(|(number, frame)| {
                let is_set = (number < half) == first_half;
                let time_us = if is_set { set(frame.time_us, begins_us) } else { frame.time_us };
                [&time_us.to_be_bytes(), &frame.bytes[..]].concat()
            });
            let path = directory.path().join("set.tlog");
            std::fs::write(&path, bytes.collect::<Vec<u8>>()).unwrap();
            let set = imported(&format!("set-{place}-{first_half}.mcap"), &path);
            assert_eq!((set.frames, set.garbage_bytes), (as_sent.frames, 0));
            // Its telemetry goes on: no silence, and no jump of an hour.
            assert!(set.telemetry.abs_diff(as_sent.telemetry) <= 2, "{set:?} {as_sent:?}");
            let lasts_s = |output: &Path| {
                let recording = Recording::open(output).unwrap();
                recording.telemetry.last().unwrap().time_s
            };
            let apart_s = lasts_s(&set.output) - lasts_s(&as_sent.output);
            assert!(apart_s.abs() < 1.0, "{apart_s}");
        }
    }
}

/// The verdict that was heard is the vehicle's own, to the precision of a message.
#[test]
fn a_ground_log_has_the_verdict_that_was_heard() {
    let (heard, own) = (info(&GROUND).unwrap(), info(&WITH_FRAMES.log).unwrap());
    let (verdict, recorded) = (heard.verdict.unwrap(), own.verdict.unwrap());
    assert_eq!((verdict.landing, verdict.clock), (recorded.landing, Clock::Boot));
    let boot = own.clocks.convert(recorded.contact(), Clock::Boot).unwrap();
    assert!((verdict.time_s - boot.time_s).abs() < 0.001, "{} {boot}", verdict.time_s);
    let limits = verdict.envelope.iter().zip(&recorded.envelope);
    for (heard, own) in limits {
        assert_eq!((&heard.name, &heard.unit, heard.passed), (&own.name, &own.unit, own.passed));
        assert!((heard.value - own.value).abs() < 1e-4, "{heard:?} {own:?}");
        assert!((heard.maximum - own.maximum).abs() < 1e-4, "{heard:?} {own:?}");
    }
    assert!(heard.phases.iter().any(|phases| phases.spans.len() > 3));
}

#[test]
fn the_report_of_a_ground_log_marks_the_touchdown_on_its_own_clock() {
    let recording = Recording::open(&GROUND).unwrap();
    let contact_s = recording.contact_s().unwrap();
    let own = info(&WITH_FRAMES.log).unwrap();
    let own_s = own.clocks.convert(own.verdict.unwrap().contact(), Clock::Boot).unwrap().time_s;
    assert!((contact_s - own_s - EARLIER_NS as f64 / 1e9).abs() < 0.2, "{contact_s} {own_s}");
    let page = replay::report::report(&GROUND).unwrap().html;
    assert!(page.contains("STANDS UNDAMAGED") && page.contains(">touchdown</text>"));
    // The crew's note stands in the pictures, too.
    assert!(page.matches(">a gust</text>").count() > 2);
}

#[test]
fn every_message_becomes_a_table_with_every_field() {
    let directory = WITH_FRAMES.beside("messages");
    let mut log = FlightLog::open(&GROUND).unwrap();
    let files = export_tables(&mut log, &directory).unwrap();
    let names: Vec<String> =
        files.iter().map(|file| file.path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    assert!(names.contains(&"mavlink_1_1_td_fins".to_owned()), "{names:?}");
    let text = std::fs::read_to_string(directory.join("mavlink_1_1_td_landing_verdict.csv")).unwrap();
    let head = text.lines().next().unwrap();
    assert_eq!(
        head,
        "log_time_ns,recorded_by,direction,link,frame_sequence,boot_number,time_boot_ms,contact_ms,distance_m,\
         vertical_m_s,lateral_m_s,tilt_rad,rate_rad_s,limits_violated,landing"
    );
    // As many rows as frames of the dialect.
    let frames: u64 = files
        .iter()
        .filter(|file| file.path.display().to_string().contains("mavlink_"))
        .map(|file| file.rows)
        .sum();
    let raw = info(&GROUND)
        .unwrap()
        .channels
        .iter()
        .find(|channel| channel.topic == "/mavlink/rx/raw")
        .unwrap()
        .messages;
    assert_eq!(frames, raw);
}

/// What the crew read as T+ is the T+ of the log, also before the landing motor is lit.
#[test]
fn the_crews_clock_is_the_clock_of_the_log() {
    let clocks = info(&WITH_FRAMES.log).unwrap().clocks;
    let directory = WITH_FRAMES.beside("clocks");
    let mut log = FlightLog::open(&WITH_FRAMES.log).unwrap();
    export_tables(&mut log, &directory).unwrap();
    let mut table = csv::Reader::from_path(directory.join("mavlink_1_1_td_flight_status.csv")).unwrap();
    let mut flown = 0;
    for row in table.deserialize() {
        let row: BTreeMap<String, String> = row.unwrap();
        let [boot_ms, countdown_ms]: [f64; 2] =
            ["time_boot_ms", "countdown_ms"].map(|name| row[name].parse().unwrap_or(f64::NAN));
        let boot = ClockTime { clock: Clock::Boot, time_s: boot_ms / 1e3 };
        let since_s = clocks.convert(boot, Clock::Flight).unwrap().time_s;
        // The clock that the crew reads stands still after touchdown.
        if 0.1 < since_s && since_s < 5.0 {
            assert!((since_s + countdown_ms / 1e3).abs() < 0.02, "{since_s} s, told {countdown_ms} ms");
            flown += 1;
        }
    }
    assert!(flown > 10, "{flown}");
}
