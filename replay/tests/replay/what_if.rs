//! Tests sweeps over several flights.

use std::sync::atomic::{AtomicUsize, Ordering};

use campaign::run::threads;
use replay::log::Recording;
use replay::refly::vary::{grid, sweep};
use replay::refly::{ReflyOptions, margin, refly};

use crate::simulated::{DISPERSED, MK2, Simulated};

fn flights() -> Vec<Recording> {
    [&*MK2, &*DISPERSED].map(Simulated::recording).to_vec()
}

#[test]
fn the_result_of_a_sweep_does_not_depend_on_the_number_of_jobs() {
    let flights = flights();
    let vary = ["powered.weights.theta=50:110:3".parse().unwrap()];
    let plant = ["truth.impulse_scale=0.7,1.0".parse().unwrap()];
    let points = grid(&vary, &plant).unwrap();
    let options = ReflyOptions::default();
    let told = AtomicUsize::new(0);
    let count = |done, of| _ = told.fetch_add(done + of, Ordering::Relaxed);
    let sweep = || sweep(&flights, &points, &options, &count).unwrap();
    let one = threads(Some(1)).unwrap().install(sweep);
    // 1 to 12, of 12 each time.
    assert_eq!(told.load(Ordering::Relaxed), 78 + 12 * 12);
    assert_eq!(one, threads(Some(3)).unwrap().install(sweep));
    assert_eq!((one.points.len(), one.points[0].flights.len()), (6, 2));
    let ranked: Vec<f64> = one.points.iter().map(|point| point.worst_margin.unwrap()).collect();
    assert!(ranked.is_sorted_by(|a, b| a >= b), "{ranked:?}");
    let worst = &one.points[5];
    assert!(worst.worst_margin.unwrap() < 0.0 && worst.settings[1] == "truth.impulse_scale=0.7", "{worst:?}");
}

#[test]
fn an_unknown_name_ends_a_sweep_with_the_nearest() {
    let flights = flights();
    let points = grid(&["powered.weigths.theta=50:110:3".parse().unwrap()], &[]).unwrap();
    let options = ReflyOptions::default();
    let error = sweep(&flights, &points, &options, &|_, _| {}).unwrap_err();
    let chain = format!("{:#}", anyhow::Error::from(error));
    assert!(chain.contains("did you mean `powered.weights.theta`"), "{chain}");
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
