//! Tests settings that take whole numbers, in a sweep and in a bisection.

use std::num::NonZeroUsize;
use std::sync::atomic::AtomicBool;

use replay::refly::ReflyOptions;
use replay::refly::flip::{BisectOptions, bisect};
use replay::refly::vary::{State, grid, sweep};

use crate::asked::with;
use crate::simulated::MK2;

const STEPS: &str = "powered.solver.max_iterations";

#[test]
fn a_range_of_whole_numbers_is_flown_and_a_fraction_is_refused() {
    let flights = [MK2.recording()];
    let fly = |range: &str| {
        let points = grid(&[format!("{STEPS}={range}").parse().unwrap()], &[]).unwrap();
        let mut state = State::in_memory(points.len());
        let options = ReflyOptions::default();
        let report = sweep(&flights, &points, &options, NonZeroUsize::MIN, &mut state, &mut |_, _| {});
        report.map_err(|error| format!("{:#}", anyhow::Error::from(error)))
    };
    assert_eq!(fly("10:20:3").unwrap().points, {
        let mut listed = fly("10,15,20").unwrap().points;
        for point in &mut listed {
            point.settings[0] += ".0";
        }
        listed
    });
    let refusal = fly("10:11:3").unwrap_err();
    assert!(refusal.contains("powered.solver.max_iterations=10.5"), "{refusal}");
    assert!(refusal.contains("must be a whole number"), "{refusal}");
}

/// Only whole numbers are tried, and the two on the sides of the change are neighbours.
#[test]
fn a_bisection_ends_between_neighbouring_whole_numbers() {
    let recording = MK2.recording();
    let options = BisectOptions {
        path: STEPS.to_owned(),
        plant_alone: false,
        value: None,
        from: 2.0,
        to: 52.5,
        steps: 4,
        refly: ReflyOptions::default(),
    };
    let report = bisect(&recording, &options, &AtomicBool::new(false)).unwrap();
    let flip = report.smallest().unwrap();
    assert_eq!((flip.same_at - flip.other_at).abs().to_bits(), 1.0_f64.to_bits(), "{flip:?}");
    let landed = |steps: f64| {
        let report = replay::refly::refly(&recording, &with(&[&format!("{STEPS}={steps:.0}")])).unwrap();
        report.reflown.unwrap().landed
    };
    assert!(landed(flip.same_at) == report.outcome.landed && landed(flip.other_at) != report.outcome.landed);
}
