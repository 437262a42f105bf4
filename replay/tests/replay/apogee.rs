//! Tests every what-if question on a whole flight from apogee, as logged by a campaign.

use flight::rules::phase::Phase;
use proptest::prelude::*;
use protocol::log::computer_v1::{ComputerFrame, Request};
use protocol::log::record::Record;
use protocol::log::writer::{LogHeader, LogWriter};
use replay::evaluate::{EvaluateError, evaluate};
use replay::log::{Clock, ClockTime, Moment, Recording};
use replay::refly::{ReflyOptions, refly, refly_flight, write_log};
use replay::verify::explain::explain;
use replay::verify::{Verification, verify};

use crate::asked::{settings, with, with_plant};
use crate::command_line::{replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;

fn recording() -> Recording {
    Recording::open(&LANDED.log).unwrap()
}

#[test]
fn the_logged_flight_landed_and_verifies() {
    assert!(LANDED.landed && recording().verdict.unwrap().landing.stands);
    let report = only(verify(&LANDED.log).unwrap());
    assert_eq!((report.outcome, report.obstacle), (Verification::Identical, None));
}

#[test]
fn without_changes_the_decisions_are_the_recorded_ones() {
    let report = evaluate(&recording(), &[]).unwrap();
    assert!(report.kind.starts_with("open loop"));
    assert_eq!((report.commands_different, report.levels_different), (0, 0));
    assert!(report.frames.iter().all(|frame| frame.recorded == frame.evaluated));
    assert!(report.phases.iter().all(|phase| phase.recorded_s == phase.evaluated_s));
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
        assert!(matches!(refused(given), EvaluateError::Refused { setting, .. } if setting == given));
    }
    let message = refused("powered.weihgts.theta=1").to_string();
    assert!(message.contains("did you mean `powered.weights.theta`?"), "{message}");
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
            refly_flight(&recording, &ReflyOptions { start: start.clone(), ..ReflyOptions::default() })
                .unwrap();
        assert!(report.kind.starts_with("closed loop"));
        let reached = report.reached;
        assert_eq!((reached.identical, reached.first_different), (reached.frames, None), "{start:?}");
        assert_eq!(report.commands_identical, report.frames, "{start:?}");
        assert_eq!(reached.frames + report.frames, recording.frames.len(), "{start:?}");
        assert_eq!(flown.verdict, recording.verdict, "{start:?}");
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
        assert!(report.gimbal_difference_max_rad > 0.0, "{given}");
    }
    let other = ReflyOptions { seed: Some(9), ..ReflyOptions::default() };
    assert!(refly(&recording, &other).unwrap().commands_identical < recording.frames.len());
}

#[test]
fn a_flight_that_cannot_be_flown_again_is_refused_with_the_reason() {
    let mut recording = recording();
    let refusal = |start| {
        refly(&recording, &ReflyOptions { start, ..ReflyOptions::default() }).unwrap_err().to_string()
    };
    assert!(refusal(Some(Moment::Frame(99_999))).contains("no frame 99999; there are 1 to"));
    assert!(
        refusal(Some(Moment::Time(ClockTime { clock: Clock::Flight, time_s: 1e6 })))
            .contains("the last is at")
    );
    assert!(refusal(Some(Moment::Phase(Phase::Chute))).contains("no frame in phase CHUTE"));
    let refused = |options: &ReflyOptions| refly(&recording, options).unwrap_err().to_string();
    assert!(refused(&with(&["powered.gimball_deg=3"])).contains("`powered.gimbal_deg`"));
    assert!(refused(&with_plant(&["truth.wind=3"])).contains("`truth.wind_m_s`"));
    assert!(refused(&with_plant(&["truth.wind_m_s=3@4"])).contains("from the beginning"));
    assert!(refused(&with_plant(&["truth.wind_m_s=99"])).contains("0 to 60 is accepted"));
    assert!(refused(&with_plant(&["powered.gimbal_deg=3"])).contains("everything else is the controller's"));
    assert!(refused(&with(&["truth.wind_m_s=3"])).contains("belongs to the plant alone"));
    assert!(refused(&with(&["estimator.frame_s=1.0"])).contains("evaluate"));
    let landing = |frame: &ComputerFrame| frame.output.phase > u32::from(Phase::AeroDescent.index());
    let fallen = recording.frames.iter().position(landing).unwrap();
    let mut falling = recording.clone();
    falling.frames.truncate(fallen);
    let refusal = refly(&falling, &ReflyOptions::default()).unwrap_err().to_string();
    assert!(refusal.contains("a frame, a time or a phase names another moment"), "{refusal}");
    recording.head.run.remove("flight");
    let message = refly(&recording, &ReflyOptions::default()).unwrap_err().to_string();
    assert!(message.contains("apogee.mcap") && message.contains("`flight`"), "{message}");
}

/// A log that this build's world would not produce: the forged frame is named, and the flight is still flown on.
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
        let (_, flown) = refly_flight(&recording, &options).unwrap();
        let path = LANDED.beside(name);
        write_log(&path, &recording, &flown).unwrap();
        let verified = only(verify(&path).unwrap());
        assert_eq!((verified.outcome, verified.first_divergence), (Verification::Identical, None), "{name}");
        let again = Recording::open(&path).unwrap();
        assert_eq!(again.verdict, flown.verdict, "{name}");
        assert!(evaluate(&again, &[]).unwrap().commands_different == 0, "{name}");
        let refusal = refly(&again, &ReflyOptions::default()).unwrap_err().to_string();
        assert!(refusal.contains("fly that one again"), "{refusal}");
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
        assert!(report.path.len() > 5 && judged.flown_dearer > -1e-3, "frame {frame}: {judged:?}");
    }
    assert!(plans > 5 && warm_iterations < cold_iterations, "{plans}: {warm_iterations}, {cold_iterations}");
    let between = explain(&recording, 3).unwrap();
    assert!(between.identical && between.judged.is_none() && between.path.is_empty());
    let nearest = explain(&recording, between.nearest_planned.unwrap()).unwrap();
    assert!(nearest.judged.is_some() && nearest.nearest_planned == Some(nearest.frame));
    let refusal = explain(&recording, 99_999).unwrap_err().to_string();
    assert!(refusal.contains("no frame 99999 that can be re-executed; there are 1 to"), "{refusal}");
}

#[test]
fn a_flight_that_does_not_say_how_it_was_drawn_is_not_flown_again() {
    let mut flight = recording();
    flight.head.run.remove("flight");
    let refusal = refly(&flight, &ReflyOptions::default()).unwrap_err().to_string();
    assert!(refusal.contains("`flight`"), "{refusal}");
}

#[test]
fn every_command_answers_for_a_flight_from_apogee() {
    let log = &LANDED.log;
    let (code, stdout, stderr) = run(replay("evaluate", log).args(["--set", "powered.gimbal_deg=4.0"]));
    assert!(code == 0 && stdout.contains("open loop") && stdout.contains("POWERED"), "{stdout}{stderr}");
    let directory = tempfile::tempdir().unwrap();
    let table = directory.path().join("table.csv");
    let (code, stdout, _) =
        run(replay("evaluate", log).args(["--set", "powered.gimbal_deg=4.0", "--csv"]).arg(&table));
    assert!(code == 0 && stdout.contains("open loop"), "{stdout}");
    let written = std::fs::read_to_string(&table).unwrap();
    assert!(written.starts_with("frame,time_s,recorded_phase"), "{written:.200}");
    assert!(written.lines().next().unwrap().contains("evaluated_gimbal_rad_1"), "{written:.200}");
    let (code, _, stderr) = run(replay("evaluate", log).arg("--csv").arg(&table));
    assert!(code == 2 && stderr.contains("exists already"), "{stderr}");
    let (code, stdout, stderr) = run(replay("refly", log).args(["--plant", "truth.impulse_scale=0.7"]));
    assert!(code == 0 && stdout.contains("the verdict CHANGES"), "{stdout}{stderr}");
    assert!(stdout.contains("recorded frames identical") && stdout.contains("vertical speed"), "{stdout}");
    // A plan in the middle of the burn.
    let recording = recording();
    let planned = |frame: &&ComputerFrame| {
        frame.output.phase == u32::from(Phase::Powered.index()) && frame.input.plan_ready
    };
    let planning: Vec<u64> = recording.frames.iter().filter(planned).map(|frame| frame.input.frame).collect();
    let planning = planning[planning.len() / 2];
    let (code, stdout, _) = run(replay("verify", log).args(["--explain", &planning.to_string()]));
    assert!(code == 0 && stdout.contains("identical bit for bit") && stdout.contains("cold"), "{stdout}");
    let (code, _, stderr) = run(replay("refly", log).args(["--set", "powered.wieghts.theta=80"]));
    assert!(code == 2 && stderr.contains("did you mean `powered.weights.theta`?"), "{stderr}");
}

/// The record claims another command; this build, flying on from there, lands as the vehicle did.
#[test]
fn a_divergence_report_says_whether_the_verdict_would_change() {
    let recording = recording();
    let path = LANDED.beside("forged.mcap");
    let header = LogHeader {
        run: recording.head.run.clone(),
        profile_toml: Some(recording.profile_toml().unwrap().to_owned()),
        scenario_toml: recording.head.scenario_toml.clone(),
        ..LogHeader::default()
    };
    let mut writer = LogWriter::new(std::fs::File::create(&path).unwrap(), &header).unwrap();
    writer.write(&Record::ComputerStart(Box::new(recording.start.unwrap())), 0).unwrap();
    let forged = recording.frames.len() / 2;
    for (place, frame) in recording.frames.iter().enumerate() {
        let mut frame = frame.clone();
        if place == forged {
            frame.output.gimbal_rad[1] += 0.1;
        }
        let time_ns = frame.input.frame * 5_000_000;
        writer.write(&Record::ComputerFrame(Box::new(frame)), time_ns).unwrap();
    }
    writer.write(&Record::LandingVerdict(Box::new(recording.verdict.unwrap())), 15_000_000_000).unwrap();
    writer.finish().unwrap();
    let (code, stdout, _) = run(&mut replay("verify", &path));
    assert_eq!(code, 1);
    let first = format!("first at frame {}", recording.frames[forged].input.frame);
    assert!(stdout.contains(&first) && stdout.contains("output.gimbal_rad[1]"), "{stdout}");
    assert!(
        stdout.contains("verdict: would not change: recorded stands undamaged, flown on by this build"),
        "{stdout}"
    );
}

/// Changes some number of a frame to arbitrary bits.
fn spoil(frame: &mut ComputerFrame, field: usize, bits: u64) {
    let number = f64::from_bits(bits);
    let (input, output) = (&mut frame.input, &mut frame.output);
    match field {
        0 => input.time_s = number,
        1 => input.frame = bits,
        2 => input.fins_rad = vec![number; (bits % 6) as usize],
        3 => input.fins_rad.fill(number),
        4 => output.gimbal_rad = vec![number; (bits % 4) as usize],
        5 => output.phase = bits as u32,
        6 => output.level = bits as u32,
        7 => input.measured.gnss = None,
        8 => input.contact = true,
        9 => input.requests.push(Request { asked: (bits % 12) as u32, ..Request::default() }),
        10 => input.measured.imu.gyro_rad_s.y = number,
        11 => input.measured.imu.specific_force_m_s2.x = number,
        12 => input.measured.pressure_altitude_m = Some(number),
        _ => input.measured.lidar_range_m = Some(number),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// A flight with nonsense in it: every command gives an answer or a reason.
    #[test]
    fn nonsense_gets_an_answer_or_a_reason(spoilt in prop::collection::vec((0_usize..60, 0_usize..14, any::<u64>()), 1..8)) {
        let mut recording = recording();
        // Around the ignition, where plans begin.
        let lit = |frame: &ComputerFrame| frame.output.phase == u32::from(Phase::Powered.index());
        let landing = recording.frames.iter().position(lit).unwrap() - 20;
        recording.frames.truncate(landing + 60);
        for (place, field, bits) in spoilt {
            spoil(&mut recording.frames[landing + place], field, bits);
        }
        if let Ok(report) = evaluate(&recording, &settings(&["powered.gimbal_deg=4.0"])) {
            prop_assert_eq!(report.frames.len(), recording.frames.len());
        }
        let last = recording.frames[recording.frames.len() - 1].input.frame;
        if let Ok(report) = explain(&recording, last) {
            prop_assert_eq!(report.frame, last);
        }
        if let Ok(report) = refly(&recording, &ReflyOptions::default()) {
            prop_assert!(report.frames > 0);
        }
    }
}

/// The C library picks its mathematical functions by processor; the pilot's results must not depend on that. (Our solver
/// asks the processor itself: this test does not change its answer.)
#[test]
fn its_frames_are_identical_with_other_functions_of_the_c_library() {
    let mut command = replay("verify", &LANDED.log);
    let (code, stdout, _) = run(command.env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4"));
    assert_eq!(code, 0, "{stdout}");
    assert!(stdout.contains("identical"), "{stdout}");
}
