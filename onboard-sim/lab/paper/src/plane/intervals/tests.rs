use ocp::{Dense, Feedback, Hessian, Interval, Intervals, Stage, Value};
use proptest::prelude::*;
use pulp::{Scalar, Simd, WithSimd};

use super::*;
use crate::plane::dynamics::PlanarState;
use crate::problem::{self, THRUST_N};

const STEP_S: f64 = 0.1;

/// State, gimbal angle and costate.
type Point = ([f64; 6], f64, [f64; 6]);

/// Both kinds of the paper's vehicle.
fn models() -> [PlanarModel; 2] {
    [ModelKind::Consistent, ModelKind::AsPrinted].map(|kind| PlanarModel { kind, ..problem::model() })
}

/// Evaluates the interval in every lane and returns the last lane's result.
fn block(model: &PlanarModel, (state, gimbal, costate): &Point) -> Block {
    let constants = Constants::of(model, THRUST_N, STEP_S);
    let points = Points {
        state: state.map(Lanes::splat),
        gimbal: Lanes::splat(*gimbal),
        costate: costate.map(Lanes::splat),
    };
    let mut block = Block::EMPTY;
    if constants.printed {
        evaluate::<true, true>(&constants, &points, &mut block);
    } else {
        evaluate::<true, false>(&constants, &points, &mut block);
    }
    block
}

/// The index of a direction of differentiation among the states, or the gimbal angle.
fn moved((state, gimbal, costate): &Point, direction: usize, by: f64) -> Point {
    let (mut state, mut gimbal) = (*state, *gimbal);
    match state.get_mut(direction + 2) {
        Some(component) => *component += by,
        None => gimbal += by,
    }
    (state, gimbal, *costate)
}

/// The model's own step, with its own sine and cosine.
fn step(model: &PlanarModel, (state, gimbal, _): &Point) -> [f64; 6] {
    model.rk4_step(&PlanarState::from_array(*state), *gimbal, THRUST_N, STEP_S).to_array()
}

fn point() -> impl Strategy<Value = Point> {
    let state = (-20.0..20.0, 0.0..20.0, 0.5..2.6, -6.0..-1.0, -3.0..3.0, -1.0..1.0, -0.34..0.34);
    (state, prop::array::uniform6(-50.0..50.0_f64))
        .prop_map(|((x, z, theta, u, w, q, gimbal), costate)| ([x, z, theta, u, w, q], gimbal, costate))
}

proptest! {
    #[test]
    fn val_planar_model_step(point in point()) {
        for model in &models() {
            let block = block(model, &point);
            for (value, expected) in block.after.iter().zip(step(model, &point)) {
                let error = (value.0[LANES - 1] - expected).abs();
                prop_assert!(error < 1e-13 * (1.0 + expected.abs()), "{error}");
            }
        }
    }

    #[test]
    fn val_finite_differences_tangent_and_adjoint(point in point()) {
        const H: f64 = 1e-5;
        for model in &models() {
            let block = block(model, &point);
            for j in 0..DIRECTIONS {
                let (ahead, behind) = (step(model, &moved(&point, j, H)), step(model, &moved(&point, j, -H)));
                let column: [f64; 6] = core::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * H));
                for (row, state) in [0, 1, 3, 4].into_iter().enumerate() {
                    let error = (block.tangent[row][j].0[0] - column[state]).abs();
                    prop_assert!(error < 1e-8 * (1.0 + column[state].abs()), "[{row}][{j}] {error}");
                }
                let expected: f64 = column.iter().zip(&point.2).map(|(slope, weight)| slope * weight).sum();
                prop_assert!((block.pulled[j].0[0] - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{j}");
            }
            let turn = (step(model, &moved(&point, 4, H))[5] - step(model, &moved(&point, 4, -H))[5]) / (2.0 * H);
            prop_assert!((block.turn.0[0] - turn).abs() < 1e-8 * (1.0 + turn.abs()));
        }
    }

    #[test]
    fn val_finite_differences_curvature(point in point()) {
        const H: f64 = 1e-5;
        for model in &models() {
            let curvature = block(model, &point).curvature;
            for column in 0..DIRECTIONS {
                let ahead = block(model, &moved(&point, column, H)).pulled;
                let behind = block(model, &moved(&point, column, -H)).pulled;
                for row in 0..=column {
                    let expected = (ahead[row].0[0] - behind[row].0[0]) / (2.0 * H);
                    let error = (curvature[pair(row, column)].0[0] - expected).abs();
                    prop_assert!(error < 1e-5 * (1.0 + expected.abs()), "[{row}][{column}] {error}");
                }
            }
        }
    }
}

/// A matrix of numbers from -1 to 1.
fn symmetric() -> impl Strategy<Value = [[f64; 6]; 6]> {
    prop::array::uniform6(prop::array::uniform6(-1.0..1.0_f64))
        .prop_map(|half| from_fn(|i| from_fn(|j| half[i][j] + half[j][i])))
}

/// A stage with the elements that a solve gives it.
fn stage<'a>(
    own: &'a ([f64; 6], [f64; 6]),
    input: &'a ([f64; 1], [f64; 1]),
) -> Stage<'a, [f64; 6], [f64; 1], 6, 1> {
    let defect = [0.02, -0.01, 0.03, 0.1, -0.2, 0.05];
    Stage { defect, share: 0.5, state_terms: (&own.0, &own.1), input_terms: (&input.0, &input.1) }
}

/// Eliminates an interval in the vectors that it is dispatched to.
struct Eliminate<'a> {
    rows: &'a Rows<'a>,
    stage: &'a Stage<'a, [f64; 6], [f64; 1], 6, 1>,
    after: &'a Split,
    slope: [f64; 6],
}

impl WithSimd for Eliminate<'_> {
    type Output = Option<(Split, [f64; 6], Feedback<6, 1>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Self::Output {
        let mut before = Split::ZERO;
        let feedback = self.rows.eliminate(simd, self.stage, self.after, &mut before, &mut self.slope)?;
        Some((before, self.slope, feedback))
    }
}

proptest! {
    /// The columns of `A` and `b` are the pushed unit vectors, those of the curvature the curved ones.
    #[test]
    fn the_rows_pull_and_eliminate_as_the_matrices_that_they_stand_for(point in point(), p in symmetric()) {
        let unit = |i: usize| from_fn(|j| f64::from(u8::from(i == j)));
        for model in &models() {
            let block = block(model, &point);
            let mut lines = [Line::EMPTY; LANES];
            super::rows::write(&block, &mut lines);
            let rows = Rows::of(&block, &lines[1], 1, STEP_S);
            let columns: [[f64; 6]; 7] = from_fn(|j| match j {
                6 => rows.push(&[0.0; 6], &[1.0]),
                _ => rows.push(&unit(j), &[0.0]),
            });
            let curved: [[f64; 7]; 7] = from_fn(|j| {
                let (by_state, [by_input]) = match j {
                    6 => rows.curve(1.0, &[0.0; 6], &[1.0]),
                    _ => rows.curve(1.0, &unit(j), &[0.0]),
                };
                from_fn(|i| *by_state.get(i).unwrap_or(&by_input))
            });
            let curvature = Hessian {
                xx: from_fn(|i| from_fn(|j| curved[j][i])),
                ux: [from_fn(|j| curved[j][6])],
                uu: [[curved[6][6]]],
            };
            let dense = Dense {
                end: [0.0; 6],
                pulled_x: [0.0; 6],
                pulled_u: [0.0; 1],
                a: from_fn(|i| from_fn(|j| columns[j][i])),
                b: from_fn(|i| [columns[6][i]]),
                curvature,
            };
            let close = |one: f64, other: f64| (one - other).abs() < 1e-9 * (1.0 + other.abs());
            let (pulled, [pulled_input]) = rows.pull(&point.2);
            let (expected, [expected_input]) = (&dense).pull(&point.2);
            for (one, other) in pulled.iter().chain([&pulled_input]).zip(expected.iter().chain([&expected_input])) {
                prop_assert!(close(*one, *other), "{one} {other}");
            }

            let (own, input) = (([1.0, 0.0, 2.0, 0.5, 0.1, 0.3], [0.2; 6]), ([2e4], [-3.0]));
            let (stage, mut after) = (stage(&own, &input), Split::ZERO);
            for (i, row) in p.iter().enumerate() {
                let [x, z, last @ ..] = *row;
                (after.x[i], after.z[i], after.rest[i]) = (x, z, Lanes(last));
            }
            let slope = point.2;
            let whole = Arch::new().dispatch(Eliminate { rows: &rows, stage: &stage, after: &after, slope });
            let plain = Eliminate { rows: &rows, stage: &stage, after: &after, slope }.with_simd(Scalar);
            prop_assert_eq!(whole, plain, "the width of the vectors changes a bit");
            let (found, found_slope, found_feedback) = plain.expect("a large curvature by the input");
            let (mut before, mut slope) = ([[0.0; 6]; 6], slope);
            let feedback = (&dense).eliminate(Scalar, &stage, &p, &mut before, &mut slope);
            let feedback = feedback.expect("the same curvature");
            for (i, row) in before.iter().enumerate() {
                for (one, other) in found.row(i).iter().zip(row) {
                    prop_assert!(close(*one, *other), "row {i}: {one} {other}");
                }
            }
            let found = found_slope.iter().chain(&found_feedback.gain[0]).chain(&found_feedback.offset);
            let expected = slope.iter().chain(&feedback.gain[0]).chain(&feedback.offset);
            for (one, other) in found.chain(&found_feedback.reduced[0]).zip(expected.chain(&feedback.reduced[0])) {
                prop_assert!(close(*one, *other), "{one} {other}");
            }
        }
    }
}

/// Compares the intervals in this machine's widest vectors with those in plain vectors. The sweeps are compared in
/// `ocp`.
#[test]
fn the_width_of_the_vectors_does_not_change_any_bit() {
    const COUNT: usize = 50;
    let states: Vec<[f64; 6]> = (0..=COUNT)
        .map(|k| {
            let share = k as f64 / COUNT as f64;
            [share, 15.0 * (1.0 - share), 1.2 + 0.7 * share, -5.0 + 4.9 * share, 0.3 - share, 0.2 * share]
        })
        .collect();
    let costates: Vec<[f64; 6]> = states.iter().map(|state| state.map(|value| 30.0 - 7.0 * value)).collect();
    let inputs_rad: Vec<[f64; 1]> = (0..COUNT).map(|k| [0.3 - 0.012 * k as f64]).collect();
    for model in models() {
        let problem = Problem { model, ..problem::problem(problem::start(), COUNT) };
        let mut wide = Blocks::default();
        wide.resize(COUNT);
        wide.evaluate::<true>(&problem, &states, &inputs_rad, &costates);
        for k in 0..COUNT {
            let plain = block(&model, &(states[k], inputs_rad[k][0], costates[k + 1]));
            let (wide, lane) = (&wide.evaluated[k / LANES], k % LANES);
            let rows = wide.tangent.as_flattened().iter().zip(plain.tangent.as_flattened());
            let others =
                wide.curvature.iter().zip(&plain.curvature).chain(wide.pulled.iter().zip(&plain.pulled));
            for (wide, plain) in rows.chain(others).chain(wide.after.iter().zip(&plain.after)) {
                assert_eq!(wide.0[lane].to_bits(), plain.0[0].to_bits(), "{k}");
            }
        }
    }
}
