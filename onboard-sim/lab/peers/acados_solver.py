"""acados on the landing: SQP with exact Hessian and full steps, HPIPM after partial condensing.

One solver for each length of the horizon, all from one generated program for each end. Warm, it gets the plan as it is, all
multipliers and the slacks: rolled out from where the vehicle is, it is slower. A few microseconds of its Python interface are
in its times.
"""

import dataclasses
import os
import time

import casadi as ca
import numpy as np

import acados_problem
from space_entrant import InSpace
from space_landing import HARD, HORIZON, INPUTS, SOFT, STATES, STEP, STEP_S, WIDTH, cost

_GIVEN = [ca.SX.sym(f"given_{index}", STEP.size1_in(index)) for index in range(STEP.n_in())]
by_state = ca.Function("by_state", _GIVEN, [ca.jacobian(STEP(*_GIVEN), _GIVEN[0])])


@dataclasses.dataclass
class Plan:
    """A path; with all its multipliers, if it is a solution: of the dynamics, and of the limits at each node."""

    states: np.ndarray
    inputs: np.ndarray
    dynamics: list | None = None
    limits: list | None = None


class Acados(InSpace):
    """On one of the two problems."""

    name = "acados"

    def __init__(self, problem, folder):
        from acados_template import AcadosOcpSolver

        self.problem, self.solvers = problem, {}
        code = os.path.join(folder, acados_problem.model_name(problem))
        self.json = code + ".json"
        if not os.path.exists(code + ".built"):
            made = acados_problem.problem(problem)
            made.code_export_directory = code
            AcadosOcpSolver.generate(made, json_file=self.json)
            AcadosOcpSolver.build(code, with_cython=False, verbose=False)
            open(code + ".built", "w", encoding="utf-8").close()

    def solver(self, intervals):
        """The solver of a horizon."""
        from acados_template import AcadosOcpSolver

        if intervals not in self.solvers:
            made = AcadosOcpSolver(None, json_file=self.json, build=False, generate=False, verbose=False)
            if intervals != HORIZON:
                made.set_new_time_steps(np.full(intervals, STEP_S))
                made.update_qp_solver_cond_N(min(acados_problem.BLOCKS, intervals))
            lower, upper, ((way, _), (end, _)) = acados_problem.bounded(self.problem, intervals)
            for node in range(1, intervals + 1):
                index = INPUTS + (end if node == intervals else way)
                made.constraints_set(node, "lbx", lower[node - 1, index])
                made.constraints_set(node, "ubx", upper[node - 1, index])
            self.solvers[intervals] = made
        return self.solvers[intervals]

    def fill(self, solver, start, plan, thrust, with_multipliers):
        """Puts a start and a first path into a solver."""
        intervals = len(plan.inputs)
        for bound in ("lbx", "ubx"):
            solver.set(0, bound, start)
        for k in range(intervals + 1):
            solver.set(k, "x", plan.states[k])
            multiplier = np.zeros(len(solver.get(k, "lam")))
            if with_multipliers and k > 0:
                multiplier[:] = plan.limits[k]
            elif with_multipliers:
                # A later node of the plan becomes the first. The start has multipliers instead of the state's bounds: the
                # dynamics' of the step before it, which is not in the plan.
                there = INPUTS + len(acados_problem.bounded(self.problem, intervals)[2][0][0])
                of_start = np.array(by_state(plan.states[0], plan.inputs[0], thrust[0])).T @ plan.dynamics[0]
                for side, at, sign in ((0, 0, 1.0), (WIDTH, there, -1.0)):
                    multiplier[side : side + INPUTS] = plan.limits[0][at : at + INPUTS]
                    multiplier[side + INPUTS : side + WIDTH] = np.maximum(sign * of_start, 0.0)
            solver.set(k, "lam", multiplier)
            if k < intervals:
                solver.set(k, "u", plan.inputs[k])
                solver.set(k, "p", thrust[k])
                solver.set(k, "pi", plan.dynamics[k] if with_multipliers else np.zeros(STATES))
            for slack in ("sl", "su"):
                solver.set(k, slack, np.zeros(len(solver.get(k, slack))))

    def solve(self, start, plan, with_multipliers):
        """Solves twice from a path; the second run is timed."""
        intervals = len(plan.inputs)
        solver = self.solver(intervals)
        # Without its slacks even an optimum looks unsolved to it.
        solver.options_set("initialize_t_slacks", 1 if with_multipliers else 0)
        for _ in range(2):
            solver.reset()
            self.fill(solver, start, plan, self.thrust[-intervals:], with_multipliers)
            before = time.thread_time_ns()
            status = solver.solve()
            ns = time.thread_time_ns() - before
        nodes, steps = range(intervals + 1), range(intervals)
        states, inputs = (np.array([solver.get(k, name) for k in of]) for name, of in (("x", nodes), ("u", steps)))
        self.last = Plan(states, inputs, [solver.get(k, "pi") for k in steps], [solver.get(k, "lam") for k in nodes])
        return status == 0 and bool(np.all(np.isfinite(inputs))), ns, cost(states, inputs), inputs

    def first(self, start, path):
        inputs, after = np.split(path, [INPUTS], axis=1)
        return self.solve(start, Plan(np.vstack([start, after]), inputs), False)

    def rest(self, samples, start, retry):
        plan = self.plan
        rest = Plan(plan.states[samples:], plan.inputs[samples:], plan.dynamics[samples:], plan.limits[samples:])
        return self.solve(start, rest, not retry)


def entrants(folder, wheel_folder):
    """Called by `worker`."""
    version = acados_problem.installed(wheel_folder)
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)  # acados writes into the working directory
    return version, [Acados(problem, folder) for problem in (HARD, SOFT)]
