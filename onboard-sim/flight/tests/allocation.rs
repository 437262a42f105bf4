//! A warm search for the final time does not allocate.

use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, solve_free_time_into};

/// 37 N now, falling by 1.5 N/s, on a constant mass of 3 kg.
struct Fading;

impl Motor for Fading {
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        37.0 - 0.75 * (from_s + to_s)
    }

    fn mean_mass_kg(&self, _: f64, _: f64) -> f64 {
        3.0
    }
}

#[test]
fn warm_searches_for_the_final_time_do_not_allocate() {
    let mut problem = FreeTimeProblem {
        landing: nmpc::paper::problem(nmpc::paper::start(), 0),
        intervals: 50,
        earliest_s: 0.5,
        latest_s: 6.0,
        target_drift_m_s: 0.0,
        max_solves: 8,
    };
    let mut workspace = FreeTimeWorkspace::default();
    let (mut best, mut next) = (FreeTimeSolution::default(), FreeTimeSolution::default());
    for found in [&mut best, &mut next] {
        solve_free_time_into(&problem, &Fading, None, &mut workspace, found);
    }
    assert!(best.lands(), "{}", best.solution.condition_miss);
    problem.max_solves = 3;
    let mut iterations = 0;
    for kick in [0.0, 0.02, -0.05] {
        problem.landing.initial.w_m_s += kick;
        let allocated = allocation_counter::measure(|| {
            solve_free_time_into(&problem, &Fading, Some((&best, 0.0)), &mut workspace, &mut next);
        });
        assert_eq!(allocated.count_total, 0, "{kick}");
        assert!(next.solves <= 3, "{}", next.solves);
        iterations += next.solution.iterations;
    }
    assert!(iterations > 0);
}
