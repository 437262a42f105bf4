//! Tests settings that take whole numbers.

use replay::refly::{ReflyOptions, refly};

use crate::asked::settings;
use crate::simulated::MK2;

#[test]
fn a_whole_number_is_flown_however_it_is_written_and_a_fraction_is_refused() {
    let recording = MK2.recording();
    let fly = |given: &str| {
        let options = ReflyOptions { settings: settings(&[given]), ..ReflyOptions::default() };
        refly(&recording, &options).map(|report| report.reflown)
    };
    let whole = fly("powered.solver.max_iterations=15").unwrap();
    assert_eq!(fly("powered.solver.max_iterations=15.0").unwrap(), whole);
    let refusal = fly("powered.solver.max_iterations=10.5").unwrap_err().to_string();
    assert!(refusal.contains("powered.solver.max_iterations=10.5"), "{refusal}");
}
