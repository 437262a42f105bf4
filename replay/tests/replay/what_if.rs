//! Tests sweeps and bisections over several flights.

use std::num::NonZeroUsize;
use std::sync::atomic::AtomicBool;

use replay::log::Recording;
use replay::refly::flip::{BisectOptions, bisect};
use replay::refly::vary::{State, grid, random, sweep};
use replay::refly::{ReflyOptions, margin, refly};

use crate::simulated::{DISPERSED, MK2, Simulated};

fn flights() -> Vec<Recording> {
    [&*MK2, &*DISPERSED].map(Simulated::recording).to_vec()
}

#[test]
fn the_result_of_a_sweep_does_not_depend_on_the_number_of_jobs_or_on_a_stop() {
    let flights = flights();
    let vary = ["powered.weights.theta=50:110:3".parse().unwrap()];
    let plant = ["truth.impulse_scale=0.7,1.0".parse().unwrap()];
    let points = grid(&vary, &plant).unwrap();
    let options = ReflyOptions::default();
    let jobs = |count| NonZeroUsize::new(count).unwrap();
    let run = |count, state: &mut State| {
        sweep(&flights, &points, &options, jobs(count), state, &mut |_, _| {}).unwrap()
    };
    let one = run(1, &mut State::in_memory(12));
    assert_eq!(one, run(3, &mut State::in_memory(12)));
    assert_eq!((one.points.len(), one.points[0].flights.len()), (6, 2));
    let ranked: Vec<f64> = one.points.iter().map(|point| point.worst_margin.unwrap()).collect();
    assert!(ranked.is_sorted_by(|a, b| a >= b), "{ranked:?}");
    let worst = &one.points[5];
    assert!(worst.worst_margin.unwrap() < 0.0 && worst.settings[1] == "truth.impulse_scale=0.7", "{worst:?}");

    let path = MK2.beside("sweep.jsonl");
    assert_eq!(run(2, &mut State::open(&path, "id", 12).unwrap()), one);
    let text = std::fs::read_to_string(&path).unwrap();
    let half: Vec<&str> = text.lines().take(6).collect();
    std::fs::write(&path, half.join("\n")).unwrap();
    let mut state = State::open(&path, "id", 12).unwrap();
    assert_eq!(state.known(), 5);
    let mut flown = Vec::new();
    let continued = sweep(&flights, &points, &options, jobs(2), &mut state, &mut |done, _| flown.push(done));
    assert_eq!(continued.unwrap(), one);
    assert_eq!(flown, [5, 6, 7, 8, 9, 10, 11, 12]);
}

#[test]
fn an_unknown_name_ends_a_sweep_with_the_nearest() {
    let flights = flights();
    let points = random(&["powered.weigths.theta=50:110".parse().unwrap()], &[], 3, 1).unwrap();
    let options = ReflyOptions::default();
    let mut state = State::in_memory(6);
    let error =
        sweep(&flights, &points, &options, NonZeroUsize::MIN, &mut state, &mut |_, _| {}).unwrap_err();
    let chain = format!("{:#}", anyhow::Error::from(error));
    assert!(chain.contains("did you mean `powered.weights.theta`"), "{chain}");
}

#[test]
fn a_bisection_that_cannot_be_made_is_refused_with_the_reason() {
    let recording = MK2.recording();
    let options = BisectOptions {
        path: "truth.impulse_scale".to_owned(),
        plant_alone: true,
        value: Some(2.0),
        from: 0.9,
        to: 1.02,
        steps: 16,
        refly: ReflyOptions::default(),
    };
    let refused = |options: &BisectOptions| {
        bisect(&recording, options, &AtomicBool::new(false)).unwrap_err().to_string()
    };
    assert!(refused(&options).contains("does not lie between"));
    // A key that the mission leaves out, and an unknown key.
    let of = |path: &str| BisectOptions { value: None, path: path.to_owned(), ..options.clone() };
    assert!(refused(&of("ignition.fixed_height_m")).contains("--value"));
    let unknown = refused(&of("powered.wieghts.theta"));
    assert!(unknown.contains("did you mean `powered.weights.theta`?"), "{unknown}");
}

#[test]
fn the_margin_is_the_fraction_left_of_the_nearest_limit() {
    let recording = MK2.recording();
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
