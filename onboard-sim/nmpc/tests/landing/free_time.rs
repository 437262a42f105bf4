//! Landings with a free final time on a real motor.

use super::*;
use nmpc::FinalBox;
use nmpc::free_time::{
    FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, falls_through_weight_s, solve_free_time,
    solve_free_time_into,
};

/// The vehicle of the study: mass with its motor full, and `Cx S`.
const FULL_MASS_KG: f64 = 3.13;
const DRAG_AREA_M2: f64 = 0.031;
const AIR_KG_M3: f64 = 1.225;

/// Thrust interpolated between the points of a curve, times a scale; propellant burns in proportion to the impulse.
struct Curve {
    points: Vec<(f64, f64)>,
    propellant_kg: f64,
    scale: f64,
    /// The present time since ignition, s.
    now_s: f64,
}

impl Curve {
    fn h45(scale: f64) -> Self {
        let file = include_str!("../../../flight/vehicles/motors/AeroTech_H45.eng");
        let mut rows = file.lines().filter(|line| !line.starts_with(';')).map(|line| {
            line.split_whitespace().filter_map(|word| word.parse::<f64>().ok()).collect::<Vec<_>>()
        });
        // Diameter, length, delay, propellant and total mass; the name is not a number.
        let propellant_kg = rows.next().unwrap()[3];
        let mut points = vec![(0.0, 0.0)];
        points.extend(rows.filter(|row| row.len() == 2).map(|row| (row[0], row[1])));
        Self { points, propellant_kg, scale, now_s: 0.0 }
    }

    /// Impulse from ignition on at scale 1, N s.
    fn impulse_n_s(&self, until_s: f64) -> f64 {
        let mut impulse = 0.0;
        for pair in self.points.windows(2) {
            let ((from_s, from_n), (to_s, to_n)) = (pair[0], pair[1]);
            let end_s = until_s.clamp(from_s, to_s);
            let end_n = from_n + (to_n - from_n) * (end_s - from_s) / (to_s - from_s);
            impulse += 0.5 * (from_n + end_n) * (end_s - from_s);
        }
        impulse
    }
}

impl Motor for Curve {
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        let (from, to) = (self.impulse_n_s(self.now_s + from_s), self.impulse_n_s(self.now_s + to_s));
        self.scale * (to - from) / (to_s - from_s)
    }

    fn mean_mass_kg(&self, from_s: f64, to_s: f64) -> f64 {
        let middle = self.impulse_n_s(self.now_s + 0.5 * (from_s + to_s));
        FULL_MASS_KG - self.propellant_kg * middle / self.impulse_n_s(f64::INFINITY)
    }
}

/// The ignition of the study: 66 m, 40.2 m/s, tail first.
fn study(gimbal_deg: f64) -> FreeTimeProblem {
    let start = PlanarState { z_m: 66.0, u_m_s: -40.2, ..nominal_start() };
    let mut landing = settled(start, HORIZON);
    landing.model.params.mass_kg = FULL_MASS_KG;
    landing.model.params.drag_per_m = AIR_KG_M3 * DRAG_AREA_M2 / (2.0 * FULL_MASS_KG);
    landing.gimbal_limit_rad = gimbal_deg.to_radians();
    landing.state_weights = [0.5, 0.0, 30.0, 0.0, 5.0, 30.0];
    landing.input_weight = 10.0;
    landing.altitude_min_m = Some(0.0);
    landing.final_box = Some(FinalBox {
        settled_nodes: 2,
        pitch_error_deg: 1.0,
        u_min_m_s: -0.2,
        u_max_m_s: -0.1,
        w_m_s: 0.03,
        pitch_rate_deg_s: 1.0,
    });
    FreeTimeProblem {
        landing,
        intervals: 44,
        earliest_s: 0.1,
        latest_s: 5.2,
        target_drift_m_s: 0.0,
        max_solves: 12,
    }
}

fn describe(scale: f64, found: &FreeTimeSolution) -> String {
    let solution = &found.solution;
    let end = solution.states.last();
    let tilt = solution
        .states
        .iter()
        .fold(0.0_f64, |most, state| most.max((state.theta_rad.to_degrees() - 90.0).abs()));
    format!(
        "{scale}: {:?} at {:.4} s (earliest {:.4}), J = {:.2}, merit {:.2}, slope {:.2}, {} solves, {} iterations, \
         miss {:.1e}, tilt {tilt:.0} deg, x {:?}, u {:?}",
        solution.status,
        found.final_time_s,
        found.earliest_s,
        solution.cost,
        solution.merit,
        found.merit_slope,
        found.solves,
        solution.iterations,
        solution.condition_miss,
        end.map(|end| end.x_m),
        end.map(|end| end.u_m_s),
    )
}

/// Scales of thrust that land in the study, for its two gimbals.
const STUDY: [(f64, [f64; 6]); 2] =
    [(20.0, [0.94, 0.97, 1.0, 1.03, 1.06, 1.08]), (7.0, [0.95, 0.97, 1.0, 1.03, 1.06, 1.07])];

/// The study's landings touch down 4.3 to 4.5 s after ignition (to its two digits) at about -0.15 m/s, and never before
/// the thrust is below the weight.
#[test]
fn val_solver_study_real_motor_lands_over_a_range_of_thrust() {
    for (gimbal_deg, scales) in STUDY {
        for scale in scales {
            let motor = Curve::h45(scale);
            let found = solve_free_time(&study(gimbal_deg), &motor, None);
            let told = format!("{gimbal_deg} deg, {}", describe(scale, &found));
            println!("{told}");
            assert!(found.lands(), "{told}");
            assert!((4.25..4.55).contains(&found.final_time_s), "{told}");
            let end = found.solution.states.last().unwrap();
            assert!((-0.201..-0.099).contains(&end.u_m_s) && end.w_m_s.abs() < 0.031, "{told}");
            assert!((end.theta_rad.to_degrees() - 90.0).abs() < 1.001, "{told}");
            assert!(found.solution.states.iter().all(|state| state.z_m > -1e-6), "{told}");
            let at_s = found.final_time_s;
            let weight_n = 9.81 * motor.mean_mass_kg(at_s, at_s + 1e-3);
            assert!(motor.mean_thrust_n(at_s, at_s + 1e-3) < weight_n + 0.01, "{told}");
        }
    }
}

/// The best merit at a fixed final time.
fn merit_at(problem: &FreeTimeProblem, motor: &Curve, at_s: f64, from: &FreeTimeSolution) -> f64 {
    let fixed = FreeTimeProblem { earliest_s: at_s, latest_s: at_s, ..problem.clone() };
    let found = solve_free_time(&fixed, motor, Some((from, 0.0)));
    assert_eq!(found.solution.status, SolveStatus::Converged);
    assert!((found.final_time_s - at_s).abs() < 1e-12);
    found.solution.merit
}

#[test]
fn val_finite_differences_slope_of_the_merit() {
    const H: f64 = 2e-3;
    let motor = Curve::h45(1.0);
    let mut problem = study(20.0);
    problem.target_drift_m_s = -2.0;
    problem.landing.target = PlanarState { x_m: 12.0, w_m_s: -2.0, ..problem.landing.target };
    problem.landing.x_final_m = 0.5;
    problem.max_solves = 1;
    for at_s in [4.42, 4.6] {
        problem.earliest_s = at_s;
        let found = solve_free_time(&problem, &motor, None);
        assert_eq!(found.solution.status, SolveStatus::Converged);
        let ahead = merit_at(&problem, &motor, at_s + H, &found);
        let behind = merit_at(&problem, &motor, at_s - H, &found);
        let expected = (ahead - behind) / (2.0 * H);
        let error = (found.merit_slope - expected).abs();
        println!("slope at {at_s} s: {} and {expected}", found.merit_slope);
        assert!(error < 1e-2 * (1.0 + expected.abs()), "{} {expected}", found.merit_slope);
    }
}

/// A new plan every 0.1 s from the vehicle's state, in at most three solves. The vehicle flies the real curve within
/// each interval, where the plan has the mean. The merit is flat near the best end, so the end moves a little.
#[test]
fn a_whole_landing_planned_warm_ends_as_the_first_plan_predicts() {
    for scale in [0.95, 1.0, 1.07] {
        let mut motor = Curve::h45(scale);
        let mut problem = study(7.0);
        let mut plan = solve_free_time(&problem, &motor, None);
        let (planned_s, mut most_iterations) = (plan.final_time_s, 0);
        problem.max_solves = 3;
        let mut state = problem.landing.initial;
        let mut ends_s = plan.final_time_s;
        while ends_s - motor.now_s > 0.15 {
            let from = motor.now_s;
            state = flown(&problem, &plan, &mut motor, state, 0.1);
            problem.landing.initial = state;
            problem.latest_s = 5.2 - motor.now_s;
            problem.intervals = ((ends_s - motor.now_s) / 0.1).round().max(1.0) as usize;
            plan = solve_free_time(&problem, &motor, Some((&plan, motor.now_s - from)));
            assert_eq!(plan.solution.status, SolveStatus::Converged, "{scale} after {}", motor.now_s);
            most_iterations = most_iterations.max(plan.solution.iterations);
            ends_s = motor.now_s + plan.final_time_s;
        }
        let left_s = plan.final_time_s;
        state = flown(&problem, &plan, &mut motor, state, left_s);
        println!(
            "{scale}: ends at {ends_s:.3} s, planned {planned_s:.3}, {most_iterations} iterations: {state:?}"
        );
        assert!((ends_s - planned_s).abs() < 0.1, "{scale}: {ends_s} {planned_s}");
        assert!(state.z_m.abs() < 0.02 && (-0.3..0.0).contains(&state.u_m_s), "{scale}: {state:?}");
        assert!(state.w_m_s.abs() < 0.05 && state.q_rad_s.abs() < 0.05, "{scale}: {state:?}");
        assert!((state.theta_rad.to_degrees() - 90.0).abs() < 1.2, "{scale}: {state:?}");
    }
}

/// The state after some seconds of a plan, integrated in small steps with the curve itself.
fn flown(
    problem: &FreeTimeProblem,
    plan: &FreeTimeSolution,
    motor: &mut Curve,
    mut state: PlanarState,
    seconds: f64,
) -> PlanarState {
    const STEPS: u32 = 200;
    let step_s = seconds / f64::from(STEPS);
    for step in 0..STEPS {
        let at_s = f64::from(step) * step_s;
        let interval = (((at_s + 0.5 * step_s) / plan.solution.step_s) as usize).min(problem.intervals);
        let inputs = &plan.solution.inputs_rad;
        let gimbal_rad = inputs[interval.min(inputs.len() - 1)];
        let model = problem.landing.model.with_mass(motor.mean_mass_kg(at_s, at_s + step_s));
        state = model.rk4_step(&state, gimbal_rad, motor.mean_thrust_n(at_s, at_s + step_s), step_s);
    }
    motor.now_s += seconds;
    state
}

#[test]
fn the_fall_of_a_thrust_ramp_through_the_weight_is_at_the_exact_time() {
    /// 50 N, falling by 10 N/s, under a weight of 30 N.
    struct Ramp;
    impl Motor for Ramp {
        fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
            50.0 - 5.0 * (from_s + to_s)
        }
        fn mean_mass_kg(&self, _: f64, _: f64) -> f64 {
            3.0
        }
    }
    for (span, expected_s) in [((0.5, 4.0), 2.0), ((2.5, 4.0), 2.5), ((0.5, 1.5), 1.5)] {
        let found_s = falls_through_weight_s(&Ramp, 10.0, span);
        assert!((found_s - expected_s).abs() < 1e-3, "{span:?}: {found_s}");
    }
}

#[test]
fn a_used_workspace_gives_the_same_bits_for_the_same_search() {
    let (problem, motor) = (study(20.0), Curve::h45(1.0));
    let fresh = solve_free_time(&problem, &motor, None);
    let (mut workspace, mut found) = (FreeTimeWorkspace::default(), FreeTimeSolution::default());
    for scale in [0.95, 1.05, 1.0] {
        solve_free_time_into(&problem, &Curve::h45(scale), None, &mut workspace, &mut found);
    }
    assert_eq!(format!("{fresh:?}"), format!("{found:?}"));
}

#[test]
fn an_impossible_span_or_a_bad_number_gives_a_status() {
    let motor = Curve::h45(1.0);
    let good = study(20.0);
    for bad in [
        FreeTimeProblem { earliest_s: 0.0, ..good.clone() },
        FreeTimeProblem { latest_s: 0.05, ..good.clone() },
        FreeTimeProblem { latest_s: f64::NAN, ..good.clone() },
        FreeTimeProblem { intervals: 0, ..good.clone() },
        FreeTimeProblem { target_drift_m_s: f64::INFINITY, ..good.clone() },
    ] {
        let found = solve_free_time(&bad, &motor, None);
        assert_eq!(found.solution.status, SolveStatus::BadInput, "{bad:?}");
    }
    let nowhere = PlanarState { z_m: f64::NAN, ..good.landing.initial };
    let landing = Problem { initial: nowhere, ..good.landing.clone() };
    let found = solve_free_time(&FreeTimeProblem { landing, ..good }, &motor, None);
    assert_eq!(found.solution.status, SolveStatus::BadInput);
}
