//! Makes logs to export.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flight::guidance::controller::{ControlLevel, ControllerConfig, ControllerInput, ControllerState, step};
use flight::rules::phase::Phase;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use protocol::log::flight_v1;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::log::writer::{LogHeader, LogWriter};
use tick_log::{state_to_log, tick_to_log, verdict_to_log};

const PROFILE: &str = "paper-calibrated";
pub(crate) const START_UNIX_NS: u64 = 1_760_000_000_000_000_000;
pub(crate) const TICKS: u64 = 4;

/// A log of the first ticks of a landing; the plant is the controller's own model, recorded every 10 ms.
pub(crate) fn write_log(path: &Path, with_truth: bool) {
    let profile = vehicles::profile::builtin(PROFILE).unwrap();
    let config = ControllerConfig::from_profile(&profile);
    let model = profile.planar_model();
    let mut controller = ControllerState::new(&config);
    let mut plant = profile.start.planar_state();
    let header = LogHeader {
        writer: "test".to_owned(),
        start_unix_ns: START_UNIX_NS,
        run: BTreeMap::from([("start_unix_ns".to_owned(), START_UNIX_NS.to_string())]),
        profile_toml: vehicles::profile::builtin_toml(PROFILE).map(str::to_owned),
        ..LogHeader::default()
    };
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    let event = Event {
        level: EventLevel::Warning,
        name: "vehicle".to_owned(),
        message: "landing motor commanded to light".to_owned(),
    };
    log.write(&Record::Event(event), 0).unwrap();
    let mut held_rad = 0.0;
    for tick in 0..TICKS {
        let time_s = tick as f64 * config.sample_time_s();
        let input = ControllerInput {
            tick,
            time_s,
            phase: Phase::Powered,
            time_since_ignition_s: time_s,
            state: plant,
            gimbal_applied_rad: held_rad,
            thrust_scale: 1.0,
            degraded: false,
            lands_here: false,
            deadline_missed: false,
        };
        let output = step(&mut controller, &input);
        assert_eq!(output.level, ControlLevel::Converged);
        let record = Record::from(tick_to_log(&input, &output, controller.digest(), 0.003, 0.1));
        log.write(&record, nanoseconds(time_s)).unwrap();
        for centisecond in 0..10 {
            let truth = v1::PlantTruth {
                time_s: time_s + 0.01 * f64::from(centisecond),
                phase: u32::from(Phase::Powered.index()),
                state: state_to_log(&plant),
                gimbal_commanded_rad: held_rad,
                gimbal_actual_rad: held_rad,
                thrust_n: profile.motor.thrust_n,
                mass_kg: profile.vehicle.mass_kg,
                ..v1::PlantTruth::default()
            };
            let time_ns = nanoseconds(truth.time_s);
            if with_truth {
                log.write(&Record::PlantTruth(Box::new(truth)), time_ns).unwrap();
            }
            plant = model.rk4_step(&plant, held_rad, profile.motor.thrust_n, 0.01);
        }
        held_rad = output.gimbal_command_rad;
        log.flush().unwrap();
    }
    let judged = LandingVerdict::judge(&TouchdownLimits::from_profile(&profile), &plant);
    let verdict = verdict_to_log(0.4, &plant, &judged);
    log.write(&Record::LandingVerdict(Box::new(verdict)), nanoseconds(0.4)).unwrap();
    log.finish().unwrap();
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
    let (_, mission_toml) = vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == "mk2").unwrap();
    let header = LogHeader {
        writer: "test".to_owned(),
        start_unix_ns: START_UNIX_NS,
        profile_toml: Some((*mission_toml).to_owned()),
        ..LogHeader::default()
    };
    let mut log = LogWriter::new(std::fs::File::create(path).unwrap(), &header).unwrap();
    let half = f64::sqrt(0.5);
    for frame in 0..TICKS {
        let time_s = 0.5 * frame as f64;
        let mut tick = flight_v1::PilotTick::default();
        tick.input.frame = frame + 1;
        tick.input.time_s = time_s;
        tick.output.phase = u32::from(Phase::AeroDescent.index());
        log.write(&Record::PilotTick(Box::new(tick)), nanoseconds(time_s)).unwrap();
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
            pitch_rad: Some(std::f64::consts::FRAC_PI_2),
            control_level: Some(u32::from(ControlLevel::Converged.index())),
            ..v1::Telemetry::default()
        };
        log.write(&Record::Telemetry(Box::new(telemetry)), u64::from(second) * 1_000_000_000).unwrap();
    }
    log.finish().unwrap();
}
