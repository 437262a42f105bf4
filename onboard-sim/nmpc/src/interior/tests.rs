use proptest::prelude::*;

use super::block::{Block, Constants, DIRECTIONS, Points, pair};
use super::interval::evaluate;
use super::lanes::{LANES, Lanes};
use super::*;
use crate::dynamics::{ModelKind, PlanarModel, PlanarState};
use crate::{paper, solve};

const STEP_S: f64 = 0.1;
const THRUST_N: f64 = 33.3;

/// State, gimbal angle and costate.
type Point = ([f64; 6], f64, [f64; 6]);

/// A model and the vehicle's mass, kg.
type Vehicle = (PlanarModel, f64);

/// Both kinds of the paper's vehicle, and a lighter vehicle with air forces across the body.
fn vehicles() -> [Vehicle; 3] {
    let paper = paper::model();
    let mut in_air = paper;
    in_air.params.lateral_drag_per_m = 0.07;
    in_air.params.crossflow_per_m = 0.04;
    let mass_kg = paper.params.mass_kg;
    let printed = PlanarModel { kind: ModelKind::AsPrinted, ..paper };
    [(paper, mass_kg), (printed, mass_kg), (in_air, 0.9 * mass_kg)]
}

/// Evaluates the interval in every lane and returns the last lane's result.
fn block((model, mass_kg): &Vehicle, (state, gimbal, costate): &Point) -> Block {
    let constants = Constants::of(model, STEP_S);
    let points = Points {
        state: state.map(Lanes::splat),
        gimbal: Lanes::splat(*gimbal),
        thrust: Lanes::splat(THRUST_N),
        inverse_mass: Lanes::splat(1.0 / mass_kg),
        lightness: Lanes::splat(model.params.mass_kg / mass_kg),
        costate: costate.map(Lanes::splat),
    };
    let mut block = Block::EMPTY;
    match (constants.printed, constants.pushed_across()) {
        (true, _) => evaluate::<true, true, false>(&constants, &points, &mut block),
        (false, true) => evaluate::<true, false, true>(&constants, &points, &mut block),
        (false, false) => evaluate::<true, false, false>(&constants, &points, &mut block),
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
fn step((model, mass_kg): &Vehicle, (state, gimbal, _): &Point) -> [f64; 6] {
    let model = model.with_mass(*mass_kg);
    model.rk4_step(&PlanarState::from_array(*state), *gimbal, THRUST_N, STEP_S).to_array()
}

/// Whether a stage comes so close to zero speed across the body, where the crossflow's curvature jumps, that a
/// difference quotient may contain the jump.
fn near_the_jump((model, mass_kg): &Vehicle, (state, gimbal, _): &Point) -> bool {
    const NEAR_M_S: f64 = 1e-3;
    let mut problem = paper::problem(PlanarState::from_array(*state), 1);
    problem.model = model.with_mass(*mass_kg);
    problem.thrust_n = vec![THRUST_N];
    let (stages, _) = crate::rollout::stages(&problem, 0, state, *gimbal);
    model.params.crossflow_per_m != 0.0 && stages.iter().any(|stage| stage[4].abs() < NEAR_M_S)
}

fn point() -> impl Strategy<Value = Point> {
    let state = (-20.0..20.0, 0.0..20.0, 0.5..2.6, -6.0..-1.0, -3.0..3.0, -1.0..1.0, -0.34..0.34);
    (state, prop::array::uniform6(-50.0..50.0_f64))
        .prop_map(|((x, z, theta, u, w, q, gimbal), costate)| ([x, z, theta, u, w, q], gimbal, costate))
}

proptest! {
    #[test]
    fn val_planar_model_step(point in point()) {
        for vehicle in &vehicles() {
            let block = block(vehicle, &point);
            for (value, expected) in block.after.iter().zip(step(vehicle, &point)) {
                let error = (value.0[LANES - 1] - expected).abs();
                prop_assert!(error < 1e-13 * (1.0 + expected.abs()), "{error}");
            }
        }
    }

    #[test]
    fn val_finite_differences_tangent_and_adjoint(point in point()) {
        const H: f64 = 1e-5;
        for vehicle in &vehicles() {
            let block = block(vehicle, &point);
            for j in 0..DIRECTIONS {
                let (ahead, behind) = (step(vehicle, &moved(&point, j, H)), step(vehicle, &moved(&point, j, -H)));
                let column: [f64; 6] = core::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * H));
                for (row, state) in [0, 1, 3, 4].into_iter().enumerate() {
                    let error = (block.tangent[row][j].0[0] - column[state]).abs();
                    prop_assert!(error < 1e-8 * (1.0 + column[state].abs()), "[{row}][{j}] {error}");
                }
                let expected: f64 = column.iter().zip(&point.2).map(|(slope, weight)| slope * weight).sum();
                prop_assert!((block.pulled[j].0[0] - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{j}");
            }
            let turn = (step(vehicle, &moved(&point, 4, H))[5] - step(vehicle, &moved(&point, 4, -H))[5]) / (2.0 * H);
            prop_assert!((block.turn.0[0] - turn).abs() < 1e-8 * (1.0 + turn.abs()));
        }
    }

    #[test]
    fn val_finite_differences_curvature(point in point()) {
        const H: f64 = 1e-5;
        for vehicle in &vehicles() {
            prop_assume!(!near_the_jump(vehicle, &point));
            let curvature = block(vehicle, &point).curvature;
            for column in 0..DIRECTIONS {
                let ahead = block(vehicle, &moved(&point, column, H)).pulled;
                let behind = block(vehicle, &moved(&point, column, -H)).pulled;
                for row in 0..=column {
                    let expected = (ahead[row].0[0] - behind[row].0[0]) / (2.0 * H);
                    let error = (curvature[pair(row, column)].0[0] - expected).abs();
                    prop_assert!(error < 1e-5 * (1.0 + expected.abs()), "[{row}][{column}] {error}");
                }
            }
        }
    }
}

/// States and costates satisfy their equations by construction of the sweeps. If the inputs satisfy theirs, too, the
/// step solves the whole Newton system.
#[test]
fn the_sweeps_solve_the_newton_system() {
    for (theta_deg, w_m_s) in [(90.0_f64, 0.0), (60.0, 1.0), (115.0, -2.0)] {
        let nominal = paper::start();
        let start = PlanarState { theta_rad: theta_deg.to_radians(), w_m_s, ..nominal };
        let problem = paper::problem(start, 50);
        let warm = solve(&paper::problem(nominal, 50), None).shifted(0);
        let mut workspace = Workspace::default();
        workspace.load(&problem, &warm);
        workspace.evaluate_intervals(&problem);
        assert!(workspace.sweep(&problem));
        for k in 0..50 {
            let left = workspace.newton.sweep.input_residual(&workspace.current, problem.step_s, k);
            assert!(left.abs() < 1e-6, "{k}: {left}");
        }
    }
}

/// Compares derivatives and sweeps in this machine's widest vectors with those in plain vectors.
#[test]
fn the_width_of_the_vectors_does_not_change_any_bit() {
    let mut problem = paper::problem(paper::start(), 50);
    let warm = solve(&problem, None).shifted(0);
    for vehicle in vehicles() {
        problem.model = vehicle.0;
        let mut workspace = Workspace::default();
        workspace.load(&problem, &warm);
        workspace.evaluate_intervals(&problem);
        for k in 0..50 {
            let (wide, lane) = (&workspace.current.blocks[k / LANES], k % LANES);
            let current = &workspace.current;
            let point = (current.states[k], current.inputs_rad[k], current.costates[k + 1]);
            let plain = block(&(vehicle.0, vehicle.0.params.mass_kg), &point);
            for (wide, plain) in wide.curvature.iter().zip(&plain.curvature) {
                assert_eq!(wide.0[lane].to_bits(), plain.0[0].to_bits(), "{k}");
            }
            for (wide, plain) in wide.after.iter().zip(&plain.after) {
                assert_eq!(wide.0[lane].to_bits(), plain.0[0].to_bits(), "{k}");
            }
        }
        workspace.sweep(&problem);
        let sweep = &mut workspace.newton.sweep;
        let wide = (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone());
        sweep.eliminate(&workspace.current, problem.step_s);
        sweep.substitute(&workspace.current, problem.step_s);
        assert_eq!(wide, (sweep.states.clone(), sweep.inputs.clone(), sweep.costates.clone()));
    }
}
