//! The derivatives of an interval against finite differences of the model's own step.

use ocp::{Dense, DenseIntervals, Intervals as _};
use proptest::prelude::*;

use super::Problem;
use super::dynamics::{ModelKind, PlanarModel, PlanarState};
use super::intervals::evaluate;
use crate::problem::{self, THRUST_N};

const STEP_S: f64 = 0.1;

/// State, gimbal angle and costate.
type Point = ([f64; 6], f64, [f64; 6]);

/// Both kinds of the paper's vehicle.
fn models() -> [PlanarModel; 2] {
    [ModelKind::Consistent, ModelKind::AsPrinted].map(|kind| PlanarModel { kind, ..problem::model() })
}

fn interval(model: &PlanarModel, (state, gimbal, costate): &Point) -> Dense<6, 1> {
    let problem = Problem {
        model: *model,
        step_s: STEP_S,
        thrust_n: THRUST_N,
        ..problem::problem(problem::start(), 1)
    };
    let mut intervals = DenseIntervals::default();
    intervals.resize(1);
    evaluate(&problem, &[*state; 2], &[[*gimbal]], &[*costate; 2], true, &mut intervals);
    intervals.0.remove(0)
}

/// The point with one of the six states, or the gimbal angle, moved.
fn moved((state, gimbal, costate): &Point, direction: usize, by: f64) -> Point {
    let (mut state, mut gimbal) = (*state, *gimbal);
    match state.get_mut(direction) {
        Some(component) => *component += by,
        None => gimbal += by,
    }
    (state, gimbal, *costate)
}

fn step(model: &PlanarModel, (state, gimbal, _): &Point) -> [f64; 6] {
    model.rk4_step(&PlanarState::from_array(*state), *gimbal, THRUST_N, STEP_S).to_array()
}

fn point() -> impl Strategy<Value = Point> {
    let state = (-20.0..20.0, 0.0..20.0, 0.5..2.6, -6.0..-1.0, -3.0..3.0, -1.0..1.0, -0.34..0.34);
    (state, prop::array::uniform6(-50.0..50.0_f64))
        .prop_map(|((x, z, theta, u, w, q, gimbal), costate)| ([x, z, theta, u, w, q], gimbal, costate))
}

/// What a change of each state, and of the gimbal angle, is worth.
fn pulled(interval: &Dense<6, 1>) -> Vec<f64> {
    interval.pulled_x.into_iter().chain(interval.pulled_u).collect()
}

proptest! {
    #[test]
    fn val_finite_differences_tangent_and_adjoint(point in point()) {
        const H: f64 = 1e-5;
        for model in &models() {
            let interval = interval(model, &point);
            for (j, pulled) in pulled(&interval).into_iter().enumerate() {
                let (ahead, behind) = (step(model, &moved(&point, j, H)), step(model, &moved(&point, j, -H)));
                let column: [f64; 6] = core::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * H));
                for (i, expected) in column.into_iter().enumerate() {
                    let found = interval.a[i].get(j).copied().unwrap_or(interval.b[i][0]);
                    prop_assert!((found - expected).abs() < 1e-8 * (1.0 + expected.abs()), "[{i}][{j}] {found}");
                }
                let expected: f64 = column.iter().zip(&point.2).map(|(slope, weight)| slope * weight).sum();
                prop_assert!((pulled - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{j}");
            }
        }
    }

    #[test]
    fn val_finite_differences_curvature(point in point()) {
        const H: f64 = 1e-5;
        for model in &models() {
            let curvature = interval(model, &point).curvature;
            for j in 0..7 {
                let ahead = pulled(&interval(model, &moved(&point, j, H)));
                let behind = pulled(&interval(model, &moved(&point, j, -H)));
                for (i, (ahead, behind)) in ahead.into_iter().zip(behind).enumerate() {
                    let expected = (ahead - behind) / (2.0 * H);
                    let found = match (i, j) {
                        (6, 6) => curvature.uu[0][0],
                        (6, state) | (state, 6) => curvature.ux[0][state],
                        (row, column) => curvature.xx[row][column],
                    };
                    prop_assert!((found - expected).abs() < 1e-5 * (1.0 + expected.abs()), "[{i}][{j}] {found}");
                }
            }
        }
    }
}
