//! Tests comparisons and exports of simulated flights.

use std::path::Path;

use replay::compare::{Align, Flown, compare};
use replay::export::export_tables;
use replay::log::FlightLog;
use replay::refly::{ReflyOptions, refly_flight, write_log};

use crate::simulated::{MK2, Simulated};

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
fn a_constructed_difference_has_its_rms_its_maximum_and_its_time() {
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
