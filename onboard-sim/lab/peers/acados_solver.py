"""acados on the landing problem, in every one of its ways.

Dynamics are discrete: the same RK4 step as everybody's. One solver for each length of the horizon, all from one
generated program for each way: exact Hessians (CONVEXIFY) or Gauss-Newton, HPIPM after partial or full condensing. Cold with
a merit line search; warm with full steps, all multipliers and the slacks handed over, the path rolled out from the kicked
state. A few microseconds of its Python interface are in its times.
"""

import dataclasses
import itertools
import os
import time

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

        self.kind, self.model, self.solvers = kind, model, {}
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
            if intervals != landing.HORIZON:
                made.set_new_time_steps(np.full(intervals, landing.STEP_S))
                if not self.kind.full:
                    made.update_qp_solver_cond_N(min(acados_problem.BLOCKS, intervals))
            self.solvers[intervals] = made
        return self.solvers[intervals]

    def fill(self, solver, start, plan, with_multipliers):
        """Puts a start and a first path into a solver."""
        intervals = len(plan.inputs)
        for bound in ("lbx", "ubx"):
            solver.set(0, bound, start)
        for k in range(intervals + 1):
            solver.set(k, "x", plan.states[k])
            multiplier = np.zeros(len(solver.get(k, "lam")))
            if with_multipliers:
                # The first node has multipliers of the start, too; a later one of the plan becomes the first.
                here, there = len(multiplier) // 2, len(plan.limits[k]) // 2
                shared = min(here, there)
                multiplier[:shared] = plan.limits[k][:shared]
                multiplier[here : here + shared] = plan.limits[k][there : there + shared]
                if k == 0 and here == 7:
                    # The dynamics' multiplier of the step before it, which is not in the plan.
                    _, by_state, _ = rollout.tangent(plan.states[0], plan.inputs[0])
                    of_start = np.array(by_state).T @ plan.dynamics[0]
                    multiplier[1:7], multiplier[8:] = np.maximum(of_start, 0.0), np.maximum(-of_start, 0.0)
            solver.set(k, "lam", multiplier)
            if k < intervals:
                solver.set(k, "u", np.array([plan.inputs[k]]))
                solver.set(k, "pi", plan.dynamics[k] if with_multipliers else np.zeros(6))
        if self.problem == landing.SOFT:
            for slack in ("sl", "su"):
                solver.set(intervals, slack, np.zeros(1))

    def solve(self, start, plan, with_multipliers):
        """Solves twice from a path; the second run is timed."""
        intervals = len(plan.inputs)
        solver = self.solver(intervals)
        if not self.kind.rti:
            # With the line search more of the warm solves fail.
            solver.options_set("globalization", "fixed_step" if with_multipliers else "merit_backtracking")
            # Without its slacks even an optimum looks unsolved to it.
            solver.options_set("initialize_t_slacks", 1 if with_multipliers else 0)
        for _ in range(2):
            solver.reset()
            self.fill(solver, start, plan, with_multipliers)
            before = time.thread_time_ns()
            status = solver.solve()
            ns = time.thread_time_ns() - before
        nodes, steps = range(intervals + 1), range(intervals)
        self.last = Plan(
            np.array([solver.get(k, "x") for k in nodes]),
            np.array([solver.get(k, "u")[0] for k in steps]),
            [solver.get(k, "pi") for k in steps],
            [solver.get(k, "lam") for k in nodes],
        )
        iterations = int(np.ravel(solver.get_stats("sqp_iter"))[0])
        finite = bool(np.all(np.isfinite(self.last.inputs)))
        return Result(status == 0 and finite, ns, iterations, cost(self.last.states, self.last.inputs), self.last.inputs)

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
            entrant = Acados(acados_problem.Kind(problem, rti, exact, full), folder, model)
            model = model or entrant
            made.append(entrant)
    return version, made
