//! Air forces across the body, burnt propellant, wind, and horizons with other nodes.

use super::*;

/// The flown landing with everything that the paper leaves out: a vehicle that loses 6 % of its mass, with air forces
/// across the body, in a wind of 2 m/s, 3 m off the pad.
fn windy_problem(wind_m_s: f64) -> Problem {
    let mut problem = settled(nominal_start(), HORIZON);
    problem.model.params.lateral_drag_per_m = 0.01;
    problem.model.params.crossflow_per_m = 0.03;
    problem.mass_kg = (0..50).map(|k| 3.0 - 0.18 * (f64::from(k) + 0.5) / 50.0).collect();
    for (thrust_n, mass_kg) in problem.thrust_n.iter_mut().zip(&problem.mass_kg) {
        *thrust_n *= mass_kg / 3.0;
    }
    problem.target.w_m_s = -wind_m_s;
    problem.target.x_m = -5.0 * wind_m_s + 3.0;
    problem.initial.w_m_s = -wind_m_s;
    problem
}

#[test]
fn val_reference_solver_agrees_in_wind_with_a_lightening_vehicle() {
    for wind_m_s in [-2.0, 0.0, 2.0] {
        let problem = windy_problem(wind_m_s);
        let solution = solve(&problem, None);
        assert_eq!(solution.status, SolveStatus::Converged, "{wind_m_s}");
        assert!(solution.condition_miss < 1e-6, "{wind_m_s}: {}", solution.condition_miss);
        let checked = reference_solver::solve(&problem, Some(&solution.shifted(0)));
        assert_eq!(checked.status, SolveStatus::Converged, "{wind_m_s}");
        assert!(checked.iterations <= 3, "{wind_m_s}: {} iterations", checked.iterations);
        assert!((solution.cost - checked.cost).abs() < 1e-4, "{} {}", solution.cost, checked.cost);
    }
}

/// In the frame of the air the vehicle must arrive with minus the wind, which means at rest over the ground.
#[test]
fn a_landing_in_wind_stands_still_over_the_ground() {
    let solution = solve(&windy_problem(2.0), None);
    let end = solution.states.last().unwrap();
    let (air_m_s, _) = end.ground_velocity_m_s();
    assert!((air_m_s + 2.0).abs() < 0.04, "{end:?}");
    assert!((end.theta_rad.to_degrees() - 90.0).abs() < 1.001, "{end:?}");
    assert!((end.x_m + 7.0).abs() < 20.001, "{end:?}");
}

/// If thrust and mass are scaled by the same factor, the motion in vacuum is the same, except for the larger torque.
#[test]
fn the_same_scale_of_thrust_and_mass_gives_the_same_fall() {
    let mut problem = problem(nominal_start(), HORIZON);
    problem.model.params.drag_per_m = 0.0;
    let heavy = Trajectory::of(&problem, &[0.0; 50]);
    problem.mass_kg = vec![1.5; 50];
    problem.thrust_n.fill(0.5 * 33.3);
    let light = Trajectory::of(&problem, &[0.0; 50]);
    for (one, other) in heavy.states.iter().zip(&light.states) {
        assert!((one[1] - other[1]).abs() < 1e-12, "{one:?} {other:?}");
    }
}

#[test]
fn resampling_by_whole_intervals_equals_a_shift() {
    let problem = Problem { altitude_min_m: Some(0.0), ..settled(nominal_start(), HORIZON) };
    let solution = solve(&problem, None);
    for steps in [0, 1, 7, 30] {
        let mut shifted = solution.shifted(steps);
        let resampled = solution.resampled(0.1 * steps as f64, 0.1, 50 - steps);
        // The first costate has no meaning, and the floor's multipliers stop before the end.
        shifted.costates[0] = resampled.costates[0];
        assert_eq!(shifted, resampled, "{steps}");
    }
}

/// With another final time or another number of nodes, from half an interval on, a warm solve needs fewer iterations
/// than a cold one and reaches the cost of the best cold solve.
#[test]
fn a_resampled_start_converges_to_the_cold_solution() {
    let first = solve(&settled(nominal_start(), HORIZON), None);
    for (steps, intervals, step_s) in [(6, 43, 0.1023), (6, 44, 0.0995), (10, 38, 0.105), (20, 25, 0.12)] {
        let start = first.states[steps];
        let from_s = 0.1 * steps as f64;
        let mut problem = settled(start, intervals);
        problem.step_s = step_s;

        let warm = solve(&problem, Some(&first.resampled(from_s, step_s, intervals)));
        let cold = solve(&problem, None);
        println!("{intervals} x {step_s}: {} iterations warm, {} cold", warm.iterations, cold.iterations);
        assert_eq!(warm.status, SolveStatus::Converged, "{intervals} x {step_s}");
        assert!(warm.iterations < cold.iterations / 2, "{} {}", warm.iterations, cold.iterations);
        assert!(warm.merit < 1.02 * cold.merit, "{} {}", warm.merit, cold.merit);
    }
}

#[test]
fn a_resampled_empty_solution_is_empty() {
    assert_eq!(Solution::default().resampled(0.0, 0.1, 10), WarmStart::default());
    let solution = solve(&problem(nominal_start(), HORIZON), None);
    for (from_s, step_s) in [(f64::NAN, 0.1), (0.0, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.1)] {
        assert_eq!(solution.resampled(from_s, step_s, 10), WarmStart::default());
    }
}
