//! Tests comparisons, exports and imports of simulated flights.

use std::path::Path;

use proptest::prelude::*;
use replay::compare::{Align, Flown, compare};
use replay::export::export_tables;
use replay::info::{GradeLevel, info};
use replay::log::{FlightLog, ImportError, Recording, import_tlog};
use replay::refly::{ReflyOptions, refly_flight, write_log};
use replay::verify::{Verification, verify};

use crate::command_line::{replay, run};
use crate::simulated::{MK2, Simulated, WITH_FRAMES, tlog};

fn read_text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

fn flown(flight: &Simulated) -> Flown {
    Flown::open(&flight.log).unwrap()
}

/// Shifted in time, it is the same flight.
#[test]
fn a_flight_equals_itself_in_every_signal() {
    let a = flown(&MK2);
    let mut b = a.clone();
    for shift_s in [0.0, 3.0] {
        for series in b.signals.values_mut() {
            series.times_s.iter_mut().for_each(|time_s| *time_s += shift_s);
        }
        b.ignition_s = b.ignition_s.map(|at_s| at_s + shift_s);
        let found = compare(&a, &b);
        assert!(found.align == Align::Ignition && (found.shift_s + shift_s).abs() < 1e-9, "{found:?}");
        assert!(found.failures.is_empty() && found.missing.is_empty() && found.added.is_empty());
        assert!(found.signals.len() > 50 && found.signals.iter().all(|signal| signal.samples > 0));
        assert!(found.signals.iter().all(|signal| signal.max < 1e-6), "{found:?}");
    }
    b.ignition_s = None;
    let found = compare(&a, &b);
    assert_eq!(found.align, Align::Time);
    assert!(found.identical() < found.signals.len());
}

#[test]
fn a_known_difference_has_its_rms_its_maximum_and_its_time() {
    let a = flown(&MK2);
    let mut b = a.clone();
    let name = "vehicle_truth3d.state.position_m.x";
    let series = b.signals.get_mut(name).unwrap();
    series.values.iter_mut().for_each(|value| *value += 0.5);
    series.values[100] += 1.5;
    let at_s = series.times_s[100];
    b.signals.remove("vehicle_truth3d.mass_kg");
    b.signals.insert("new.signal".to_owned(), replay::compare::Series::default());
    let found = compare(&a, &b);
    assert_eq!(found.failures, ["1 signal missing", "1 signal added"]);
    assert_eq!(
        (found.missing.as_slice(), found.added.as_slice()),
        (&["vehicle_truth3d.mass_kg".to_owned()][..], &["new.signal".to_owned()][..])
    );
    let signal = found.signals.iter().find(|signal| signal.signal == name).unwrap();
    let count = signal.samples as f64;
    let rms = (((count - 1.0) * 0.25 + 4.0) / count).sqrt();
    assert!((signal.rms - rms).abs() < 1e-12 && (signal.max - 2.0).abs() < 1e-12, "{signal:?}");
    assert_eq!(signal.max_at_s, Some(at_s));
}

#[test]
fn flights_with_different_verdicts_are_not_alike() {
    let recording = MK2.recording();
    let options = ReflyOptions {
        plant_settings: vec!["truth.impulse_scale=0.7".parse().unwrap()],
        ..ReflyOptions::default()
    };
    let (_, flight) = refly_flight(&recording, &options).unwrap();
    let path = MK2.beside("weak.mcap");
    write_log(&path, &recording, &flight).unwrap();
    let (a, b) = (flown(&MK2), Flown::open(&path).unwrap());
    let found = compare(&a, &b);
    assert!(found.failures.contains(&"the verdicts differ: stands undamaged and not landed".to_owned()));
    // The weak motor's flight has another length.
    assert!(found.signals.iter().any(|signal| signal.samples_of[0] != signal.samples_of[1]));
}

fn export(flight: &Simulated, name: &str) -> std::path::PathBuf {
    let directory = flight.beside(name);
    let mut log = FlightLog::open(&flight.log).unwrap();
    export_tables(&mut log, &directory).unwrap();
    directory
}

/// Every number of the CSV reads back as the recorded one.
#[test]
fn the_csv_holds_the_recorded_numbers_bit_for_bit() {
    let directory = export(&MK2, "csv");
    let text = read_text(&directory.join("computer_frame.csv"));
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|known| *known == name).unwrap();
    let (gimbal, gyro, fin) = (
        column("output.gimbal_2_rad"),
        column("input.measured.imu.gyro_rad_s.x"),
        column("output.fins_4_rad"),
    );
    let recording = MK2.recording();
    // Frames outside the flight have no flight time, the last column.
    let lines = lines.filter(|line| !line.ends_with(','));
    let mut count = 0;
    for (line, frame) in lines.zip(&recording.frames) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), names.len());
        let number = |place: usize| cells[place].parse::<f64>().unwrap().to_bits();
        assert_eq!(number(gimbal), frame.output.gimbal_rad[1].to_bits());
        assert_eq!(number(gyro), frame.input.measured.imu.gyro_rad_s.x.to_bits());
        assert_eq!(number(fin), frame.output.fins_rad[3].to_bits());
        count += 1;
    }
    assert_eq!(count, recording.frames.len());
    assert!(read_text(&directory.join("events.csv")).lines().count() > 1);
    // A head, the four limits of the envelope, what the legs bore, and the six of Table 2.
    assert_eq!(read_text(&directory.join("verdict_limits.csv")).lines().count(), 1 + 4 + 2 + 6);
}

/// The same frames as in the log, and the telemetry that a ground station would have had.
#[test]
fn a_tlog_comes_in() {
    let path = tlog(&WITH_FRAMES, "out.tlog");
    let imported_path = WITH_FRAMES.beside("imported.mcap");
    let imported = import_tlog(&path, &imported_path).unwrap();
    assert!(imported.frames > 100 && imported.telemetry > 20, "{imported:?}");
    assert_eq!((imported.not_understood, imported.mavlink1, imported.garbage_bytes), (0, 0, 0));
    let facts = info(&imported_path).unwrap();
    assert_eq!(facts.grade.level, GradeLevel::TelemetryOnly);
    let (then, now) = (Recording::open(&WITH_FRAMES.log).unwrap(), Recording::open(&imported_path).unwrap());
    let (then, now) = (then.verdict.unwrap(), now.verdict.unwrap());
    assert_eq!((then.landing, then.envelope.len()), (now.landing, now.envelope.len()));
    for (a, b) in then.envelope.iter().zip(&now.envelope) {
        // Single precision over the air.
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-5 * (1.0 + x.abs());
        assert!(a.name == b.name && near(a.value, b.value) && near(a.maximum, b.maximum), "{a:?} {b:?}");
    }
    assert_eq!(verify(&imported_path).unwrap()[0].outcome, Verification::NotReplayable);
    // A file that exists is kept.
    assert_ne!(import_tlog(&path, &imported_path).unwrap().output, imported_path);
}

/// Every command reads a `.tlog` as it reads the log made of it.
#[test]
fn a_tlog_is_read_like_the_log_made_of_it() {
    let named_otherwise = WITH_FRAMES.beside("telemetry.bin");
    std::fs::copy(tlog(&WITH_FRAMES, "read.tlog"), &named_otherwise).unwrap();
    let imported = WITH_FRAMES.beside("read.mcap");
    import_tlog(&named_otherwise, &imported).unwrap();
    // Only their names and sizes differ.
    let of_the_file = |line: &&str| line.contains("imported_from") || line.contains(" kB");
    let answer = |command: &str, log: &Path| {
        let (code, said, error) = run(&mut replay(command, log));
        let lines = said.lines().filter(|line| !of_the_file(line));
        (code, lines.collect::<Vec<_>>().join("\n"), error.replace(log.to_str().unwrap(), "LOG"))
    };
    for command in ["info", "evaluate"] {
        assert_eq!(answer(command, &named_otherwise), answer(command, &imported), "{command}");
    }
    let rows = |log: &Path, name: &str| {
        let directory = WITH_FRAMES.beside(name);
        export_tables(&mut FlightLog::open(log).unwrap(), &directory).unwrap();
        read_text(&directory.join("telemetry.csv"))
    };
    assert_eq!(rows(&named_otherwise, "of-tlog"), rows(&imported, "of-mcap"));
    let (code, _, error) = run(replay("recover", &named_otherwise).arg(WITH_FRAMES.beside("none.mcap")));
    assert!(code == 1 && error.contains("is a .tlog"), "{error}");
}

/// What some programs save of a link: one frame after the other.
#[test]
fn frames_without_times_are_refused_as_what_they_are() {
    let clean = std::fs::read(tlog(&WITH_FRAMES, "timed.tlog")).unwrap();
    let (mut frames, mut reader) = (Vec::new(), protocol::log::tlog::TlogReader::new(clean.as_slice()));
    while let Some(frame) = reader.next_frame().unwrap() {
        frames.extend(frame.bytes);
    }
    let (raw, log) = (WITH_FRAMES.beside("raw.tlog"), WITH_FRAMES.beside("raw.mcap"));
    let log_name = log.to_str().unwrap();
    // As a whole, and from the middle of a frame on.
    for begin in [0, 5] {
        std::fs::write(&raw, &frames[begin..]).unwrap();
        for question in [
            &["export", "--to", "mcap", "--out", log_name][..],
            &["export"],
            &["export", "--to", "csv", "--out", log_name],
            &["info"],
            &["verify"],
            &["report", "--out", log_name],
        ] {
            let (code, stdout, stderr) = run(replay(question[0], &raw).args(&question[1..]));
            assert_eq!((code, stdout.as_str(), log.exists()), (1, "", false), "{question:?}: {stderr}");
            assert!(stderr.contains("a raw stream of MAVLink frames"), "{question:?}: {stderr}");
        }
        assert_eq!(run(replay("recover", &raw).arg(&log)).0, 1);
    }
}

#[test]
fn a_tlog_is_found_between_garbage() {
    let clean = std::fs::read(tlog(&WITH_FRAMES, "clean.tlog")).unwrap();
    let mut dirty = vec![0x00, 0xfd, 0x11];
    dirty.extend(&clean);
    dirty.extend([0xfd; 5]);
    let path = WITH_FRAMES.beside("dirty.tlog");
    std::fs::write(&path, dirty).unwrap();
    let imported = import_tlog(&path, &WITH_FRAMES.beside("dirty.mcap")).unwrap();
    assert_eq!((imported.not_understood, imported.garbage_bytes), (0, 8));
    std::fs::write(&path, b"no frames here at all, only text").unwrap();
    let refused = import_tlog(&path, &WITH_FRAMES.beside("none.mcap")).unwrap_err();
    assert!(matches!(refused, ImportError::NoFrames { .. }));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_no_tlog(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let directory = tempfile::tempdir().unwrap();
        let (input, output) = (directory.path().join("in.tlog"), directory.path().join("out.mcap"));
        std::fs::write(&input, &bytes).unwrap();
        if let Ok(imported) = import_tlog(&input, &output) {
            prop_assert!(imported.frames > 0);
            prop_assert!(info(&output).is_ok());
        }
    }
}
