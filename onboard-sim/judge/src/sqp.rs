//! Sequential quadratic programming. One iteration:
//!
//! 1. A backward pass makes the quadratic model: derivatives of every interval, costates, and the
//!    exact Hessian of the Lagrangian. A Riccati recursion moves curvature between the stages until
//!    each stage is convex, which leaves the solution of the subproblem as it was (Verschueren,
//!    Zanon, Quirynen, Diehl, "A sparsity preserving convexification procedure for indefinite
//!    quadratic programs arising in direct optimal control", SIAM J. Optim. 27, 2017).
//! 2. Clarabel solves the subproblem: nodes and misses are its variables, intervals and conditions
//!    its rows.
//! 3. The step is flown: the inputs follow it, and correct the errors of linearisation with the
//!    recursion's gains. So every iterate is flyable, and its merit is the one of its
//!    [`score`](crate::score). The step is halved until the merit falls.

use std::f64::consts::TAU;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver as _, SupportedConeT};
use nalgebra::{SMatrix, SVector, SymmetricEigen};
use ocp::landing::{INPUTS, Problem, STATES};

use crate::landing::{BOTH, Column, Node, Range, Tangent, after, cost_at, ranges};
use crate::scored;

/// Most subproblems from one start.
const ITERATIONS: usize = 60;

/// A plan has converged when the subproblem promises less than this share of its merit.
const TOLERANCE: f64 = 1e-7;

/// Required share of the predicted decrease of the merit, and the number of step shares tried.
const ARMIJO: f64 = 1e-4;
const SHARES: usize = 10;

/// Number of earlier merits whose largest the merit must undercut: a full step along a curved
/// condition raises it for a moment.
const MEMORY: usize = 8;

/// Iterations without the dynamics' curvature at the start. With it from the second on, the best of
/// three guesses ends beside the best landing found in 3 of 12 landings like those of the tests;
/// after these in none.
const ROUGH: usize = 10;

/// Smallest curvature of a stage, and the smallest of the inputs relative to their largest.
const CURVATURE: f64 = 1e-6;
const INPUT_CURVATURE: f64 = 1e-4;

/// Curvature across a condition that holds with a multiplier, relative to the penalty. The
/// subproblem cannot move there, so its solution stays, and the rest is convex more often.
const STIFFNESS: f64 = 1.0;

/// A multiplier this close to zero or to its penalty, relative to the penalty, does not show that
/// its condition holds.
const UNSETTLED: f64 = 1e-4;

/// Largest number of sweeps of the eigenvalue iteration.
const EIGEN_SWEEPS: usize = 1000;

/// Accuracy of the subproblems.
const ACCURACY: f64 = 1e-10;

/// Searches landings of a problem.
pub(crate) struct Search<'a> {
    problem: &'a Problem,
    pub(crate) ranges: Vec<Range>,
}

/// Where a search ended: if it has not converged, at its best iterate; without nodes if nothing
/// flies.
pub(crate) struct End {
    pub(crate) converged: bool,
    pub(crate) iterations: usize,
    pub(crate) nodes: Vec<Node>,
}

/// The quadratic model of a stage, the tangent of its interval, and the gain of its inputs.
struct Stage {
    slope: Node,
    hessian: SMatrix<f64, BOTH, BOTH>,
    by: SMatrix<f64, STATES, BOTH>,
    defect: Column,
    gain: SMatrix<f64, INPUTS, STATES>,
}

/// The solution of a subproblem.
struct Step {
    nodes: Vec<Node>,
    /// Multipliers of the ranges, positive at the upper end.
    multipliers: Vec<f64>,
    /// Decrease of the merit by the model.
    promised: f64,
}

impl<'a> Search<'a> {
    pub(crate) fn of(problem: &'a Problem) -> Self {
        Self { problem, ranges: ranges(problem) }
    }

    /// The straight line to rest at the target, and a lean that turns around so often, from a
    /// direction.
    pub(crate) fn guess(&self, (turns, from_rad): (f64, f64)) -> Vec<Node> {
        let Problem { initial, target_m: [x_m, y_m], guess_lean_rad, guess_towards_rad, .. } = self.problem;
        let last = self.problem.pushes.len();
        let initial = Column::from(*initial);
        let mut to = Column::zeros();
        (to[0], to[1]) = (*x_m, *y_m);
        let node = |k: usize| {
            let share = k as f64 / last as f64;
            let size = guess_lean_rad * 4.0 * share * (1.0 - share) * turns.abs();
            let (sin, cos) = libm::sincos(guess_towards_rad + from_rad + TAU * turns * share);
            let mut node = Node::zeros();
            node.fixed_rows_mut::<STATES>(0).copy_from(&initial.lerp(&to, share));
            node[6] += size * cos;
            node[7] += size * sin;
            node[BOTH - 1] = 0.5;
            node
        };
        (0..=last).map(node).collect()
    }

    /// Improves a plan until nothing better lies near it.
    pub(crate) fn descend(&self, mut nodes: Vec<Node>) -> End {
        let mut multipliers = vec![0.0; self.ranges.len()];
        let mut merits: Vec<f64> = Vec::new();
        let mut best = (f64::INFINITY, Vec::new());
        let (mut curved, mut iterations) = (false, 0);
        while iterations < ITERATIONS {
            let Some(stages) = self.model(&nodes, &multipliers, curved) else { break };
            let Some(step) = self.subproblem(&nodes, &stages) else { break };
            iterations += 1;
            // Before the first step the guess is not flyable, and has no merit.
            let converged =
                merits.last().is_some_and(|merit| step.promised.abs() <= TOLERANCE * (1.0 + merit));
            if converged {
                return End { converged, iterations, nodes };
            }
            let recent = merits.iter().rev().take(MEMORY).copied();
            let reference = recent.reduce(f64::max).unwrap_or(f64::INFINITY);
            let mut shares = std::iter::successors(Some(1.0), |share| Some(0.5 * share)).take(SHARES);
            let taken = shares.find_map(|share| {
                let flown = self.flown(&nodes, &stages, &step, share);
                let merit = scored(self.problem, &self.ranges, &flown).merit;
                (merit < reference - ARMIJO * share * step.promised.max(0.0)).then_some((flown, merit, share))
            });
            match taken {
                Some((flown, merit, share)) => {
                    nodes = flown;
                    merits.push(merit);
                    if merit < best.0 {
                        best = (merit, nodes.clone());
                    }
                    for (multiplier, new) in multipliers.iter_mut().zip(step.multipliers) {
                        *multiplier += share * (new - *multiplier);
                    }
                    curved = iterations >= ROUGH;
                }
                // The curvature of the linearisation is always positive.
                None if curved => curved = false,
                None => break,
            }
        }
        End { converged: false, iterations, nodes: best.1 }
    }

    /// The quadratic model about a plan, with the curvature of the dynamics or without it.
    fn model(&self, nodes: &[Node], multipliers: &[f64], curved: bool) -> Option<Vec<Stage>> {
        let penalty = self.problem.solver.terminal_penalty;
        let mut pulls = vec![Node::zeros(); nodes.len()];
        let mut stiff = vec![(Node::zeros(), Node::zeros()); nodes.len()];
        for (range, multiplier) in self.ranges.iter().zip(multipliers) {
            let Range { node, component, lower, upper, .. } = *range;
            pulls[node][component] += multiplier;
            let share = multiplier.abs() / penalty;
            if share > UNSETTLED && (share < 1.0 - UNSETTLED || range.is_hard()) {
                let bound = if *multiplier > 0.0 { upper } else { lower };
                stiff[node].0[component] += STIFFNESS * penalty;
                stiff[node].1[component] += STIFFNESS * penalty * (nodes[node][component] - bound);
            }
        }
        let mut value = SMatrix::<f64, STATES, STATES>::zeros();
        let mut costate = Column::zeros();
        let mut stages = Vec::with_capacity(nodes.len());
        for (k, node) in nodes.iter().enumerate().rev() {
            let (weight, free) = cost_at(self.problem, k);
            let mut slope = weight.component_mul(&(node - free));
            let mut complete = SMatrix::from_diagonal(&(weight + stiff[k].0));
            let mut before = slope + pulls[k];
            slope += stiff[k].1;
            let (mut by, mut defect) = (SMatrix::zeros(), Column::zeros());
            if let Some(next) = nodes.get(k + 1) {
                let share = if curved { 1.0 } else { 0.0 };
                let tangent = Tangent::at(self.problem, k, node, &(costate * share));
                by = tangent.by;
                defect = tangent.end - next.fixed_rows::<STATES>(0);
                before += by.transpose() * costate;
                slope += by.transpose() * value * defect;
                complete += tangent.bend + by.transpose() * value * by;
            }
            costate.copy_from(&before.fixed_rows::<STATES>(0));
            let inputs = convex(&complete.fixed_view::<INPUTS, INPUTS>(STATES, STATES).into_owned())?;
            let crossed = complete.fixed_view::<INPUTS, STATES>(STATES, 0).into_owned();
            let gain = -inputs.cholesky()?.solve(&crossed);
            let least = SMatrix::<f64, STATES, STATES>::identity() * CURVATURE - crossed.transpose() * gain;
            value = complete.fixed_view::<STATES, STATES>(0, 0) - least;
            let mut hessian = complete;
            hessian.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&least);
            hessian.fixed_view_mut::<INPUTS, INPUTS>(STATES, STATES).copy_from(&inputs);
            stages.push(Stage { slope, hessian, by, defect, gain });
        }
        stages.reverse();
        Some(stages)
    }

    /// The step to the minimum of the model on the tangents, with every condition at its price.
    fn subproblem(&self, nodes: &[Node], stages: &[Stage]) -> Option<Step> {
        let penalty = self.problem.solver.terminal_penalty;
        let steps = nodes.len() * BOTH;
        let misses = self.ranges.iter().filter(|range| !range.is_hard()).count();
        let variables = steps + misses;
        let (mut quadratic, mut rows) = (Triplets::default(), Triplets::default());
        let mut linear = vec![penalty; variables];
        let mut right = Vec::new();
        for (k, stage) in stages.iter().enumerate() {
            let at = k * BOTH;
            linear[at..at + BOTH].copy_from_slice(stage.slope.as_slice());
            for j in 0..BOTH {
                for i in 0..=j {
                    quadratic.push(at + i, at + j, stage.hessian[(i, j)]);
                }
            }
            // The state before an interval leads to the one after it; the first one is given.
            let given = Column::from(self.problem.initial) - nodes[0].fixed_rows::<STATES>(0);
            for i in 0..STATES {
                rows.push(right.len(), at + i, -1.0);
                right.push(if k == 0 { -given[i] } else { -stages[k - 1].defect[i] });
                if k > 0 {
                    for j in 0..BOTH {
                        rows.push(right.len() - 1, at - BOTH + j, stages[k - 1].by[(i, j)]);
                    }
                }
            }
        }
        let equalities = right.len();
        let mut miss = steps;
        let mut owners = Vec::new();
        for (index, range) in self.ranges.iter().enumerate() {
            let at = range.node * BOTH + range.component;
            let value = nodes[range.node][range.component];
            for (sign, room) in [(-1.0, value - range.lower), (1.0, range.upper - value)] {
                if room.is_infinite() {
                    continue;
                }
                owners.push((index, sign));
                rows.push(right.len(), at, sign);
                if !range.is_hard() {
                    rows.push(right.len(), miss, -1.0);
                }
                right.push(room);
            }
            miss += usize::from(!range.is_hard());
        }
        for miss in steps..variables {
            rows.push(right.len(), miss, -1.0);
            right.push(0.0);
        }
        let cones = [
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(right.len() - equalities),
        ];
        let (quadratic, rows) = (quadratic.matrix(variables, variables), rows.matrix(right.len(), variables));
        let mut solver = DefaultSolver::new(&quadratic, &linear, &rows, &right, &cones, settings()).ok()?;
        solver.solve();
        let found = &solver.solution;
        if !found.x.iter().chain(&found.z).all(|value| value.is_finite()) {
            return None;
        }
        let step: Vec<Node> = found.x[..steps].chunks_exact(BOTH).map(Node::from_column_slice).collect();
        let mut promised = 0.0;
        for (step, stage) in step.iter().zip(stages) {
            promised -= step.dot(&(stage.slope + 0.5 * stage.hessian * step));
        }
        for range in self.ranges.iter().filter(|range| !range.is_hard()) {
            let (now, change) = (nodes[range.node][range.component], step[range.node][range.component]);
            promised += penalty * (range.violation(now) - range.violation(now + change));
        }
        let mut multipliers = vec![0.0; self.ranges.len()];
        for ((index, sign), dual) in owners.into_iter().zip(&found.z[equalities..]) {
            multipliers[index] += sign * dual;
        }
        Some(Step { multipliers, nodes: step, promised })
    }

    /// Flies a share of a step.
    fn flown(&self, nodes: &[Node], stages: &[Stage], step: &Step, share: f64) -> Vec<Node> {
        let mut state = Column::from(self.problem.initial);
        let limit = self.problem.gimbal_limit_rad;
        let most = SVector::from([limit, limit, 1.0]);
        let least = SVector::from([-limit, -limit, 0.0]);
        let mut flown = Vec::with_capacity(nodes.len());
        for (k, (node, stage)) in nodes.iter().zip(stages).enumerate() {
            let mut here = node + share * step.nodes[k];
            let astray = state - here.fixed_rows::<STATES>(0);
            here.fixed_rows_mut::<STATES>(0).copy_from(&state);
            if k + 1 < nodes.len() {
                let inputs = here.fixed_rows::<INPUTS>(STATES) + stage.gain * astray;
                here.fixed_rows_mut::<INPUTS>(STATES).copy_from(&inputs.sup(&least).inf(&most));
                state = Column::from(after(self.problem, k, here.as_ref()));
            }
            flown.push(here);
        }
        flown
    }
}

/// A symmetric matrix with its negative curvature mirrored; `None` if it is not finite.
fn convex(matrix: &SMatrix<f64, INPUTS, INPUTS>) -> Option<SMatrix<f64, INPUTS, INPUTS>> {
    let mut eigen = SymmetricEigen::try_new(*matrix, f64::EPSILON, EIGEN_SWEEPS)?;
    let least = CURVATURE.max(INPUT_CURVATURE * eigen.eigenvalues.amax());
    eigen.eigenvalues.apply(|value| *value = value.abs().max(least));
    Some(eigen.recompose())
}

fn settings() -> DefaultSettings<f64> {
    DefaultSettings {
        // A clock must not change the result.
        time_limit: f64::INFINITY,
        verbose: false,
        max_threads: 1,
        direct_solve_method: "qdldl".to_owned(),
        tol_gap_abs: ACCURACY,
        tol_gap_rel: ACCURACY,
        tol_feas: ACCURACY,
        presolve_enable: false,
        ..DefaultSettings::default()
    }
}

/// The entries of a sparse matrix.
#[derive(Default)]
struct Triplets {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Triplets {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }

    fn matrix(self, rows: usize, columns: usize) -> CscMatrix<f64> {
        CscMatrix::new_from_triplets(rows, columns, self.rows, self.columns, self.values)
    }
}
