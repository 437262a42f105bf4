//! Tests other settings on recorded flights: open loop, closed loop, single ticks, sweeps.

use std::num::NonZeroUsize;
use std::sync::atomic::AtomicBool;

use flight::rules::phase::Phase;
use replay::evaluate::{EvaluateError, evaluate};
use replay::log::Recording;
use replay::refly::{From, Law, ReflyOptions, StartAt, margin, refly, refly_flight, write_log};
use replay::sweep::{BisectOptions, State, bisect, grid, random, sweep};
use replay::tick::tick;
use replay::verify::{Verification, verify};

use crate::asked::{settings, with, with_plant};
use crate::flown::only;
use crate::simulated::{DISPERSED, NOMINAL, Simulated};

#[test]
fn without_changes_the_commands_are_the_recorded_ones() {
    let report = evaluate(&NOMINAL.recording(), &[]).unwrap();
    assert!(report.kind.starts_with("open loop"));
    assert_eq!((report.commands_different, report.levels_different), (0, 0));
    assert!(report.ticks.iter().all(|tick| tick.recorded == tick.evaluated));
}

#[test]
fn a_timed_change_holds_from_its_time_on() {
    let recording = DISPERSED.recording();
    let report = evaluate(&recording, &settings(&["nmpc.weights.w=120@13.0"])).unwrap();
    let differs = |time_s: f64| {
        report.ticks.iter().any(|tick| tick.time_s >= time_s && tick.recorded != tick.evaluated)
    };
    assert!(report.ticks.iter().all(|tick| tick.time_s >= 12.999 || tick.recorded == tick.evaluated));
    assert!(differs(13.0), "a weight of the cost changes the cost at least");
    // From the beginning the evaluation differs.
    let whole = evaluate(&recording, &settings(&["nmpc.weights.w=120"])).unwrap();
    assert!(whole.commands_different > report.commands_different);
}

#[test]
fn settings_of_the_plant_are_refused_in_open_loop() {
    let recording = NOMINAL.recording();
    let refused = |given| evaluate(&recording, &settings(&[given])).unwrap_err();
    assert!(matches!(refused("plant.thrust_scale=0.9"), EvaluateError::NotTheControllers { .. }));
    assert!(matches!(refused("nmpc.sample_time_s=0.05"), EvaluateError::SampleTime { .. }));
    assert!(refused("nmpc.weihgts.w=1").to_string().contains("`nmpc.weights.w`"));
}

/// The simulated flight, flown again with nothing changed, from its release and from several moments of its burn.
#[test]
fn without_changes_the_flight_is_the_same_bit_for_bit() {
    for flight in [&NOMINAL, &DISPERSED] {
        let recording = flight.recording();
        let recorded = recording.verdict.clone().unwrap();
        let starts = [
            StartAt::Landing,
            StartAt::Tick(14),
            StartAt::Tick(45),
            StartAt::Time(13.05),
            StartAt::Phase(Phase::Powered),
        ];
        for start in starts {
            for from in [From::Truth, From::Estimate] {
                let options = ReflyOptions { start: start.clone(), from, ..ReflyOptions::default() };
                let (report, flown) = refly_flight(&recording, &options).unwrap();
                assert!(report.kind.starts_with("closed loop"));
                assert_eq!(report.commands_identical, report.ticks, "{start:?}");
                assert_eq!(flown.verdict.as_ref(), Some(&recorded), "{start:?}");
                assert_eq!(report.verdict_changed, Some(false));
                for again in &flown.ticks {
                    let number = usize::try_from(again.record.input.tick).unwrap();
                    assert_eq!(again.record.input, recording.ticks[number].input, "{start:?}");
                    assert_eq!(again.record.state_digest, recording.ticks[number].state_digest, "{start:?}");
                }
                let first_s = flown.truth[0].time_s;
                for again in &flown.truth[..flown.truth.len() - 1] {
                    let then = recording.truth.iter().find(|then| (then.time_s - again.time_s).abs() < 1e-9);
                    assert_eq!(Some(again), then, "{start:?} from {first_s}");
                }
            }
        }
    }
}

#[test]
fn a_weak_motor_unknown_to_the_controller_changes_the_verdict() {
    let recording = NOMINAL.recording();
    let report = refly(&recording, &with_plant(&["plant.thrust_scale=0.95"])).unwrap();
    assert_eq!(report.verdict_changed, Some(true));
    assert!(report.margin.unwrap() < 0.0);
    assert!(!report.reflown.unwrap().landed && report.recorded.unwrap().landed);
    // The same from a later moment on: the plant's motor is weaker from there.
    let late = ReflyOptions { start: StartAt::Tick(50), ..with_plant(&["plant.thrust_scale=0.8"]) };
    assert_eq!(refly(&recording, &late).unwrap().verdict_changed, Some(true));
}

/// Full thrust straight up stops the fall above the ground and burns out there; only tilting wastes the surplus thrust.
#[test]
fn the_upright_law_alone_does_not_land_the_nominal_flight() {
    let options = ReflyOptions { law: Law::Stabiliser, ..ReflyOptions::default() };
    let report = refly(&NOMINAL.recording(), &options).unwrap();
    assert_eq!(report.verdict_changed, Some(true));
}

#[test]
fn an_impossible_start_is_refused_with_the_possible_ones() {
    let recording = NOMINAL.recording();
    let refusal = |start| {
        let options = ReflyOptions { start, ..ReflyOptions::default() };
        refly(&recording, &options).unwrap_err().to_string()
    };
    assert!(refusal(StartAt::Tick(0)).contains("LAND_ARMED, IGNITION or POWERED"));
    assert!(refusal(StartAt::Tick(100_000)).contains("no tick 100000; there are 0 to"));
    assert!(refusal(StartAt::Time(1e6)).contains("the last is at"));
    assert!(refusal(StartAt::Phase(Phase::Chute)).contains("CHUTE"));
    let timed = with_plant(&["motor.thrust_n=30@8"]);
    assert!(refly(&recording, &timed).unwrap_err().to_string().contains("from the beginning"));
}

#[test]
fn a_flight_flown_again_is_a_log_that_verifies() {
    let recording = DISPERSED.recording();
    for (name, options) in [
        ("same.mcap", ReflyOptions::default()),
        ("weights.mcap", with(&["nmpc.weights.w=120", "nmpc.weights.q=60"])),
        ("timed.mcap", with(&["nmpc.weights.w=120@13.0", "nmpc.weights.q=60"])),
        ("late.mcap", ReflyOptions { start: StartAt::Tick(30), ..ReflyOptions::default() }),
    ] {
        let (report, flown) = refly_flight(&recording, &options).unwrap();
        let path = DISPERSED.beside(name);
        write_log(&path, &recording, &options, &report, &flown).unwrap();
        let verified = only(verify(&path).unwrap());
        assert_eq!(verified.outcome, Verification::Identical, "{name}");
        assert_eq!(verified.ticks_identical as usize, flown.before.len() + flown.ticks.len());
        let again = Recording::open(&path).unwrap();
        assert_eq!(again.verdict, flown.verdict);
        assert_eq!(evaluate(&again, &[]).unwrap().unchanged_different, 0, "{name}");
        assert!(tick(&again, 40).unwrap().identical, "{name}");
        // Flown again unchanged, it comes out the same again, including its timed changes.
        let unchanged = ReflyOptions { start: options.start.clone(), ..ReflyOptions::default() };
        let once_more = refly_flight(&again, &unchanged).unwrap().1;
        assert_eq!(once_more.verdict, flown.verdict, "{name}");
        assert!(write_log(&path, &recording, &options, &report, &flown).is_err(), "never overwritten");
    }
}

/// Every tick of a flight, solved again with a cold start: the same problem, and the warm start needs fewer iterations.
#[test]
fn every_tick_solved_again_is_the_recorded_one() {
    let recording = DISPERSED.recording();
    let (mut warm_iterations, mut cold_iterations) = (0, 0);
    for number in 0..recording.ticks.len() as u64 {
        let report = tick(&recording, number).unwrap();
        assert!(report.identical, "tick {number}");
        let Some((warm, cold)) = report.warm.zip(report.cold) else {
            continue;
        };
        assert_eq!(warm.gimbal_rad.to_bits(), first_input(&report.path), "tick {number}");
        assert!(warm.condition_miss < 0.3 && cold.kkt_feasibility.is_finite());
        warm_iterations += warm.iterations;
        cold_iterations += cold.iterations;
        // The end height is an equality, so it is always active.
        assert!(report.active.iter().any(|constraint| constraint.what == "z_m = 0.0000"), "tick {number}");
    }
    assert!(3 * warm_iterations < cold_iterations, "{warm_iterations} warm, {cold_iterations} cold");
    let refusal = tick(&recording, 9999).unwrap_err().to_string();
    assert!(refusal.contains("no tick 9999"), "{refusal}");
}

fn first_input(path: &[replay::tick::PathPoint]) -> u64 {
    path.first().and_then(|point| point.gimbal_rad).unwrap().to_bits()
}

fn flights() -> Vec<Recording> {
    [&*NOMINAL, &*DISPERSED].map(Simulated::recording).to_vec()
}

#[test]
fn the_result_of_a_sweep_does_not_depend_on_the_number_of_jobs_or_on_a_stop() {
    let flights = flights();
    let vary = ["nmpc.weights.w=50:110:3".parse().unwrap()];
    let plant = ["plant.thrust_scale=0.98,1.0".parse().unwrap()];
    let points = grid(&vary, &plant).unwrap();
    let options = ReflyOptions::default();
    let jobs = |count| NonZeroUsize::new(count).unwrap();
    let run = |count, state: &mut State| {
        sweep(&flights, &points, &options, jobs(count), state, &mut |_| {}).unwrap()
    };
    let one = run(1, &mut State::in_memory(12));
    assert_eq!(one, run(3, &mut State::in_memory(12)));
    assert_eq!((one.points.len(), one.points[0].flights.len()), (6, 2));
    let ranked: Vec<f64> = one.points.iter().map(|point| point.worst_margin.unwrap()).collect();
    assert!(ranked.is_sorted_by(|a, b| a >= b), "{ranked:?}");
    let worst = &one.points[5];
    assert!(worst.worst_margin.unwrap() < 0.0 && worst.settings[1] == "plant.thrust_scale=0.98", "{worst:?}");

    let path = NOMINAL.beside("sweep.jsonl");
    assert_eq!(run(2, &mut State::open(&path, "id", 12).unwrap()), one);
    let text = std::fs::read_to_string(&path).unwrap();
    let half: Vec<&str> = text.lines().take(6).collect();
    std::fs::write(&path, half.join("\n")).unwrap();
    let mut state = State::open(&path, "id", 12).unwrap();
    assert_eq!(state.known(), 5);
    let mut flown = Vec::new();
    let continued =
        sweep(&flights, &points, &options, jobs(2), &mut state, &mut |progress| flown.push(progress.done));
    assert_eq!(continued.unwrap(), one);
    assert_eq!(flown, [5, 6, 7, 8, 9, 10, 11, 12]);
}

#[test]
fn an_unknown_name_ends_a_sweep_with_the_nearest() {
    let flights = flights();
    let points = random(&["nmpc.weigths.w=50:110".parse().unwrap()], &[], 3, 1).unwrap();
    let options = ReflyOptions::default();
    let mut state = State::in_memory(6);
    let error = sweep(&flights, &points, &options, NonZeroUsize::MIN, &mut state, &mut |_| {}).unwrap_err();
    let chain = format!("{:#}", anyhow::Error::from(error));
    assert!(chain.contains("did you mean `nmpc.weights.w`"), "{chain}");
}

/// The verdicts on the two sides of the value found really differ.
#[test]
fn a_bisection_brackets_the_change_of_the_verdict() {
    let recording = NOMINAL.recording();
    let options = BisectOptions {
        path: "plant.thrust_scale".to_owned(),
        plant_alone: true,
        value: Some(1.0),
        from: 0.9,
        to: 1.02,
        steps: 16,
        refly: ReflyOptions::default(),
    };
    let report = bisect(&recording, &options, &AtomicBool::new(false)).unwrap();
    assert!(report.outcome.landed);
    let flip = report.smallest().unwrap();
    assert!(flip.change < 0.0 && (flip.same_at - flip.other_at).abs() < 1e-12, "{flip:?}");
    let landed = |scale: f64| {
        let options = with_plant(&[&format!("plant.thrust_scale={scale:?}")]);
        refly(&recording, &options).unwrap().reflown.unwrap().landed
    };
    assert!(landed(flip.same_at) && !landed(flip.other_at));
    let outside = BisectOptions { value: Some(2.0), ..options.clone() };
    assert!(
        bisect(&recording, &outside, &AtomicBool::new(false))
            .unwrap_err()
            .to_string()
            .contains("does not lie between")
    );
    let refused = |path: &str| {
        let options = BisectOptions { value: None, path: path.to_owned(), ..options.clone() };
        bisect(&recording, &options, &AtomicBool::new(false)).unwrap_err().to_string()
    };
    // A key that the profile leaves out, and an unknown key.
    assert!(refused("gimbal.rate_limit_deg_s").contains("--value"));
    let unknown = refused("nmpc.wieghts.w");
    assert!(unknown.contains("did you mean `nmpc.weights.w`?"), "{unknown}");
}

#[test]
fn the_margin_is_the_fraction_left_of_the_nearest_limit() {
    let recording = NOMINAL.recording();
    let mut verdict = refly(&recording, &ReflyOptions::default()).unwrap().reflown.unwrap();
    for limit in &mut verdict.limits {
        limit.value = 0.5 * (limit.minimum + limit.maximum);
    }
    assert!((margin(&verdict) - 1.0).abs() < 1e-12);
    verdict.limits[3].value = 0.75 * verdict.limits[3].maximum;
    assert!((margin(&verdict) - 0.25).abs() < 1e-12);
    verdict.limits[4].value = 2.0 * verdict.limits[4].maximum;
    assert!((margin(&verdict) + 1.0).abs() < 1e-12);
    verdict.limits[4].value = f64::NAN;
    assert!(margin(&verdict).is_infinite() && margin(&verdict) < 0.0);
}
