//! Tests settings that take whole numbers, in a sweep.

use replay::refly::ReflyOptions;
use replay::refly::vary::{grid, sweep};

use crate::simulated::MK2;

const STEPS: &str = "powered.solver.max_iterations";

#[test]
fn a_range_of_whole_numbers_is_flown_and_a_fraction_is_refused() {
    let flights = [MK2.recording()];
    let fly = |range: &str| {
        let points = grid(&[format!("{STEPS}={range}").parse().unwrap()], &[]).unwrap();
        let options = ReflyOptions::default();
        let report = sweep(&flights, &points, &options, &|_, _| {});
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
}
