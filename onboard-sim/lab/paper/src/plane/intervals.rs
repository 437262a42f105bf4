//! The planar dynamics in every interval, with exact first and second derivatives.
//!
//! Only five directions matter: pitch, velocity, pitch rate and the gimbal angle. Nothing depends
//! on the position.

use core::array::from_fn;

use ocp::{DenseIntervals, Hessian, add_multiple};

use crate::plane::Problem;
use crate::plane::dynamics::{AHEAD, Motion, WEIGHTS, end};

/// The variables that the rates of the state depend on: pitch, both velocities, pitch rate, gimbal
/// angle.
const DIRECTIONS: usize = 5;
/// Index of the first state among the directions.
const FIRST: usize = 2;
/// Index of the gimbal angle among the directions.
const GIMBAL: usize = 4;

/// Evaluates every interval, with tangents and curvature on request.
pub(super) fn evaluate(
    problem: &Problem,
    states: &[[f64; 6]],
    inputs_rad: &[[f64; 1]],
    costates: &[[f64; 6]],
    derivatives: bool,
    intervals: &mut DenseIntervals<6, 1>,
) {
    let h = problem.step_s;
    for (k, interval) in intervals.0.iter_mut().enumerate() {
        let ([gimbal_rad], state, costate) = (inputs_rad[k], &states[k], &costates[k + 1]);
        let stages = problem.model.stages(state, gimbal_rad, problem.thrust_n, h);
        interval.end = end(state, &stages, h);
        let jacobians = stages.each_ref().map(Motion::by_directions);

        // Backwards: the derivative of the result with respect to each stage's rates, and to each
        // direction of its state.
        let mut worth = [[0.0; 6]; 4];
        let (mut later, mut pulled) = ([0.0; DIRECTIONS], [0.0; DIRECTIONS]);
        for stage in (0..4).rev() {
            worth[stage] = costate.map(|value| value * WEIGHTS[stage] * h);
            if let Some(ahead) = AHEAD.get(stage + 1) {
                for i in 0..GIMBAL {
                    worth[stage][FIRST + i] += later[i] * ahead * h;
                }
            }
            later = [0.0; DIRECTIONS];
            for (worth, row) in worth[stage].iter().zip(&jacobians[stage]) {
                add_multiple(&mut later, *worth, row);
            }
            add_multiple(&mut pulled, 1.0, &later);
        }
        interval.pulled_x = from_fn(|i| costate[i] + if i < FIRST { 0.0 } else { pulled[i - FIRST] });
        interval.pulled_u = [pulled[GIMBAL]];
        if !derivatives {
            continue;
        }

        // Forwards: how each stage's directions move with those of the first, and how the rates do.
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        let mut moved: [[f64; DIRECTIONS]; DIRECTIONS] = from_fn(|i| from_fn(|j| unit(i, j)));
        let mut sums = [[0.0; DIRECTIONS]; 6];
        let mut bent = [[0.0; DIRECTIONS]; DIRECTIONS];
        for stage in 0..4 {
            let curvature = stages[stage].bent(&worth[stage]);
            let curved = product(&curvature, &moved);
            for (moved, curved) in moved.iter().zip(&curved) {
                for (sum, factor) in bent.iter_mut().zip(moved) {
                    add_multiple(sum, *factor, curved);
                }
            }
            let tangent = product(&jacobians[stage], &moved);
            for (sum, row) in sums.iter_mut().zip(&tangent) {
                add_multiple(sum, WEIGHTS[stage] * h, row);
            }
            if let Some(ahead) = AHEAD.get(stage + 1) {
                for i in 0..GIMBAL {
                    moved[i] = from_fn(|j| unit(i, j) + ahead * h * tangent[FIRST + i][j]);
                }
            }
        }
        interval.a = from_fn(|i| from_fn(|j| unit(i, j) + if j < FIRST { 0.0 } else { sums[i][j - FIRST] }));
        interval.b = sums.map(|row| [row[GIMBAL]]);
        let of_states = |row: &[f64; DIRECTIONS]| from_fn(|j| if j < FIRST { 0.0 } else { row[j - FIRST] });
        interval.curvature = Hessian {
            xx: from_fn(|i| if i < FIRST { [0.0; 6] } else { of_states(&bent[i - FIRST]) }),
            ux: [of_states(&bent[GIMBAL])],
            uu: [[bent[GIMBAL][GIMBAL]]],
        };
    }
}

/// A matrix times the directions of a stage.
fn product<const ROWS: usize>(
    matrix: &[[f64; DIRECTIONS]; ROWS],
    moved: &[[f64; DIRECTIONS]; DIRECTIONS],
) -> [[f64; DIRECTIONS]; ROWS] {
    matrix.map(|row| {
        let mut sum = [0.0; DIRECTIONS];
        row.iter().zip(moved).for_each(|(factor, moved)| add_multiple(&mut sum, *factor, moved));
        sum
    })
}
