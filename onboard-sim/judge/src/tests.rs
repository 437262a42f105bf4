use super::*;
use crate::landing::{Column, Tangent};
use ocp::landing::{Drag, End, Push, SolverLimits, Weights, Workspace};

#[path = "../../ocp/src/landing/tests/problem.rs"]
mod problem;

use problem::{GRAVITY_M_S2, problem};

/// The landing of 2.0 has two optima whose merits differ by 0.2 %: there each solver finds another
/// one.
#[test]
fn val_flying_solver_agrees_with_the_guesses_of_the_judge() {
    for (thrust_over_weight, sideways_m_s, optima) in
        [(1.4, 0.0, 1), (1.6, 1.0, 1), (1.8, -1.0, 1), (2.0, 0.0, 2)]
    {
        let mut model = problem(thrust_over_weight);
        model.initial[4] += sideways_m_s;
        // The comparison is nearer to the optimum than a flown plan must be.
        model.solver.kkt_tolerance = 1e-8;
        let mut workspace = Workspace::default();
        ocp::landing::solve(&mut workspace, &model, None);
        let flown = score(&model, workspace.states(), workspace.inputs());
        let judged = solve(&model, None);
        let case = format!("{thrust_over_weight} {sideways_m_s}: {flown:?} {:?}", judged.score);
        assert!(judged.converged, "{case}");
        assert!(flown.defect < 1e-9, "{case}");
        assert!((judged.score.cost / flown.cost - 1.0).abs() < 0.01, "{case}");
        assert!((judged.score.merit / flown.merit - 1.0).abs() < 0.01, "{case}");
        let same = (judged.score.merit / flown.merit - 1.0).abs() < 1e-4;
        assert!(same || optima > 1, "{case}");
        for (judged_rad, flown_rad) in judged.inputs[0].iter().zip(&workspace.inputs()[0]).take(2) {
            assert!(!same || (judged_rad - flown_rad).abs() < 0.5_f64.to_radians(), "{case}");
        }
    }
}

#[test]
fn a_given_optimum_is_left_as_it_is() {
    let model = problem(1.8);
    let mut workspace = Workspace::default();
    let outcome = ocp::landing::solve(&mut workspace, &model, None);
    let search = Search::of(&model);
    let given = nodes(&model, workspace.states(), workspace.inputs()).unwrap();
    let end = search.descend(given);
    let found = scored(&model, &search.ranges, &end.nodes);
    assert!(end.converged && end.iterations <= 4, "{}", end.iterations);
    assert!((found.merit / outcome.merit - 1.0).abs() < 1e-6, "{found:?} {outcome:?}");
}

/// Without air, with a constant thrust that stops the fall exactly at the ground.
fn braking() -> Problem {
    let mut model = problem(1.0);
    // From 10 m at 10 m/s in 2 s.
    model.initial = [0.0, 0.0, 10.0, 0.0, 0.0, -10.0, 0.0, 0.0, 0.0, 0.0];
    let push = Push { thrust_m_s2: GRAVITY_M_S2 + 5.0, turning_rad_s2: 60.0, per_kg: 1.0 };
    Problem {
        pushes: vec![push; 20],
        drag: Drag { fins: 0.0, axial: 0.0, crossflow: 0.0 },
        end: End { vertical_m_s: [-0.1, 0.1], ..model.end },
        floor_rise_m_s: 0.0,
        ..model
    }
}

#[test]
fn val_kinematics_a_braked_fall_costs_nothing_upright() {
    let judged = solve(&braking(), None);
    assert!(judged.converged, "{judged:?}");
    assert!(judged.score.merit < 1e-4, "{:?}", judged.score);
    for (k, state) in judged.states.iter().enumerate() {
        let t = 0.1 * k as f64;
        assert!((state[2] - (10.0 - 10.0 * t + 2.5 * t * t)).abs() < 1e-5, "{k}: {state:?}");
        assert!((state[5] - (5.0 * t - 10.0)).abs() < 1e-5, "{k}: {state:?}");
    }
}

#[test]
fn val_kinematics_a_weaker_motor_misses_the_ground_by_what_it_lacks() {
    // 4 m/s^2 instead of 5: after 2 s it is 2 m too low, and 2 m/s too fast.
    let mut model = braking();
    for push in &mut model.pushes {
        push.thrust_m_s2 -= 1.0;
    }
    let judged = solve(&model, None);
    let Score { worst, miss, cost, merit, .. } = judged.score;
    assert_eq!(worst, Some(("height at the end", 20)));
    assert!((miss - 2.0).abs() < 1e-6, "{miss}");
    // Below the ground too early: 10 - 10 t + 2 t^2 < 0 from node 14 on.
    let height_m = |k: usize| 10.0 - k as f64 + 0.02 * (k * k) as f64;
    let floor_m: f64 = (1..20).map(|k| (-height_m(k)).max(0.0)).sum();
    let missed = 2.0 + (2.0 - 0.1) + floor_m;
    assert!(cost < 1e-6 && (merit / 1000.0 - missed).abs() < 1e-4, "{merit} {missed}");
}

#[test]
fn a_score_names_the_worst_miss_and_finds_defects() {
    let model = braking();
    let Judgement { mut states, inputs, .. } = solve(&model, None);
    states[7][6] = 1.0;
    let judged = score(&model, &states, &inputs);
    assert_eq!(judged.worst, Some(("lean towards x", 7)));
    assert!((judged.miss - (1.0 - 50.0_f64.to_radians())).abs() < 1e-12, "{judged:?}");
    // The next interval begins with this lean.
    assert!(judged.defect > 0.99, "{judged:?}");
    assert!(score(&model, &states[1..], &inputs).merit.is_nan());
}

#[test]
fn an_unsolvable_problem_is_reported() {
    let mut model = braking();
    model.wind_m_s[0] = f64::NAN;
    let Judgement { converged, score, .. } = solve(&model, None);
    assert!(!converged && score.merit.is_nan(), "{score:?}");
    model.pushes.clear();
    let Judgement { converged, score, states, .. } = solve(&model, None);
    assert!(!converged && score.merit.is_nan() && states.is_empty(), "{score:?}");
}

/// A state and an input away from rest.
const SOMEWHERE: [f64; landing::BOTH] =
    [0.3, 0.2, 9.0, 2.0, -1.5, -6.0, 0.5, -0.4, 0.9, -1.1, 0.03, -0.05, 0.4];

#[test]
fn val_finite_differences_derivatives_of_an_interval() {
    const CHANGE: f64 = 1e-6;
    let model = problem(1.6);
    let costate = Column::from([1.0, -2.0, 3.0, 0.5, 1.5, -2.5, 0.7, -0.6, 0.8, 1.2]);
    let at = |j: usize, change: f64| {
        let mut node = Node::from(SOMEWHERE);
        node[j] += change;
        (Column::from(after(&model, 3, node.as_ref())), Tangent::at(&model, 3, &node, &costate))
    };
    let (end, exact) = at(0, 0.0);
    assert_eq!(end, exact.end);
    for j in 0..landing::BOTH {
        let ((ahead, ahead_tangent), (behind, behind_tangent)) = (at(j, CHANGE), at(j, -CHANGE));
        let slope = (ahead - behind) / (2.0 * CHANGE);
        assert!((slope - exact.by.column(j)).amax() < 1e-7, "{j}: {slope}");
        let bent = (ahead_tangent.by - behind_tangent.by).transpose() * costate / (2.0 * CHANGE);
        assert!((bent - exact.bend.column(j)).amax() < 1e-6, "{j}: {bent}");
    }
}
