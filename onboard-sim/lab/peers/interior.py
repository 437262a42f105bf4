"""fatrop and IPOPT, which take the problem's compiled functions through CasADi.

CasADi's plug-ins with exact Hessians, called through CasADi's buffers, without Python's conversions; its own overhead is
in their times. Variables are ordered by stage, and fatrop is told the structure outright. Warm, IPOPT is handed the
multipliers; fatrop's interface takes the path alone. Both begin with the barrier that was the fastest of 1e-1 to 1e-8.
"""

import glob
import os
import time

import casadi as ca
import numpy as np

import space_landing
from landing import TOLERANCE
from space_entrant import InSpace
from space_landing import HARD, SOFT

# Several times what any solve of these problems that ends takes.
MOST_ITERATIONS = 100

COLD_OPTIONS = {
    "fatrop": {
        "fatrop.print_level": 0,
        "fatrop.tol": TOLERANCE,
        "fatrop.max_iter": MOST_ITERATIONS,
    },
    "ipopt": {
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": TOLERANCE,
        "ipopt.max_iter": MOST_ITERATIONS,
        "ipopt.linear_solver": "mumps",
    },
}

# The fastest found of initial barriers 1e-1 to 1e-8 and distances of the start from the bounds.
WARM_OPTIONS = {
    "fatrop": {"fatrop.mu_init": 1e-7, "fatrop.bound_push": 1e-12, "fatrop.bound_frac": 1e-12},
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

COLD, WARM = "cold", "warm"


def options(solver, how):
    """Of a solver for one kind of solve."""
    chosen = {"print_time": False, "show_eval_warnings": False, **COLD_OPTIONS[solver]}
    if how != COLD:
        chosen |= WARM_OPTIONS[solver]
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
        for name, bound in zip(("lbx", "ubx", "lbg", "ubg"), bounds):
            self.inputs[name][:] = bound

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


class Interior(InSpace):
    """One of them on one of the two problems."""

    def __init__(self, solver, problem, folder):
        self.name, self.solver, self.problem, self.folder = solver, solver, problem, folder
        self.nlps = {}

    def made(self, intervals, how, limits):
        library = space_landing.library_path(self.solver, intervals, self.problem, self.folder)
        chosen = options(self.solver, how) | space_landing.structure(self.solver, intervals, self.problem)
        return Nlp(self.solver, library, chosen, limits)

    def _solved(self, intervals, how, start, *given):
        if (intervals, how) not in self.nlps:
            self.nlps[intervals, how] = self.made(intervals, how, space_landing.limits(intervals, self.problem))
        converged, ns, _, found = self.nlps[intervals, how].solve([*start, *self.thrust[-intervals:]], *given)
        inputs, states = (found[0][at] for at in space_landing.places(intervals, self.problem)[:2])
        self.last = intervals, *found
        return converged, ns, space_landing.cost(np.vstack([start, states]), inputs), inputs

    def first(self, start, path):
        return self._solved(len(path), COLD, start, space_landing.variables(path, self.problem))

    def rest(self, samples, start, retry):
        planned, path, lam_x, lam_g = self.plan
        gone, equations = space_landing.WIDTH * samples, space_landing.STATES * samples
        return self._solved(planned - samples, COLD if retry else WARM, start, path[gone:], lam_x[gone:], lam_g[equations:])


def version(solver):
    package = os.path.dirname(ca.__file__)
    numbered = sorted(glob.glob(os.path.join(package, f"lib{solver}.so.*")), key=len)
    number = numbered[-1].split(".so.")[1] if numbered else "of unknown version"
    return f"{solver} {number} in casadi {ca.__version__}"


def entrants(solver, folder):
    """Called by `worker`."""
    return version(solver), [Interior(solver, problem, folder) for problem in (HARD, SOFT)]
