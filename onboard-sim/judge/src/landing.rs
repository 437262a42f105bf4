//! The landing in space, written from the equations in the documentation of [`ocp::landing`]:
//! dynamics of an interval for any kind of number, running cost, and conditions.

use nalgebra::{SMatrix, SVector, Vector3};
use num_dual::{DualNum, DualNumCopy, HyperDual64};
use ocp::landing::{INPUTS, Problem, STATES, Weights};

/// States and inputs of a node, one after the other.
pub(crate) const BOTH: usize = STATES + INPUTS;

/// A node: position of the feet, m; velocity, m/s; leans, rad; their rates, rad/s; gimbal angles,
/// rad; share of the fins. The last node has no inputs: they are zero.
pub(crate) type Node = SVector<f64, BOTH>;

/// A state as a vector.
pub(crate) type Column = SVector<f64, STATES>;

/// Smooths the size of a velocity, m^2/s^2.
const SMOOTH: f64 = 1e-4;

/// Opening of the fins that costs nothing.
const HALF_OPEN: f64 = 0.5;

/// The state after interval `k`.
pub(crate) fn after<D>(problem: &Problem, k: usize, node: &[D; BOTH]) -> [D; STATES]
where
    D: DualNumCopy + DualNum<Primitive = f64>,
{
    let (h, push) = (problem.step_s, &problem.pushes[k]);
    let [x, y, z, vx, vy, vz, p0, r0, p_rate0, r_rate0, gimbal_p, gimbal_r, fins] = *node;
    let vector = |x: f64, y: f64, z: f64| Vector3::new(D::from(x), D::from(y), D::from(z));
    let size = |v: &Vector3<D>| (v.dot(v) + SMOOTH).sqrt();

    // Leans and rates at their means, under the acceleration of the gimbal alone.
    let mean_lean =
        |lean: D, rate: D, gimbal: D| lean + rate * (h / 2.0) + gimbal * (push.turning_rad_s2 * h * h / 6.0);
    let mean_rate = |rate: D, gimbal: D| rate + gimbal * (push.turning_rad_s2 * h / 2.0);
    let (sin_p, cos_p) = mean_lean(p0, p_rate0, gimbal_p).sin_cos();
    let (sin_r, cos_r) = mean_lean(r0, r_rate0, gimbal_r).sin_cos();
    let (p_rate, r_rate) = (mean_rate(p_rate0, gimbal_p), mean_rate(r_rate0, gimbal_r));
    let nose = Vector3::new(sin_p, cos_p * sin_r, cos_p * cos_r);
    let towards_p = Vector3::new(cos_p, -sin_p * sin_r, -sin_p * cos_r);
    let towards_r = Vector3::new(D::from(0.0), cos_r, -sin_r);

    // The air, at the velocity that an upright thrust gives in the middle.
    let [wind_x, wind_y] = problem.wind_m_s;
    let gained_m_s = h / 2.0 * (push.thrust_m_s2 - problem.gravity_m_s2);
    let velocity = Vector3::new(vx, vy, vz);
    let air = velocity - vector(wind_x, wind_y, -gained_m_s);
    let along = air.dot(&nose);
    let across = air - nose * along;
    let drag_n = air * (fins * size(&air) * problem.drag.fins)
        + nose * (size(&air) * along * problem.drag.axial)
        + across * (size(&across) * problem.drag.crossflow);

    let thrust = nose - towards_p * gimbal_p - towards_r * gimbal_r;
    let acceleration = thrust * D::from(push.thrust_m_s2)
        - drag_n * D::from(push.per_kg)
        - vector(0.0, 0.0, problem.gravity_m_s2);
    let p_acceleration = gimbal_p * push.turning_rad_s2 - r_rate * r_rate * sin_p * cos_p;
    let r_acceleration = (gimbal_r * push.turning_rad_s2 + p_rate * r_rate * sin_p * 2.0) / cos_p;
    let moved = |place: D, rate: D, acceleration: D| place + rate * h + acceleration * (h * h / 2.0);
    let [ax, ay, az] = acceleration.into();
    [
        moved(x, vx, ax),
        moved(y, vy, ay),
        moved(z, vz, az),
        vx + ax * h,
        vy + ay * h,
        vz + az * h,
        moved(p0, p_rate0, p_acceleration),
        moved(r0, r_rate0, r_acceleration),
        p_rate0 + p_acceleration * h,
        r_rate0 + r_acceleration * h,
    ]
}

/// The end of interval `k`, its derivatives by states and inputs, and the second derivatives of its
/// product with a costate.
pub(crate) struct Tangent {
    pub(crate) end: Column,
    pub(crate) by: SMatrix<f64, STATES, BOTH>,
    pub(crate) bend: SMatrix<f64, BOTH, BOTH>,
}

impl Tangent {
    pub(crate) fn at(problem: &Problem, k: usize, node: &Node, costate: &Column) -> Self {
        let mut tangent = Self { end: Column::zeros(), by: SMatrix::zeros(), bend: SMatrix::zeros() };
        for i in 0..BOTH {
            for j in 0..=i {
                let mut seeded = <[f64; BOTH]>::from(*node).map(HyperDual64::from_re);
                seeded[i].eps1 = 1.0;
                seeded[j].eps2 = 1.0;
                for (row, value) in after(problem, k, &seeded).into_iter().enumerate() {
                    tangent.end[row] = value.re;
                    tangent.by[(row, i)] = value.eps1;
                    tangent.bend[(i, j)] += costate[row] * value.eps1eps2;
                }
                tangent.bend[(j, i)] = tangent.bend[(i, j)];
            }
        }
        tangent
    }
}

/// Weights of the cost at node `k`, and the node that costs nothing: the cost is half the weighted
/// sum of squares.
pub(crate) fn cost_at(problem: &Problem, k: usize) -> (Node, Node) {
    let Problem { weights, step_s, target_m: [x_m, y_m], .. } = problem;
    let mut weight = Node::zeros();
    if k > 0 {
        let Weights { place, height, velocity: [level, vertical], lean, rate, .. } = *weights;
        let of_states = [place, place, height, level, level, vertical, lean, lean, rate, rate];
        weight.fixed_rows_mut::<STATES>(0).copy_from_slice(&of_states);
    }
    if k < problem.pushes.len() {
        weight.fixed_rows_mut::<INPUTS>(STATES).copy_from_slice(&[
            weights.gimbal,
            weights.gimbal,
            weights.fins,
        ]);
    }
    let free = [*x_m, *y_m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, HALF_OPEN];
    (weight * *step_s, Node::from(free))
}

/// Permitted range of a component of a node.
pub(crate) struct Range {
    pub(crate) what: &'static str,
    pub(crate) node: usize,
    pub(crate) component: usize,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Range {
    /// Limits of inputs are not for sale.
    pub(crate) fn is_hard(&self) -> bool {
        self.component >= STATES
    }

    pub(crate) fn violation(&self, value: f64) -> f64 {
        (self.lower - value).max(value - self.upper).max(0.0)
    }
}

/// All conditions of a landing, and the limits of its inputs.
pub(crate) fn ranges(problem: &Problem) -> Vec<Range> {
    let Problem { end, lean_max_rad, gimbal_limit_rad, .. } = problem;
    let last = problem.pushes.len();
    let mut ranges = Vec::new();
    let mut keep = |what, node, component, lower, upper| {
        ranges.push(Range { what, node, component, lower, upper });
    };
    for node in 0..last {
        keep("gimbal towards x", node, 10, -gimbal_limit_rad, *gimbal_limit_rad);
        keep("gimbal towards y", node, 11, -gimbal_limit_rad, *gimbal_limit_rad);
        keep("fins", node, 12, 0.0, 1.0);
    }
    for node in 1..last {
        keep("lean towards x", node, 6, -lean_max_rad, *lean_max_rad);
        keep("lean towards y", node, 7, -lean_max_rad, *lean_max_rad);
        let before_s = (last - node) as f64 * problem.step_s;
        keep("floor", node, 2, problem.floor_rise_m_s * before_s, f64::INFINITY);
    }
    for node in last + 1 - end.settled_nodes.min(last)..=last {
        for (what, component, most) in [
            ("settled velocity x", 3, end.lateral_m_s),
            ("settled velocity y", 4, end.lateral_m_s),
            ("settled lean towards x", 6, end.lean_rad),
            ("settled lean towards y", 7, end.lean_rad),
            ("settled rate towards x", 8, end.rate_rad_s),
            ("settled rate towards y", 9, end.rate_rad_s),
        ] {
            keep(what, node, component, -most, most);
        }
    }
    let [slowest, fastest] = end.vertical_m_s;
    keep("vertical velocity at the end", last, 5, slowest, fastest);
    keep("height at the end", last, 2, 0.0, 0.0);
    ranges
}
