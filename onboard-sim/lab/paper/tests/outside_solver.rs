//! Compares our solutions with those of an independent solver, `CasADi` with IPOPT, on the landing
//! paper's own problem.
#![expect(clippy::unwrap_used, reason = "a table that cannot be read is a failed test")]

use paper::plane::dynamics::PlanarState;
use paper::plane::solve;
use paper::problem::{HORIZON, problem, start};

/// The table; its header says how it was made.
const TABLE: &str = include_str!("data/casadi_ipopt.csv");

struct Row {
    start: PlanarState,
    cost: f64,
    end: PlanarState,
}

fn rows() -> Vec<Row> {
    let lines = TABLE.lines().filter(|line| !line.starts_with(['#', 'p']));
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        let &[pitch_deg, w_m_s, q_deg_s, cost, ref end @ ..] = numbers.as_slice() else { panic!("{line}") };
        let start = PlanarState {
            theta_rad: pitch_deg.to_radians(),
            w_m_s,
            q_rad_s: q_deg_s.to_radians(),
            ..start()
        };
        Row { start, cost, end: PlanarState::from_array(end.try_into().unwrap()) }
    };
    lines.map(row).collect()
}

/// The mirror image about the vertical: the same landing seen from the other side.
fn mirrored(state: &PlanarState) -> PlanarState {
    PlanarState {
        x_m: -state.x_m,
        theta_rad: core::f64::consts::PI - state.theta_rad,
        w_m_s: -state.w_m_s,
        q_rad_s: -state.q_rad_s,
        ..*state
    }
}

fn distance(left: &PlanarState, right: &PlanarState) -> f64 {
    left.to_array().iter().zip(right.to_array()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn val_casadi_ipopt_costs_and_final_states() {
    let rows = rows();
    assert_eq!(rows.len(), 7);
    for row in rows {
        let solution = solve(&problem(row.start, HORIZON), None);
        assert!(solution.converged(), "{:?}", row.start);
        // Both stop at residuals of 1e-6 or below. Costs agree to the square of that, states to its
        // order.
        let (cost, end) = (solution.outcome.cost, solution.end());
        assert!((cost - row.cost).abs() < 1e-5, "{:?}: {cost} and {}", row.start, row.cost);
        // A start that is its own mirror image has two landings with the same cost.
        let symmetric = distance(&row.start, &mirrored(&row.start)) < 1e-12;
        let apart = distance(&end, &row.end);
        let apart = if symmetric { apart.min(distance(&mirrored(&end), &row.end)) } else { apart };
        assert!(apart < 1e-4, "{:?}: {end:?} and {:?}", row.start, row.end);
    }
}
