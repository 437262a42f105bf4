//! Tests every what-if question on a whole flight from apogee, as logged by a campaign.

use flight::rules::phase::Phase;
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::record::Record;
use replay::controller::AgainError;
use replay::evaluate::evaluate;
use replay::log::{Clock, ClockTime, Moment, Recording};
use replay::refly::{ReflyOptions, refly, refly_flight, write_log};
use replay::verify::explain::explain;
use replay::verify::{Verification, verify};

use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::settings::{settings, with, with_plant};
use crate::tampered::Held;

fn recording() -> Recording {
    Recording::open(&LANDED.log).unwrap()
}

#[test]
fn timed_settings_change_the_commands_from_their_time_on() {
    let recording = recording();
    let ignited_s = evaluate(&recording, &[]).unwrap().phases;
    let entered =
        |name: &str| ignited_s.iter().find(|phase| phase.phase == name).unwrap().recorded_s.unwrap();
    let from_s = entered("POWERED") + 1.0;
    let setting = format!("powered.weights.theta=300@{from_s:?}");
    let report = evaluate(&recording, &settings(&[&setting])).unwrap();
    assert!(report.commands_different > 100, "{}", report.commands_different);
    assert!(report.frames.iter().all(|frame| frame.time_s >= from_s || frame.recorded == frame.evaluated));
    // Another place in the band moves the ignition and nothing before it.
    let report = evaluate(&recording, &settings(&["ignition.place=0.55"])).unwrap();
    let ignition = report.phases.iter().find(|phase| phase.phase == "IGNITION").unwrap();
    assert!(ignition.evaluated_s.unwrap() < ignition.recorded_s.unwrap(), "{ignition:?}");
    // The estimator's settings can be changed from the beginning only, not in flight.
    let report = evaluate(&recording, &settings(&["estimator.barometer_offset_walk_m_sqrt_s=1.0"])).unwrap();
    assert!(report.fins_difference_max_rad > 0.0);
}

#[test]
fn a_setting_that_the_flight_computer_does_not_have_is_refused() {
    let recording = recording();
    let refused = |given| evaluate(&recording, &settings(&[given])).unwrap_err();
    for given in
        ["leg_limits.tilt_deg=3.0", "truth.wind_m_s=3.0", "estimator.frame_s=0.01", "estimator.frame=1@3"]
    {
        assert!(matches!(refused(given), AgainError::Refused { of, .. } if of == given));
    }
}

/// Flown again from frames before and during the burn, it is the recorded flight bit for bit.
#[test]
fn without_changes_the_flight_is_the_same_bit_for_bit() {
    let recording = recording();
    let starts = [
        None,
        Some(Moment::Frame(1)),
        Some(Moment::Time(ClockTime { clock: Clock::Flight, time_s: 5.0 })),
        Some(Moment::Phase(Phase::AeroDescent)),
        Some(Moment::Phase(Phase::Powered)),
    ];
    for start in starts {
        let (report, flown) =
            refly_flight(&recording, &ReflyOptions { start, ..ReflyOptions::default() }).unwrap();
        assert!(report.kind.starts_with("closed loop"));
        let reached = report.reached;
        assert_eq!((reached.identical, reached.first_different), (reached.frames, None), "{start:?}");
        assert_eq!(report.commands_identical, report.frames, "{start:?}");
        assert_eq!(reached.frames + report.frames, recording.frames.len(), "{start:?}");
        assert_eq!(report.reflown, recording.verdict, "{start:?}");
        assert_eq!(report.verdict_changed, Some(false));
        let again = flown.records.iter().filter_map(|(_, record)| match record {
            Record::ComputerFrame(frame) => Some(frame.as_ref()),
            _ => None,
        });
        assert!(again.eq(&recording.frames), "{start:?}");
    }
}

#[test]
fn another_wind_and_motor_change_the_verdict() {
    let recording = recording();
    let report = refly(&recording, &with_plant(&["truth.impulse_scale=0.7"])).unwrap();
    assert_eq!((report.verdict_changed, report.thrust_scale.to_bits()), (Some(true), 0.7_f64.to_bits()));
    assert!(report.margin.unwrap() < 0.0);
    // Wind and motor change from the burn on; the controller knows of neither.
    for given in ["truth.wind_m_s=14", "airframe.motor=G33"] {
        let options = ReflyOptions { start: Some(Moment::Phase(Phase::Powered)), ..with_plant(&[given]) };
        let report = refly(&recording, &options).unwrap();
        assert_eq!(report.reached.first_different, None);
        assert!(report.commands_identical < report.frames, "{given}");
    }
}

#[test]
fn a_flight_that_cannot_be_flown_again_is_refused_with_the_reason() {
    let mut recording = recording();
    let at = |start| ReflyOptions { start: Some(start), ..ReflyOptions::default() };
    let late = ClockTime { clock: Clock::Flight, time_s: 1e6 };
    for (options, reason) in [
        (at(Moment::Frame(99_999)), "no frame 99999; there are 1 to"),
        (at(Moment::Time(late)), "the last is at"),
        (at(Moment::Phase(Phase::Chute)), "no frame in phase CHUTE"),
        (with(&["powered.gimball_deg=3"]), "`powered.gimbal_deg`"),
        (with_plant(&["truth.wind=3"]), "`truth.wind_m_s`"),
        (with_plant(&["truth.wind_m_s=3@4"]), "from the beginning"),
        (with_plant(&["truth.wind_m_s=99"]), "0 to 60 is accepted"),
        (with_plant(&["powered.gimbal_deg=3"]), "everything else is the controller's"),
        (with(&["truth.wind_m_s=3"]), "belongs to the plant alone"),
        (with(&["estimator.frame_s=1.0"]), "evaluate"),
    ] {
        let refused = refly(&recording, &options).unwrap_err().to_string();
        assert!(refused.contains(reason), "{reason}: {refused}");
    }
    let landing = |frame: &ComputerFrame| frame.output.phase > u32::from(Phase::AeroDescent.index());
    let mut falling = recording.clone();
    falling.frames.truncate(recording.frames.iter().position(landing).unwrap());
    recording.head.run.remove("flight");
    for (recording, reason) in [(falling, "names another moment"), (recording, "no number `flight`")] {
        let refused = refly(&recording, &ReflyOptions::default()).unwrap_err().to_string();
        assert!(refused.contains(reason), "{reason}: {refused}");
    }
}

/// A log that this build's world would not produce: the forged frame is named, and the flight is
/// still flown on.
#[test]
fn a_difference_before_the_start_is_reported() {
    let mut recording = recording();
    recording.frames[99].state_digest ^= 1;
    let report = refly(&recording, &ReflyOptions::default()).unwrap();
    let reached = report.reached;
    assert_eq!((reached.first_different, reached.frames - reached.identical), (Some(100), 1));
}

#[test]
fn a_flight_flown_again_is_a_log_that_verifies() {
    let recording = recording();
    for (name, options) in [
        ("same.mcap", ReflyOptions::default()),
        ("weights.mcap", with(&["powered.weights.theta=200", "powered.gimbal_deg=4.0@9"])),
        ("weak.mcap", with_plant(&["truth.impulse_scale=0.9"])),
        (
            "early.mcap",
            ReflyOptions { start: Some(Moment::Frame(1)), ..with(&["ignition.fixed_height_m=40.0"]) },
        ),
    ] {
        let (report, flown) = refly_flight(&recording, &options).unwrap();
        let path = LANDED.beside(name);
        write_log(&path, &recording, &flown).unwrap();
        let verified = only(verify(&path).unwrap());
        assert_eq!((verified.outcome, verified.first_divergence), (Verification::Identical, None), "{name}");
        let again = Recording::open(&path).unwrap();
        assert_eq!(again.verdict, report.reflown, "{name}");
        assert!(evaluate(&again, &[]).unwrap().commands_different == 0, "{name}");
        assert!(matches!(refly(&again, &ReflyOptions::default()), Err(AgainError::Refused { .. })), "{name}");
    }
}

/// Every planning frame, solved again: the same landing, and the warm start needs fewer iterations.
#[test]
fn every_plan_solved_again_is_the_flown_one() {
    let recording = recording();
    let (mut plans, mut warm_iterations, mut cold_iterations) = (0, 0, 0);
    let powered: Vec<u64> = recording
        .frames
        .iter()
        .filter(|frame| frame.output.phase == u32::from(Phase::Powered.index()))
        .filter(|frame| frame.input.plan_ready)
        .map(|frame| frame.input.frame)
        .step_by(4)
        .collect();
    for frame in powered {
        let report = explain(&recording, frame).unwrap();
        assert!(report.identical, "frame {frame}");
        let Some(judged) = report.judged else { continue };
        plans += 1;
        warm_iterations += judged.flown.iterations;
        cold_iterations += judged.cold_iterations;
        assert!(report.path.len() > 5 && judged.excess_cost > -1e-3, "frame {frame}: {judged:?}");
    }
    assert!(plans > 5 && warm_iterations < cold_iterations, "{plans}: {warm_iterations}, {cold_iterations}");
    let between = explain(&recording, 3).unwrap();
    assert!(between.identical && between.judged.is_none() && between.path.is_empty());
    let nearest = explain(&recording, between.nearest_planned.unwrap()).unwrap();
    assert!(nearest.judged.is_some() && nearest.nearest_planned == Some(nearest.frame));
    assert!(matches!(explain(&recording, 99_999), Err(AgainError::NoFrame { first: 1, .. })));
}

/// The record claims another command; this build, flying on from there, lands as the vehicle did.
#[test]
fn a_divergence_report_states_whether_the_verdict_changes() {
    let recording = recording();
    let path = LANDED.beside("forged.mcap");
    let mut held = Held::read(&LANDED.log);
    let forged = recording.frames.len() / 2;
    let message = held.messages.iter_mut().filter(|message| message.is_frame()).nth(forged).unwrap();
    let mut frame = ComputerFrame::decode(message.data.as_slice()).unwrap();
    frame.output.gimbal_rad[1] += 0.1;
    message.data = frame.encode_to_vec();
    held.write(&path);
    let report = only(verify(&path).unwrap());
    let first = report.first_divergence.unwrap();
    assert_eq!(first.frame, recording.frames[forged].input.frame);
    assert_eq!(first.fields[0].path, "output.gimbal_rad[1]");
}
