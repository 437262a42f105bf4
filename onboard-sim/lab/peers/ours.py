"""The project's solver, in a process of its own on the same core, spoken to in lines."""

import subprocess

import numpy as np

import landing
import space_landing

# A condition whose multiplier is smaller than its penalty holds exactly, so a high penalty makes it a hard one.
PENALTIES = {space_landing.HARD: 10_000.0, space_landing.SOFT: space_landing.PENALTY_PER_UNIT}

# Of a metre of missed end height in the plane.
PLANE_PENALTY = 1000.0


class Ours:
    """Our solver on one of the two problems; in the plane without a problem."""

    name = "ours"

    def __init__(self, program, problem=None):
        self.problem = problem
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self._ask("penalty", PENALTIES.get(problem, PLANE_PENALTY))

    def _ask(self, *words):
        line = " ".join(repr(float(w)) if isinstance(w, float) else str(w) for w in words)
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().split()
        if not answer:
            raise SystemExit(f"our side ended at: {line}")
        return answer

    def _solve(self, *words):
        """(converged, ns, claimed cost, inputs)."""
        status, ns, _iterations, cost, _stationarity, _feasibility, _miss, *inputs = self._ask("space", *words)
        inputs = np.array(inputs, dtype=float).reshape(-1, space_landing.INPUTS)
        return status == "converged", int(ns), float(cost), inputs

    def cold(self, ratio, start):
        """A landing from its own guesses."""
        return self._solve("cold", ratio, *map(float, start))

    def adopt(self, ratio, start, _inputs, _nodes):
        self.cold(ratio, start)
        self.hold()

    def hold(self):
        self._ask("space", "hold")

    def warm(self, samples, start):
        return self._solve("warm", samples, *map(float, start))

    def plane_cold(self, start):
        """The inputs of a landing in the plane, which becomes the plan."""
        inputs = self._ask("cold", "both", *map(float, start))[7:]
        self._ask("hold")
        return np.array(inputs, dtype=float)

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
