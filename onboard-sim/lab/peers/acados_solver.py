"""acados on a landing in the plane, in every one of its ways; `space_acados` has the landing in space.

Dynamics are discrete: the same step as everybody's. One solver for each length of the horizon, all from one
generated program for each way: exact Hessians (CONVEXIFY) or Gauss-Newton, HPIPM after partial or full condensing. Cold with
a merit line search; warm with full steps, all multipliers and the slacks handed over, the path rolled out from the kicked
state. A few microseconds of its Python interface are in its times.
"""

import dataclasses
import itertools
import os
import time

import casadi as ca
import numpy as np

import acados_problem
import landing
import rollout
from result import Result, cost, guess


@dataclasses.dataclass
class Plan:
    """A path with all its multipliers: of the dynamics, and of the limits at each node."""

    states: np.ndarray
    inputs: np.ndarray
    dynamics: list
    limits: list

    def rest(self, samples):
        return Plan(self.states[samples:], self.inputs[samples:], self.dynamics[samples:], self.limits[samples:])


class Acados:
    """One way of acados on one of the two problems."""

    def __init__(self, kind, folder, model):
        """`model`: whose plan is adopted; itself if it is `None`."""
        from acados_template import AcadosOcpSolver

        self.kind, self.posed, self.model, self.solvers = kind, kind.posed, model, {}
        given = [ca.SX.sym(f"given_{index}", self.posed.STEP.size1_in(index)) for index in range(self.posed.STEP.n_in())]
        self.by_state = ca.Function("by_state", given, [ca.jacobian(self.posed.STEP(*given), given[0])])
        self.name, self.problem = kind.name, kind.problem
        self.makes = ("step",) if kind.rti else ("cold", "warm")
        # Most Gauss-Newton solves of a disturbed loop run to their cap: its single iterations stand for it.
        self.loops = kind.rti or kind.exact
        self.plan = self.last = None
        code = os.path.join(folder, kind.model_name)
        self.json = code + ".json"
        if not os.path.exists(code + ".built"):
            made = acados_problem.problem(kind)
            made.code_export_directory = code
            AcadosOcpSolver.generate(made, json_file=self.json)
            AcadosOcpSolver.build(code, with_cython=False, verbose=False)
            open(code + ".built", "w", encoding="utf-8").close()

    def solver(self, intervals):
        """The solver of a horizon."""
        from acados_template import AcadosOcpSolver

        if intervals not in self.solvers:
            made = AcadosOcpSolver(None, json_file=self.json, build=False, generate=False, verbose=False)
            if intervals != self.posed.HORIZON:
                made.set_new_time_steps(np.full(intervals, self.posed.STEP_S))
                if not self.kind.full:
                    made.update_qp_solver_cond_N(min(acados_problem.BLOCKS[self.posed], intervals))
            lower, upper, ((way, _), (end, _)) = acados_problem.bounded(self.kind, intervals)
            for node in range(1, intervals + 1):
                index = self.posed.INPUTS + (end if node == intervals else way)
                if len(index):
                    made.constraints_set(node, "lbx", lower[node - 1, index])
                    made.constraints_set(node, "ubx", upper[node - 1, index])
            self.solvers[intervals] = made
        return self.solvers[intervals]

    def fill(self, solver, start, plan, with_multipliers, *thrust):
        """Puts a start and a first path into a solver."""
        intervals, inputs = len(plan.inputs), self.posed.INPUTS
        first = inputs + self.posed.STATES
        for bound in ("lbx", "ubx"):
            solver.set(0, bound, start)
        for k in range(intervals + 1):
            solver.set(k, "x", plan.states[k])
            multiplier = np.zeros(len(solver.get(k, "lam")))
            if with_multipliers:
                if len(plan.limits[k]) == len(multiplier):
                    multiplier[:] = plan.limits[k]
                else:
                    # A later node of the plan becomes the first. The start has multipliers instead of the state's bounds: the
                    # dynamics' of the step before it, which is not in the plan.
                    there = inputs + len(acados_problem.bounded(self.kind, intervals)[2][0][0])
                    multiplier[:inputs] = plan.limits[0][:inputs]
                    multiplier[first : first + inputs] = plan.limits[0][there : there + inputs]
                    of_start = np.array(self.by_state(plan.states[0], plan.inputs[0], *(row[0] for row in thrust))).T @ plan.dynamics[0]
                    multiplier[inputs:first] = np.maximum(of_start, 0.0)
                    multiplier[first + inputs :] = np.maximum(-of_start, 0.0)
            solver.set(k, "lam", multiplier)
            if k < intervals:
                solver.set(k, "u", np.ravel(plan.inputs[k]))
                solver.set(k, "pi", plan.dynamics[k] if with_multipliers else np.zeros(self.posed.STATES))
                for row in thrust:
                    solver.set(k, "p", row[k])
            for slack in ("sl", "su"):
                solver.set(k, slack, np.zeros(len(solver.get(k, slack))))

    def solve(self, start, plan, with_multipliers, *thrust):
        """Solves twice from a path; the second run is timed. `thrust`: of each interval, in space."""
        intervals = len(plan.inputs)
        solver = self.solver(intervals)
        if not self.kind.rti:
            # With the line search more of the warm solves fail, and those in space are slower.
            search = self.posed is landing and not with_multipliers
            solver.options_set("globalization", "merit_backtracking" if search else "fixed_step")
            # Without its slacks even an optimum looks unsolved to it.
            solver.options_set("initialize_t_slacks", 1 if with_multipliers else 0)
        for _ in range(2):
            solver.reset()
            self.fill(solver, start, plan, with_multipliers, *thrust)
            before = time.thread_time_ns()
            status = solver.solve()
            ns = time.thread_time_ns() - before
        nodes, steps = range(intervals + 1), range(intervals)
        self.last = Plan(
            np.array([solver.get(k, "x") for k in nodes]),
            np.array([solver.get(k, "u") for k in steps]),
            [solver.get(k, "pi") for k in steps],
            [solver.get(k, "lam") for k in nodes],
        )
        iterations = int(np.ravel(solver.get_stats("sqp_iter"))[0])
        inputs = self.last.inputs
        converged = status == 0 and bool(np.all(np.isfinite(inputs)))
        shown = inputs if self.posed.INPUTS > 1 else inputs.ravel()
        return Result(converged, ns, iterations, cost(self.last.states, inputs, self.posed), shown)

    def cold(self, start, bend_rad):
        return self.solve(start, Plan(*guess(start, bend_rad), None, None), False)

    def adopt(self, start, states, inputs):
        """Converges from a given optimum; holds it."""
        if self.model is not None:
            self.plan = self.model.plan
            return None
        result = self.solve(start, Plan(np.asarray(states), np.asarray(inputs), None, None), False)
        self.hold()
        return result

    def hold(self):
        self.plan = self.last

    def warm(self, samples, start, retry=False):
        """Solves what is left some samples after the plan began, from the plan shifted and rolled out from where the
        vehicle is; with `retry`, without multipliers. A single iteration of the soft problem is nearer the optimum from
        the plan as it is; with a hard end height every fifth QP then has no solution."""
        rest = self.plan.rest(samples)
        if not (self.kind.rti and self.problem == landing.SOFT):
            rest.states = rollout.states(start, rest.inputs)
        return self.solve(start, rest, not retry)

    def step(self, samples, start):
        """One real-time iteration, preparation and feedback."""
        return self.warm(samples, start)


def entrants(folder, wheel_folder):
    """Called by `worker`. All adopt the plan of the exact SQP: from an optimum without multipliers others do not converge."""
    version = acados_problem.installed(wheel_folder)
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)  # acados writes into the working directory
    made = []
    for problem in (landing.HARD, landing.SOFT):
        model = None
        for rti, exact, full in itertools.product((False, True), (True, False), (False, True)):
            entrant = Acados(acados_problem.Kind(landing, problem, rti, exact, full), folder, model)
            model = model or entrant
            made.append(entrant)
    return version, made
