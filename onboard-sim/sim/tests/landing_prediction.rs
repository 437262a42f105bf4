//! The landing position that the vehicle reports in its fall, against where it comes to rest.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::VecDeque;

use flight::computer::FRAME_S;
use flight::rules::phase::Phase;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

/// Flights of each dispersion.
const FLIGHTS: u64 = 100;
/// How long before the ignition the prediction counts, s.
const BEFORE_S: f64 = 0.5;

/// Distance from the predicted to the true landing position, m, of the flights that land under the
/// motor; and the same of the position without a motor.
fn errors_m(dispersion: &str) -> [Vec<f64>; 2] {
    let recipe = Recipe::built_in("mk2", dispersion).unwrap();
    let mut errors = [Vec::new(), Vec::new()];
    for number in 0..FLIGHTS {
        let mut sortie = Sortie::new(&recipe, number).unwrap();
        let mut recent = VecDeque::new();
        let (mut predicted, mut landed) = (None, false);
        while sortie.goes_on() {
            sortie.step();
            let state = *sortie.world().state();
            let phase = sortie.mode().phase;
            if predicted.is_none() {
                let fall_s = state.position_m.z / -state.velocity_m_s.z;
                let ballistic_m = (state.position_m + state.velocity_m_s * fall_s).xy();
                recent.push_back((sortie.pilot().landing_m(), ballistic_m));
                if recent.len() as f64 * FRAME_S > BEFORE_S {
                    recent.pop_front();
                }
            }
            if phase == Phase::Ignition && predicted.is_none() {
                predicted = recent.front().copied();
            }
            landed |= phase == Phase::Touchdown;
        }
        let rest_m = sortie.world().state().position_m.xy();
        if let Some((Some(landing_m), ballistic_m)) = predicted.filter(|_| landed) {
            errors[0].push((landing_m - rest_m).norm());
            errors[1].push((ballistic_m - rest_m).norm());
        }
    }
    errors
}

#[test]
fn the_landing_position_is_predicted_half_a_second_before_the_ignition() {
    for (dispersion, most_m) in [("field", 5.0), ("real", 10.0)] {
        let [median_m, ballistic_m] = errors_m(dispersion).map(|mut errors_m| {
            assert!(errors_m.len() as u64 > FLIGHTS * 4 / 5, "{dispersion}: {}", errors_m.len());
            errors_m.sort_by(f64::total_cmp);
            errors_m[errors_m.len() / 2]
        });
        println!("{dispersion}: median {median_m:.1} m; without the motor {ballistic_m:.1} m");
        assert!(median_m < most_m, "{dispersion}: median {median_m:.1} m");
        assert!(ballistic_m > median_m, "{dispersion}: {ballistic_m:.1} m");
    }
}
