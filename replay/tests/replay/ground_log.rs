//! Tests the log of a ground station, which has received messages and no records of the vehicle.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::LazyLock;

use replay::export::export_tables;
use replay::info::{GradeLevel, info};
use replay::log::{Clock, ClockTime, FlightLog, Recording};
use replay::verify::{Verification, verify};

use crate::simulated::WITH_FRAMES;
use crate::station::{EARLIER_NS, station_log};

static GROUND: LazyLock<PathBuf> = LazyLock::new(|| station_log(&WITH_FRAMES.log, "ground.mcap"));

/// The received verdict is that of the vehicle, to the precision of a message.
#[test]
fn a_ground_log_has_the_received_verdict() {
    let (received, flown) = (info(&GROUND).unwrap(), info(&WITH_FRAMES.log).unwrap());
    let (verdict, recorded) = (received.verdict.unwrap(), flown.verdict.unwrap());
    assert_eq!((verdict.landing, verdict.clock), (recorded.landing, Clock::Boot));
    let boot = flown.clocks.convert(recorded.contact(), Clock::Boot).unwrap();
    assert!((verdict.time_s - boot.time_s).abs() < 0.001, "{} {boot}", verdict.time_s);
    let limits = verdict.envelope.iter().zip(&recorded.envelope);
    for (received, recorded) in limits {
        assert_eq!(
            (&received.name, &received.unit, received.passed),
            (&recorded.name, &recorded.unit, recorded.passed)
        );
        assert!((received.value - recorded.value).abs() < 1e-4, "{received:?} {recorded:?}");
        assert!((received.maximum - recorded.maximum).abs() < 1e-4, "{received:?} {recorded:?}");
    }
    assert!(received.phases.iter().any(|phases| phases.spans.len() > 3));
    assert_eq!(received.grade.level, GradeLevel::TelemetryOnly);
    assert_eq!(verify(&GROUND).unwrap()[0].outcome, Verification::NotReplayable);
}

#[test]
fn the_report_of_a_ground_log_marks_the_touchdown_on_the_clock_of_the_log() {
    let recording = Recording::open(&GROUND).unwrap();
    let contact_s = recording.contact_s().unwrap();
    let flown = info(&WITH_FRAMES.log).unwrap();
    let own_s = flown.clocks.convert(flown.verdict.unwrap().contact(), Clock::Boot).unwrap().time_s;
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

/// What the crew read as T+ is the T+ of the log, also before the landing motor is ignited.
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
            assert!((since_s + countdown_ms / 1e3).abs() < 0.02, "{since_s} s, reported {countdown_ms} ms");
            flown += 1;
        }
    }
    assert!(flown > 10, "{flown}");
}
