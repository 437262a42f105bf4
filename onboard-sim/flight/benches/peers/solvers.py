"""The solvers, behind one interface: solve a problem twice, time the second, hand back inputs.

Times are processor times of the solving thread, ns, so that interruptions by other programs do not count.
"""

import dataclasses
import subprocess
import time

import casadi as ca
import numpy as np

import landing

# Several times what any solve of these problems that ends takes.
MOST_ITERATIONS = 100

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

# The fastest found of initial barriers 1e-1 to 1e-8 and distances of the start from the bounds (README.md).
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


# A path that misses the end height by more is no landing: with a hard end height the problem has no solution, m.
LANDING_MISS_M = 1e-6


@dataclasses.dataclass
class Result:
    """One solve. Inputs in rad; `plan` is what the same solver is warm-started with. `lands` is false where our
    solver, which may pay for a missed end height, had to or found the start out of reach."""

    converged: bool
    ns: int
    iterations: int
    cost: float
    inputs: np.ndarray
    plan: object = None
    lands: bool = True


def guess(start, bend):
    """Straight line in the states, the pitch bent by `bend` sin(2 pi k / N); no input. (path, 7 a stage.)"""
    share = np.arange(landing.HORIZON + 1) / landing.HORIZON
    states = start + np.outer(share, landing.TARGET - start)
    states[:, 2] += bend * np.sin(2.0 * np.pi * share)
    return path(states, np.zeros(landing.HORIZON))


def path(states, inputs):
    """States at the nodes and inputs as the NLP's variables."""
    return np.column_stack([inputs, states[1:]]).ravel()


class Nlp:
    """One compiled NLP in one CasADi solver; its buffers are filled in place, so that a call costs no Python."""

    def __init__(self, solver, intervals, folder, options, expand=False):
        library = landing.compiled(solver, intervals, folder, expand)
        quiet = {"print_time": False, "show_eval_warnings": False}
        options = {**quiet, **landing.structure(solver, intervals), **options}
        self.function = ca.nlpsol("S", solver, library, options)
        self.buffer, self.run = self.function.buffer()
        self.inputs = {name: np.zeros(self.function.size1_in(name)) for name in self.function.name_in()}
        self.outputs = {name: np.zeros(self.function.size1_out(name)) for name in self.function.name_out()}
        for index, name in enumerate(self.function.name_in()):
            self.buffer.set_arg(index, memoryview(self.inputs[name]))
        for index, name in enumerate(self.function.name_out()):
            self.buffer.set_res(index, memoryview(self.outputs[name]))
        lower = np.full((intervals, 7), -np.inf)
        lower[:, 0] = -landing.GIMBAL_LIMIT_RAD
        lower[-1, 1] = -landing.X_FINAL_M
        upper = -lower
        lower[-1, 2] = upper[-1, 2] = 0.0
        self.inputs["lbx"][:], self.inputs["ubx"][:] = lower.ravel(), upper.ravel()

    def solve(self, start, first, lam_x=0.0, lam_g=0.0):
        """Solves from a path and multipliers."""
        into = self.inputs
        into["p"][:], into["x0"][:], into["lam_x0"][:], into["lam_g0"][:] = start, first, lam_x, lam_g
        self.run()
        before = time.thread_time_ns()
        self.run()
        ns = time.thread_time_ns() - before
        stats, out = self.buffer.stats(), self.outputs
        plan = (out["x"].copy(), out["lam_x"].copy(), out["lam_g"].copy())
        converged = bool(stats["success"])
        return Result(converged, ns, stats["iter_count"], float(out["f"][0]), plan[0].reshape(-1, 7)[:, 0], plan)


class Public:
    """A public solver, cold and warm, over every length of horizon."""

    def __init__(self, solver, folder):
        self.solver, self.folder, self.warm_nlps = solver, folder, {}
        self.warm_options = {**COLD_OPTIONS[solver], **WARM_OPTIONS[solver]}
        self.cold_nlp = Nlp(solver, landing.HORIZON, folder, COLD_OPTIONS[solver], expand=True)
        self.plan = None

    def cold(self, start, bend):
        return self.cold_nlp.solve(start, guess(start, bend))

    def adopt(self, start, states, inputs):
        """Converges from a given optimum, so that every solver's plan is the same landing; holds it."""
        result = self.cold_nlp.solve(start, path(states, inputs))
        self.hold(result)
        return result

    def hold(self, result):
        self.plan = result.plan

    def warm(self, samples, start, retry=False):
        """Solves what is left some samples after the plan began, from the plan shifted; with `retry`, with the
        barrier of a cold solve."""
        variables, lam_x, lam_g = self.plan
        intervals = len(variables) // 7 - samples
        if (intervals, retry) not in self.warm_nlps:
            options = COLD_OPTIONS[self.solver] if retry else self.warm_options
            self.warm_nlps[intervals, retry] = Nlp(self.solver, intervals, self.folder, options)
        nlp = self.warm_nlps[intervals, retry]
        return nlp.solve(start, variables[7 * samples :], lam_x[7 * samples :], lam_g[6 * samples :])


class Ours:
    """The project's solver, in a process of its own on the same core, spoken to in lines."""

    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)

    def _ask(self, *words):
        line = " ".join(repr(float(w)) if isinstance(w, float) else str(w) for w in words)
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().split()
        if not answer:
            raise SystemExit(f"our side ended at: {line}")
        return answer

    def _solve(self, *words):
        status, ns, iterations, cost, _stationarity, _feasibility, miss, *inputs = self._ask(*words)
        inputs = np.array([float(word) for word in inputs])
        lands = status == "converged" and float(miss) <= LANDING_MISS_M
        return Result(status == "converged", int(ns), int(iterations), float(cost), inputs, None, lands)

    def cold(self, start):
        """From its own two guesses, bent either way."""
        return self._solve("cold", *map(float, start))

    def hold(self, _result):
        self._ask("hold")

    def warm(self, samples, start):
        return self._solve("warm", samples, *map(float, start))

    def layers(self, start):
        """Derivatives, Newton step, whole solve of one iteration, ns."""
        return [float(word) for word in self._ask("sweep", *map(float, start))]

    def peak(self):
        """Multiply-adds in flop/ns; latencies of addition, multiplication, division and root, ns."""
        return [float(word) for word in self._ask("peak")]
