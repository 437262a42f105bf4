use std::array::from_fn;
use std::f64::consts::TAU;

use crate::{DenseIntervals, Feedback, Hessian, Interval as _, Intervals as _, Stage, Status};

use super::stage::LandingInterval;
use super::{
    Drag, End, INPUTS, Problem, Push, STATES, SolverLimits, Start, State, Weights, Workspace, interval,
};

mod problem;

use problem::problem;

/// Turns of the lean around upright while it is larger than 3 degrees.
fn turns(states: &[State]) -> f64 {
    let leaning = states.iter().filter(|state| libm::hypot(state[6], state[7]) > 3.0_f64.to_radians());
    let towards: Vec<f64> = leaning.map(|state| libm::atan2(state[7], state[6])).collect();
    let changes = towards.windows(2).map(|pair| (pair[1] - pair[0] + 1.5 * TAU).rem_euclid(TAU) - 0.5 * TAU);
    changes.sum::<f64>() / TAU
}

#[test]
fn a_surplus_of_thrust_is_wasted_with_a_lean_that_turns_around() {
    for thrust_over_weight in [1.6, 1.8] {
        let model = problem(thrust_over_weight);
        let mut workspace = Workspace::default();
        let outcome = workspace.solve(&model, None);
        let turns = turns(workspace.states());
        println!("{thrust_over_weight}: {outcome:?}, {turns:.2} turns");
        assert_eq!(outcome.status, Status::Converged);
        assert!(outcome.miss < 0.02, "{}", outcome.miss);
        assert!(turns.abs() > 0.7, "{turns}");
    }
}

/// The inputs of a plan, flown in small steps with the equations of a slender body written with
/// vectors instead of leans. The intervals converge to it with shorter steps.
#[test]
fn intervals_lead_where_the_equations_of_motion_do() {
    let model = problem(1.6);
    let mut workspace = Workspace::default();
    workspace.solve(&model, None);
    let inputs = workspace.inputs();
    let flown = flown(&model, inputs);
    let missed = |parts: usize| {
        let mut finer = model.clone();
        finer.step_s /= parts as f64;
        finer.pushes = model.pushes.iter().flat_map(|push| std::iter::repeat_n(*push, parts)).collect();
        let inputs = inputs.iter().flat_map(|input| std::iter::repeat_n(*input, parts));
        let mut state = model.initial;
        for (k, input) in inputs.enumerate() {
            state = interval::end(&finer, k, &state, &input);
        }
        let nose = [libm::sin(state[6]), libm::cos(state[6]) * libm::sin(state[7])];
        let found = [&state[..6], &nose[..]].concat();
        found.iter().zip(&flown).map(|(found, flown)| (found - flown).abs()).fold(0.0, f64::max)
    };
    let missed = [1, 2, 4].map(missed);
    println!("{missed:?}");
    assert!(missed[0] < 0.25, "{missed:?}");
    assert!(2.0 * missed[1] < missed[0] && 2.0 * missed[2] < missed[1], "{missed:?}");
}

/// Place, velocity and the nose's level part after the inputs of all intervals.
fn flown(model: &Problem, inputs: &[[f64; INPUTS]]) -> [f64; 8] {
    const STEPS: usize = 4000;
    let [x, y, z, vx, vy, vz, p, r, ..] = model.initial;
    let mut place = [x, y, z];
    let mut velocity = [vx, vy, vz];
    let mut nose = [libm::sin(p), libm::cos(p) * libm::sin(r), libm::cos(p) * libm::cos(r)];
    let mut turning = [0.0; 3];
    let size = |v: &[f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    for (push, input) in model.pushes.iter().zip(inputs) {
        let step_s = model.step_s / STEPS as f64;
        for _ in 0..STEPS {
            let (sin_p, cos_p) = (nose[0], libm::hypot(nose[1], nose[2]));
            let (sin_r, cos_r) = (nose[1] / cos_p, nose[2] / cos_p);
            let e_p = [cos_p, -sin_p * sin_r, -sin_p * cos_r];
            let e_r = [0.0, cos_r, -sin_r];
            let sideways: [f64; 3] = std::array::from_fn(|i| input[0] * e_p[i] + input[1] * e_r[i]);
            let air = [velocity[0] - model.wind_m_s[0], velocity[1] - model.wind_m_s[1], velocity[2]];
            let along: f64 = air.iter().zip(&nose).map(|(v, n)| v * n).sum();
            let across: [f64; 3] = std::array::from_fn(|i| air[i] - along * nose[i]);
            let drag = &model.drag;
            for i in 0..3 {
                let air_n = -drag.fins * input[2] * size(&air) * air[i]
                    - drag.axial * size(&air) * along * nose[i]
                    - drag.crossflow * size(&across) * across[i];
                velocity[i] += step_s * (push.thrust_m_s2 * (nose[i] - sideways[i]) + push.per_kg * air_n);
            }
            velocity[2] -= step_s * model.gravity_m_s2;
            // The angular momentum over the moment of inertia; a slender body has none about its
            // axis.
            let torque = cross(&nose, &sideways).map(|value| value * push.turning_rad_s2);
            for i in 0..3 {
                turning[i] += step_s * torque[i];
                place[i] += step_s * velocity[i];
            }
            let moved = cross(&turning, &nose);
            let next: [f64; 3] = std::array::from_fn(|i| nose[i] + step_s * moved[i]);
            let length = size(&next);
            nose = next.map(|value| value / length);
        }
    }
    [place[0], place[1], place[2], velocity[0], velocity[1], velocity[2], nose[0], nose[1]]
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[test]
fn the_rest_of_a_plan_is_optimal_and_a_disturbed_one_soon_is() {
    const FLOWN: usize = 4;
    let mut model = problem(1.6);
    let mut workspace = Workspace::default();
    let cold = workspace.solve(&model, None);
    let limits: Vec<_> = workspace.limit_multipliers().collect();
    let all: Vec<f64> = workspace.condition_multipliers().collect();
    let (states, inputs, costates) = (
        workspace.states()[FLOWN..].to_vec(),
        workspace.inputs()[FLOWN..].to_vec(),
        workspace.costates()[FLOWN..].to_vec(),
    );
    let remaining = model.pushes.len() - FLOWN;
    let mut conditions = Vec::new();
    super::last_multipliers(&all, model.end.settled_nodes, model.pushes.len(), remaining, &mut conditions);
    model.pushes.drain(..FLOWN);
    model.initial = states[0];
    let start = Start {
        states: &states,
        inputs: &inputs,
        costates: &costates,
        limit_multipliers: &limits[FLOWN..],
        condition_multipliers: &conditions,
    };
    let rest = workspace.solve(&model, Some(&start));
    assert_eq!(rest.status, Status::Converged);
    assert!(rest.iterations <= 4, "{rest:?}");
    model.initial[3] += 0.1;
    model.initial[8] -= 0.05;
    let kicked = workspace.solve(&model, Some(&start));
    assert_eq!(kicked.status, Status::Converged, "{kicked:?}");
    assert!(3 * kicked.iterations < cold.iterations, "{} after {}", kicked.iterations, cold.iterations);
}

/// Some interval of a landing, away from rest, at a state and an input one after the other.
fn evaluated(model: &Problem, both: &[f64; STATES + INPUTS]) -> LandingInterval {
    let costate = [1.0, -2.0, 3.0, 0.5, 1.5, -2.5, 0.7, -0.6, 0.8, 1.2];
    let (state, input) = halves(both);
    let mut out = LandingInterval::ZERO;
    interval::evaluated(model, 3, &state, &input, &costate, &mut out);
    out.pulled = (&out).pull(&costate);
    out
}

const SOMEWHERE: [f64; STATES + INPUTS] =
    [0.3, 0.2, 9.0, 2.0, -1.5, -6.0, 0.5, -0.4, 0.9, -1.1, 0.03, -0.05, 0.4];

fn halves(both: &[f64; STATES + INPUTS]) -> (State, [f64; INPUTS]) {
    let (state, input) = both.split_at(STATES);
    (state.try_into().unwrap(), input.try_into().unwrap())
}

fn unit(j: usize) -> (State, [f64; INPUTS]) {
    let mut unit = [0.0; STATES + INPUTS];
    unit[j] = 1.0;
    halves(&unit)
}

#[test]
fn derivatives_are_those_of_differences() {
    const CHANGE: f64 = 1e-6;
    let model = problem(1.6);
    let exact = evaluated(&model, &SOMEWHERE);
    for j in 0..STATES + INPUTS {
        let moved = |change: f64| {
            let mut moved = SOMEWHERE;
            moved[j] += change;
            evaluated(&model, &moved)
        };
        let (ahead, behind) = (moved(CHANGE), moved(-CHANGE));
        let slope = |ahead: f64, behind: f64| (ahead - behind) / (2.0 * CHANGE);
        let (dx, du) = unit(j);
        for (i, own) in (&exact).push(&dx, &du).into_iter().enumerate() {
            let found = slope(ahead.end[i], behind.end[i]);
            assert!((found - own).abs() < 1e-7, "{i} by {j}: {own} for {found}");
        }
        let all = |(by_state, by_input): (State, [f64; INPUTS])| [&by_state[..], &by_input[..]].concat();
        let bent = all((&exact).curve(1.0, &dx, &du));
        for (i, (ahead, behind)) in all(ahead.pulled).into_iter().zip(all(behind.pulled)).enumerate() {
            let (own, found) = (bent[i], slope(ahead, behind));
            assert!((found - own).abs() < 1e-6, "curvature {i} by {j}: {own} for {found}");
        }
    }
}

/// The sweep's elimination, and that of the equivalent full matrices of the interval.
#[test]
fn an_interval_is_eliminated_like_its_full_matrices() {
    let interval = evaluated(&problem(1.6), &SOMEWHERE);
    let mut whole = DenseIntervals::default();
    whole.resize(1);
    let dense = &mut whole.0[0];
    for j in 0..STATES + INPUTS {
        let (dx, du) = unit(j);
        let (moved, (bent_x, bent_u)) = ((&interval).push(&dx, &du), (&interval).curve(1.0, &dx, &du));
        for i in 0..STATES {
            if j < STATES {
                (dense.a[i][j], dense.curvature.xx[i][j]) = (moved[i], bent_x[i]);
            } else {
                dense.b[i][j - STATES] = moved[i];
            }
        }
        for (i, bent) in bent_u.into_iter().enumerate() {
            let Hessian { ux, uu, .. } = &mut dense.curvature;
            *if j < STATES { &mut ux[i][j] } else { &mut uu[i][j - STATES] } = bent;
        }
    }
    // Any numbers.
    let number = |i: usize| libm::sin(1.0 + 7.0 * i as f64);
    let value: [State; STATES] = from_fn(|i| from_fn(|j| number(i + j) + if i == j { 20.0 } else { 0.0 }));
    let stage = Stage {
        defect: from_fn(number),
        share: 0.5,
        state_terms: (&[1.0; STATES], &from_fn(|i| number(10 + i))),
        input_terms: (&[2.0; INPUTS], &from_fn(|i| number(20 + i))),
    };
    let slope = from_fn(|i| number(30 + i));
    let (mut one, mut other) = ((value, slope), (value, slope));
    let found = (&interval).eliminate(&stage, &value, &mut one.0, &mut one.1).unwrap();
    let expected = (&whole.0[0]).eliminate(&stage, &value, &mut other.0, &mut other.1).unwrap();
    let all = |(value, slope): ([State; STATES], State), feedback: Feedback<STATES, INPUTS>| {
        let Feedback { gain, offset, .. } = feedback;
        [value.as_flattened(), &slope[..], gain.as_flattened(), &offset[..]].concat()
    };
    for (found, expected) in all(one, found).into_iter().zip(all(other, expected)) {
        assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
    }
}
