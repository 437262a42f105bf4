//! Tests logs of the flight computer from apogee: its frames are executed again, across restarts, bit for bit.

use std::io::{Cursor, Read as _, Seek as _};
use std::sync::LazyLock;

use avionics::log::frame::frame_to_log;
use avionics::log::logged::Logged as _;
use flight::computer::{Computer, Input, KeptInput, LogState};
use flight::estimation::estimator::{ImuSample, Measurements};
use flight::rules::arming::Uplink;
use flight::vehicle::rigid::RigidState;
use nalgebra::{UnitQuaternion, Vector3};
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::record::Record;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::info::{GradeLevel, Info, info_of};
use replay::log::FlightLog;
use replay::verify::{Obstacle, Verification};

use crate::flown::verify_bytes;

const MISSION: &str = "mk2";
const FRAME_NS: u64 = 5_000_000;
/// The computer is dead in these frames.
const DEAD: std::ops::RangeInclusive<u64> = 120..=131;

struct Fall {
    start: ComputerStart,
    frames: Vec<ComputerFrame>,
}

fn mission_toml() -> &'static str {
    let (_, text) = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == MISSION).unwrap();
    text
}

/// Two seconds of free fall with sensors that measure nothing, and a restart on the way.
static FALL: LazyLock<Fall> = LazyLock::new(|| {
    let mission = flight::vehicles::mission::from_toml(mission_toml(), "test").unwrap();
    let believed = RigidState {
        position_m: Vector3::new(0.0, 0.0, 120.0),
        velocity_m_s: Vector3::new(2.0, 0.0, 0.0),
        world_from_body: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -1.2),
        rate_rad_s: Vector3::zeros(),
    };
    let mut computer = Computer::at_power_up(&mission, &believed).released(0);
    let mut frames = Vec::new();
    for frame in (1..=400_u64).filter(|frame| !DEAD.contains(frame)) {
        if frame == DEAD.end() + 1 {
            computer.restart((frame - 1) as f64 * 5.0 * 1e-3);
        }
        let time_s = frame as f64 * 5.0 * 1e-3;
        let imu = ImuSample {
            gyro_rad_s: Vector3::new(0.0, 0.01, 0.0),
            specific_force_m_s2: Vector3::new(0.02 * time_s, 0.0, 0.01),
        };
        let falling_m = believed.position_m.z - 0.5 * 9.81 * time_s * time_s;
        let measured = Measurements {
            pressure_altitude_m: frame.is_multiple_of(4).then_some(falling_m),
            ..Measurements::of_imu(imu)
        };
        let kept = KeptInput {
            frame,
            time_s,
            measured,
            gimbal_rad: [0.0; 2],
            fins_rad: [0.3; 4],
            contact: false,
            igniter_continuity: true,
            booster_attached: false,
            pin_out: true,
            battery_v: None,
            log: LogState { running: true, space_bytes: u64::MAX },
            uplink: Uplink::NotNeeded,
            commander: None,
            people: None,
        };
        let input = Input { kept, requests: &[], rehearsed: None, plan_ready: frame % 10 == 5 };
        let output = computer.step(&input);
        frames.push(frame_to_log(&input, &output, &computer, false));
    }
    let start = ComputerStart {
        frame: 0,
        released: true,
        believed: believed.to_log(),
        gyro_bias_rad_s: None,
        rail_m: None,
        aborted_before_s: None,
    };
    Fall { start, frames }
});

fn write(start: Option<&ComputerStart>, frames: &[ComputerFrame], profile_toml: Option<&str>) -> Vec<u8> {
    let header = LogHeader { profile_toml: profile_toml.map(str::to_owned), ..LogHeader::default() };
    let mut writer = LogWriter::new(Cursor::new(Vec::new()), &header).unwrap();
    if let Some(start) = start {
        writer.write(&Record::ComputerStart(Box::new(*start)), 0).unwrap();
    }
    for frame in frames {
        writer.write(&Record::ComputerFrame(Box::new(frame.clone())), frame.input.frame * FRAME_NS).unwrap();
    }
    let mut written = writer.finish().unwrap();
    let mut bytes = Vec::new();
    written.rewind().unwrap();
    written.read_to_end(&mut bytes).unwrap();
    bytes
}

fn described(bytes: &[u8]) -> Info {
    info_of(&mut FlightLog::read("test.mcap".to_owned(), bytes).unwrap(), || None).unwrap()
}

#[test]
fn frames_are_identical_over_a_restart() {
    let bytes = write(Some(&FALL.start), &FALL.frames, Some(mission_toml()));
    let report = verify_bytes(&bytes).unwrap();
    // Everything recorded was read, but the vehicle was still falling.
    assert_eq!((report.outcome, report.obstacle), (Verification::IdenticalReadablePart, None));
    assert!((report.cut.unwrap().time_s - 2.0).abs() < 1e-9);
    assert_eq!(report.frames_identical, FALL.frames.len() as u64);
    assert_eq!(report.span, Some((1, 400)));
    let info = described(&bytes);
    assert_eq!(info.grade.level, GradeLevel::BitExact, "{}", info.grade.reason);
    assert_eq!(info.profile.unwrap().name.as_deref(), Some(MISSION));
    let frames = info.frames.unwrap();
    assert_eq!((frames.first, frames.last, frames.restarts, frames.lost, frames.start), (1, 400, 1, 0, true));
    assert!(!info.phases.is_empty());
}

#[test]
fn one_changed_bit_is_found_at_its_frame() {
    let mut frames = FALL.frames.clone();
    let place = frames.iter().position(|frame| frame.input.frame == 200).unwrap();
    let command_rad = &mut frames[place].output.fins_rad[2];
    *command_rad = f64::from_bits(command_rad.to_bits() ^ 1);
    let report = verify_bytes(&write(Some(&FALL.start), &frames, Some(mission_toml()))).unwrap();
    assert_eq!((report.outcome, report.frames_different), (Verification::Diverged, 1));
    let first = report.first_divergence.unwrap();
    assert_eq!((first.frame, first.fields_different), (200, 1));
    assert_eq!(first.fields[0].path, "output.fins_rad[2]");
    assert_eq!(first.fields[0].ulps, Some(1));
    // A lost frame looks like a restart, and everything after it differs.
    let mut lost = FALL.frames.clone();
    lost.remove(50);
    let report = verify_bytes(&write(Some(&FALL.start), &lost, Some(mission_toml()))).unwrap();
    assert_eq!(report.outcome, Verification::Diverged);
    assert_eq!(report.first_divergence.unwrap().frame, 52);
}

#[test]
fn a_missing_record_is_named_in_the_report() {
    let refused = |bytes: Vec<u8>| {
        let report = verify_bytes(&bytes).unwrap();
        assert_eq!(report.outcome, Verification::NotReplayable);
        report.obstacle.unwrap()
    };
    assert_eq!(refused(write(None, &FALL.frames, Some(mission_toml()))), Obstacle::NoStart);
    assert_eq!(refused(write(Some(&FALL.start), &FALL.frames, None)), Obstacle::NoProfile);
    let other = Some("name = \"x\"\n");
    let reason = refused(write(Some(&FALL.start), &FALL.frames, other));
    assert!(matches!(reason, Obstacle::ProfileUnreadable(_)), "{reason}");
    let mut twice = FALL.frames.clone();
    twice.push(twice[twice.len() - 1].clone());
    let reason = refused(write(Some(&FALL.start), &twice, Some(mission_toml()))).to_string();
    assert!(reason.contains("frame 400 comes after frame 400"), "{reason}");
    let info = described(&write(None, &FALL.frames, Some(mission_toml())));
    assert_eq!(info.grade.level, GradeLevel::Numeric);
}
