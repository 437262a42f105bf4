"""The project's solver, in a process of its own on the same core, spoken to in lines."""

import subprocess

import numpy as np

import landing
from result import BENDS_RAD, Result

# With this penalty a condition whose multiplier is smaller holds exactly, so it is a hard one; per metre. In space the
# multipliers are larger.
HARD_PENALTY_PER_M = landing.PENALTY_PER_M
SPACE_HARD_PENALTY = 10_000.0

# Iterations of a solve that is not to be stopped, as in the profile.
MOST_ITERATIONS = 60

# A path that misses the end height by more is no solution of the hard problem, m.
HARD_MISS_M = 1e-6


class Ours:
    """Our solver on one of the two problems."""

    name, makes, loops = "ours", ("cold", "warm", "step"), True

    def __init__(self, program, problem, hard_penalty=HARD_PENALTY_PER_M):
        self.problem, self.status = problem, None
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self._ask("penalty", landing.PENALTY_PER_M if problem == landing.SOFT else hard_penalty)

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
        self.status = status.replace("-", " ")
        converged = status == "converged"
        if self.problem == landing.HARD and not float(miss) <= HARD_MISS_M:
            converged = False
        return Result(converged, int(ns), int(iterations), float(cost), inputs)

    def cold(self, start, bend_rad):
        """From one guess."""
        return self._solve("cold", BENDS_RAD.index(bend_rad), *map(float, start))

    def cold_both(self, start):
        """From both guesses; the better landing."""
        return self._solve("cold", "both", *map(float, start))

    def hold(self):
        self._ask("hold")

    def warm(self, samples, start):
        return self._solve("warm", samples, MOST_ITERATIONS, *map(float, start))

    def step(self, samples, start, iterations=1):
        """A warm solve that is stopped after so many iterations."""
        return self._solve("warm", samples, iterations, *map(float, start))

    def _space(self, *words):
        status, ns, _iterations, cost, _stationarity, _feasibility, _miss, *inputs = self._ask("space", *words)
        return status == "converged", int(ns), float(cost), np.array([float(word) for word in inputs]).reshape(-1, 3)

    def space_cold(self, ratio, start):
        """A landing in space, from its own guesses: (converged, ns, claimed cost, inputs)."""
        return self._space("cold", ratio, *map(float, start))

    def space_adopt(self, ratio, start, _inputs, _nodes):
        self.space_cold(ratio, start)
        self.space_hold()

    def space_hold(self):
        self._ask("space", "hold")

    def space_warm(self, samples, start):
        return self._space("warm", samples, *map(float, start))

    def quadratic(self, start):
        """One step's quadratic problem, and the answer as `quadratic` has it."""
        swept, *words = self._ask("quadratic", *map(float, start))
        numbers = np.array(words[: 48 * landing.HORIZON], dtype=float).reshape(landing.HORIZON, 8, 6)
        status, ns, iterations, _cost, _stationarity, _feasibility, _miss, *inputs = words[numbers.size :]
        return numbers, (status == "converged", int(ns), int(iterations), float(swept), np.array(inputs, dtype=float))

    def layers(self, start):
        """Derivatives, Newton step, whole solve of one iteration, ns."""
        return [float(word) for word in self._ask("sweep", *map(float, start))]

    def peak(self):
        """Multiply-adds in flop/ns; latencies of addition, multiplication, division and root, ns."""
        return [float(word) for word in self._ask("peak")]
