"""The interior-point methods that take the problem's compiled functions through CasADi: fatrop and IPOPT.

CasADi's plug-ins with exact Hessians, called through CasADi's buffers, without Python's conversions; its own overhead is
in their times. Variables are ordered by stage, and fatrop is told the structure outright. Warm, IPOPT is handed the
multipliers; fatrop's interface takes the path alone. Both begin with the barrier that was the fastest of 1e-1 to 1e-8.
"""

import glob
import os
import time

import casadi as ca
import numpy as np

import landing
from result import MOST_ITERATIONS, Result, cost, guess

COLD_OPTIONS = {
    "fatrop": {
        "fatrop.print_level": 0,
        "fatrop.tol": landing.TOLERANCE,
        "fatrop.max_iter": MOST_ITERATIONS,
    },
    "ipopt": {
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": landing.TOLERANCE,
        "ipopt.max_iter": MOST_ITERATIONS,
        "ipopt.linear_solver": "mumps",
    },
}

# The fastest found of initial barriers 1e-1 to 1e-8 and distances of the start from the bounds.
WARM_OPTIONS = {
    "fatrop": {"fatrop.mu_init": 1e-8},
    "ipopt": {
        "ipopt.warm_start_init_point": "yes",
        "ipopt.mu_init": 1e-8,
        "ipopt.warm_start_bound_push": 1e-9,
        "ipopt.warm_start_bound_frac": 1e-9,
        "ipopt.warm_start_slack_bound_push": 1e-9,
        "ipopt.warm_start_slack_bound_frac": 1e-9,
        "ipopt.warm_start_mult_bound_push": 1e-9,
    },
}

COLD, WARM, ONE_STEP = "cold", "warm", "one step"


def variables(states, inputs, problem):
    """A path as the NLP's variables; the slacks hold its miss."""
    z_m = states[-1, 1]
    miss = [max(z_m, 0.0), max(-z_m, 0.0)][: landing.slacks(problem)]
    return np.append(np.column_stack([inputs, states[1:]]).ravel(), miss)


def claimed(found, intervals):
    """Inputs and running cost of the NLP's variables."""
    stages = found[: 7 * intervals].reshape(-1, 7)
    inputs = stages[:, 0].copy()
    return inputs, cost(np.vstack([np.zeros(6), stages[:, 1:]]), inputs)


def options(solver, how):
    """Of a solver for one kind of solve."""
    chosen = {"print_time": False, "show_eval_warnings": False, **COLD_OPTIONS[solver]}
    if how != COLD:
        chosen |= WARM_OPTIONS[solver]
    if how == ONE_STEP:
        chosen[f"{solver}.max_iter"] = 1
    return chosen


class Nlp:
    """One compiled NLP in one CasADi solver; its buffers are filled in place, so that a call costs no Python."""

    def __init__(self, solver, library, chosen, bounds):
        self.function = ca.nlpsol("S", solver, library, chosen)
        self.buffer, self.run = self.function.buffer()
        self.inputs = {name: np.zeros(self.function.size1_in(name)) for name in self.function.name_in()}
        self.outputs = {name: np.zeros(self.function.size1_out(name)) for name in self.function.name_out()}
        for index, name in enumerate(self.function.name_in()):
            self.buffer.set_arg(index, memoryview(self.inputs[name]))
        for index, name in enumerate(self.function.name_out()):
            self.buffer.set_res(index, memoryview(self.outputs[name]))
        self.inputs["lbx"][:], self.inputs["ubx"][:] = bounds[:2]
        if len(bounds) > 2:
            self.inputs["lbg"][:], self.inputs["ubg"][:] = bounds[2:]

    def solve(self, parameter, first, lam_x=0.0, lam_g=0.0):
        """Solves twice from a path and multipliers, and times the second: (converged, ns, iterations, plan)."""
        into = self.inputs
        into["p"][:], into["x0"][:], into["lam_x0"][:], into["lam_g0"][:] = parameter, first, lam_x, lam_g
        self.run()
        before = time.thread_time_ns()
        self.run()
        ns = time.thread_time_ns() - before
        stats, out = self.buffer.stats(), self.outputs
        plan = (out["x"].copy(), out["lam_x"].copy(), out["lam_g"].copy())
        return bool(stats["success"]), ns, stats["iter_count"], plan


class Interior:
    """fatrop or IPOPT on one of the two problems, cold and warm, over every length of horizon."""

    makes, loops = ("cold", "warm", "step"), True

    def __init__(self, solver, problem, folder):
        self.name, self.solver, self.problem, self.folder = solver, solver, problem, folder
        self.nlps, self.plan, self.last = {}, None, None

    def solve(self, intervals, how, *given):
        """Solves a horizon from what is given; keeps the plan."""
        if (intervals, how) not in self.nlps:
            library = landing.library_path(self.solver, intervals, self.problem, self.folder)
            chosen = options(self.solver, how) | landing.structure(self.solver, intervals, self.problem)
            self.nlps[intervals, how] = Nlp(self.solver, library, chosen, landing.bounds(intervals, self.problem))
        converged, ns, iterations, self.last = self.nlps[intervals, how].solve(*given)
        inputs, running = claimed(self.last[0], intervals)
        return Result(converged, ns, iterations, running, inputs)

    def cold(self, start, bend_rad):
        return self.solve(landing.HORIZON, COLD, start, variables(*guess(start, bend_rad), self.problem))

    def adopt(self, start, states, inputs):
        """Converges from a given optimum, so that every solver's plan is the same landing; holds it."""
        result = self.solve(landing.HORIZON, COLD, start, variables(states, inputs, self.problem))
        self.hold()
        return result

    def hold(self):
        self.plan = self.last

    def _warm(self, samples, start, how):
        path, lam_x, lam_g = self.plan
        intervals = (len(path) - landing.slacks(self.problem)) // 7 - samples
        rest = path[7 * samples :], lam_x[7 * samples :], lam_g[6 * samples :]
        return self.solve(intervals, how, start, *rest)

    def warm(self, samples, start, retry=False):
        """Solves what is left some samples after the plan began, from the plan shifted; with `retry`, with the
        barrier of a cold solve."""
        return self._warm(samples, start, COLD if retry else WARM)

    def step(self, samples, start):
        """One iteration of a warm solve."""
        return self._warm(samples, start, ONE_STEP)


def version(solver):
    package = os.path.dirname(ca.__file__)
    numbered = sorted(glob.glob(os.path.join(package, f"lib{solver}.so.*")), key=len)
    number = numbered[-1].split(".so.")[1] if numbered else "of unknown version"
    return f"{solver} {number} in casadi {ca.__version__}"


def entrants(solver, folder):
    """Called by `worker`."""
    return version(solver), [Interior(solver, problem, folder) for problem in (landing.HARD, landing.SOFT)]
