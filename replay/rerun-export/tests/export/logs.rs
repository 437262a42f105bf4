//! Makes logs to export.

use std::path::{Path, PathBuf};

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::flight_v1;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::output::{Destination, Overwrite};
use sim::outside::Outside;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::wire::record::{LastFrame, frame_and_phase, header, start, time_ns};

pub(crate) const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;
pub(crate) const FRAMES: u64 = 4;
const FRAME_S: f64 = 0.005;

/// A log of the first frames of a flight from apogee, with a verdict as if it had come down then.
pub(crate) fn write_log(path: &Path, with_truth: bool) {
    let recipe = Recipe::built_in("mk2", "field").unwrap();
    let header = header("test", &recipe, 0, START_UNIX_NS);
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    let mut flight = Sortie::new(&recipe, 0).unwrap();
    log.write(&Record::ComputerStart(Box::new(start(&flight))), 0).unwrap();
    let mut last = LastFrame::default();
    let event = Event {
        level: EventLevel::Warning,
        name: "vehicle".to_owned(),
        message: "landing motor commanded to light".to_owned(),
    };
    log.write(&Record::Event(event), 0).unwrap();
    for _ in 0..FRAMES {
        flight.step_with(&Outside::NOBODY, &mut last);
        let phase = flight.computer().mode().phase;
        for record in frame_and_phase(&flight, &mut last, phase) {
            if with_truth || !matches!(record, Record::TruthSample(_)) {
                log.write(&record, time_ns(&flight)).unwrap();
            }
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
    log.write(&Record::LandingVerdict(Box::new(verdict)), nanoseconds(time_s)).unwrap();
    log.finish().unwrap();
}

/// A recording that may be replaced.
pub(crate) fn forced(path: &Path) -> Destination<'_> {
    Destination { path, overwrite: Overwrite::Always }
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

fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

/// A new directory with a log and its recording.
pub(crate) fn folder() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (log, rrd) = (folder.path().join("flight.mcap"), folder.path().join("flight.rrd"));
    (folder, log, rrd)
}

/// A log of a flight from apogee: 2 s of an upright fall, a frame every 0.5 s.
pub(crate) fn write_apogee_log(path: &Path) {
    let (_, mission_toml) =
        flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap();
    let header = LogHeader {
        writer: "test".to_owned(),
        start_unix_ns: START_UNIX_NS,
        profile_toml: Some((*mission_toml).to_owned()),
        ..LogHeader::default()
    };
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    let half = f64::sqrt(0.5);
    for number in 0..FRAMES {
        let time_s = 0.5 * number as f64;
        let mut frame = ComputerFrame::default();
        // Frames have 5 ms.
        frame.input.frame = (100 * number).max(1);
        frame.input.time_s = time_s;
        frame.output.phase = u32::from(Phase::AeroDescent.index());
        log.write(&Record::ComputerFrame(Box::new(frame)), nanoseconds(time_s)).unwrap();
        let truth = flight_v1::TruthSample {
            time_s,
            state: flight_v1::RigidState {
                position_m: flight_v1::Vector3 { x: 3.0, y: -4.0, z: 100.0 - 10.0 * time_s },
                velocity_m_s: flight_v1::Vector3 { x: 3.0, y: 4.0, z: -10.0 },
                world_from_body: flight_v1::Quaternion { w: half, x: 0.0, y: -half, z: 0.0 },
                ..flight_v1::RigidState::default()
            },
            height_m: 99.0 - 10.0 * time_s,
            mass_kg: 3.0,
            gimbal_commanded_rad: vec![0.01, -0.02],
            gimbal_actual_rad: vec![0.01, -0.02],
            fins_commanded_rad: vec![1.0; 4],
            fins_actual_rad: vec![1.0; 4],
            ..flight_v1::TruthSample::default()
        };
        log.write(&Record::TruthSample(Box::new(truth)), nanoseconds(time_s)).unwrap();
    }
    log.finish().unwrap();
}

/// A log as a ground station writes it.
pub(crate) fn write_telemetry_log(path: &Path) {
    let header =
        LogHeader { writer: "test".to_owned(), start_unix_ns: START_UNIX_NS, ..LogHeader::default() };
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    for second in 0..3_u32 {
        let telemetry = v1::Telemetry {
            time_s: f64::from(second),
            phase: Some(u32::from(Phase::Powered.index())),
            // No pose has been received in the first second.
            altitude_m: (second > 0).then_some(15.0),
            tilt_rad: Some(0.0),
            control_level: Some(u32::from(ControlLevel::Converged.index())),
            ..v1::Telemetry::default()
        };
        log.write(&Record::Telemetry(Box::new(telemetry)), u64::from(second) * 1_000_000_000).unwrap();
    }
    log.finish().unwrap();
}
