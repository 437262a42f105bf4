"""Runs the entrants on the same problems, taking turns, and flies every answer again.

An entrant is `ours.Ours` or a `worker.Entrant`. Entrants of the hard and of the soft problem take turns, too.
"""

import dataclasses
import os

import numpy as np

import landing
import rollout
from ours import Ours
from result import BENDS_RAD, Result

# Whether to solve only a part of the problems.
SMALL = bool(os.environ.get("PEERS_SMALL"))

COLD_ROUNDS = 1 if SMALL else 7
# Of the seven starts, those of the warm solves, and of the closed loop.
WARM_STARTS = (0, 1, 3, 5) if SMALL else range(7)
LOOP_STARTS = (0, 1) if SMALL else range(7)
CALM_SAMPLES = range(1, landing.HORIZON, 4 if SMALL else 1)
KICK_SAMPLES = range(1, 49, 12 if SMALL else 6)
KICK_SIGNS = ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, -1))
KICK = np.array([0.0, 0.0, 0.0, 0.02, 0.02, np.radians(0.5)])
DISTURBANCE = np.array([0.0, 0.0, 0.0, 0.002, 0.002, np.radians(0.05)])
SEED = 20

# Our solver stopped early: so many iterations.
OUR_CAPS = (1, 2, 3, 4, 6, 8)


# The paper's seven: nominal, tilted, drifting, turning.
STARTS = [
    np.array([0.0, 15.0, np.radians(pitch_deg), -5.0, w, np.radians(q_deg)])
    for pitch_deg, w, q_deg in ((90, 0, 0), (60, 0, 0), (120, 0, 0), (90, -1, 0), (90, 1, 0), (90, 0, -5), (90, 0, 5))
]


@dataclasses.dataclass
class Solve:
    """One solve, and what its inputs do. An answer that did not converge is not flown."""

    ns: float
    converged: bool
    iterations: int
    first_rad: float
    flown: rollout.Flown | None
    confirmed: bool


def first_rad(result):
    return float(result.inputs[0]) if len(result.inputs) else np.nan


def single(entrant, result):
    """A single iteration. It claims no optimum; it fails where it has no input, or where a real-time iteration's QP is not
    solved."""
    first = first_rad(result)
    works = bool(np.isfinite(first)) and (result.converged or "warm" in entrant.makes)
    return Solve(result.ns, works, result.iterations, first, None, False)


class Checks:
    """The worst of what independent flights of an entrant's converged answers say."""

    def __init__(self):
        self.flown = self.refuted = 0
        self.cost = self.miss_m = self.gradient = 0.0

    def take(self, problem, start, result: Result):
        flown, confirmed = None, False
        if result.converged:
            flown = rollout.flown(start, result.inputs, problem)
            confirmed = flown.confirms(result, problem)
            self.flown += 1
            self.refuted += not confirmed
            self.cost = max(self.cost, abs(flown.cost - result.cost))
            self.gradient = max(self.gradient, flown.gradient)
            if problem == landing.HARD:
                self.miss_m = max(self.miss_m, abs(flown.z_m))
        return Solve(result.ns, result.converged, result.iterations, first_rad(result), flown, confirmed)


class Record:
    """All that one entrant did."""

    def __init__(self, entrant):
        self.entrant, self.checks = entrant, Checks()
        self.cold = {}  # (start, bend) or (start, "both"): solves, one a round
        self.calm, self.kicked, self.steps, self.loop = [], [], [], []
        self.step_error = []
        self.capped = {cap: [] for cap in OUR_CAPS} if isinstance(entrant, Ours) else {}
        self.heights_m = []  # of the closed loops at burn-out

    @property
    def problem(self):
        return self.entrant.problem

    @property
    def name(self):
        return self.entrant.name

    def solved(self, start, result):
        return self.checks.take(self.problem, start, result)


def cold(records):
    """Cold solves of the seven starts, round after round."""
    able = [record for record in records if "cold" in record.entrant.makes]
    for _ in range(COLD_ROUNDS):
        for number, start in enumerate(STARTS):
            for record in able:
                for bend in BENDS_RAD:
                    solve = record.solved(start, record.entrant.cold(start, bend))
                    record.cold.setdefault((number, bend), []).append(solve)
                if isinstance(record.entrant, Ours):
                    solve = record.solved(start, record.entrant.cold_both(start))
                    record.cold.setdefault((number, "both"), []).append(solve)


def _ours(records, problem):
    return next(r.entrant for r in records if isinstance(r.entrant, Ours) and r.problem == problem)


def adopt(records, start):
    """Gives every entrant the same landing as its plan; its states and inputs."""
    best = _ours(records, landing.SOFT).cold_both(start)
    nodes = rollout.states(start, best.inputs)
    for record in records:
        if isinstance(record.entrant, Ours):
            record.entrant.cold_both(start)
            record.entrant.hold()
        else:
            found = record.entrant.adopt(start, nodes, best.inputs)
            if found is not None and not found.converged:
                print(f"{record.name}, {record.problem}: does not converge from the optimum of {start}")
    return nodes, best.inputs


def warm(records):
    """Undisturbed and kicked warm solves along each start's landing, and single iterations after the kicks; the first
    inputs of the plan at the kicks."""
    planned_rad = []
    for start in (STARTS[number] for number in WARM_STARTS):
        nodes, inputs = adopt(records, start)
        for samples in CALM_SAMPLES:
            for record in records:
                if "warm" in record.entrant.makes:
                    record.calm.append(record.solved(nodes[samples], record.entrant.warm(samples, nodes[samples])))
        for samples in KICK_SAMPLES:
            for signs in KICK_SIGNS:
                planned_rad.append(float(inputs[samples]))
                state = nodes[samples] + KICK * np.array([0, 0, 0, *signs])
                for record in records:
                    kick(record, samples, state)
    return planned_rad


def kick(record, samples, state):
    """The warm solve and the single iteration of one entrant after one kick."""
    entrant = record.entrant
    if "warm" in entrant.makes:
        record.kicked.append(record.solved(state, entrant.warm(samples, state)))
    if "step" in entrant.makes:
        result = entrant.step(samples, state)
        record.steps.append(single(entrant, result))
    for cap, steps in record.capped.items():
        steps.append(single(entrant, entrant.step(samples, state, cap)))


class Loop:
    """One entrant's flight under disturbances. A public solver that fails warm may try again with the barrier of a cold
    solve, and even its last iterate is flown."""

    def __init__(self, record, start, inputs):
        self.record, self.state, self.inputs, self.since = record, start, inputs, 0

    def advance(self, push):
        """One sample: flies the plan's input, is pushed, plans again."""
        record, entrant = self.record, self.record.entrant
        self.state = np.array(landing.STEP(self.state, self.inputs[self.since])).ravel() + push
        self.since += 1
        if "warm" not in entrant.makes:
            result = entrant.step(self.since, self.state)
        else:
            result = entrant.warm(self.since, self.state)
            if not result.converged and not isinstance(entrant, Ours):
                again = entrant.warm(self.since, self.state, retry=True)
                result = dataclasses.replace(again, ns=again.ns + result.ns)
        if "warm" in entrant.makes:
            record.loop.append(record.solved(self.state, result))
        else:
            record.loop.append(single(entrant, result))
        if len(result.inputs) and np.all(np.isfinite(result.inputs)):
            entrant.hold()
            limit_rad = landing.GIMBAL_LIMIT_RAD
            self.inputs, self.since = np.clip(result.inputs, -limit_rad, limit_rad), 0

    def end(self):
        """Flies the last input."""
        self.state = np.array(landing.STEP(self.state, self.inputs[self.since])).ravel()
        self.record.heights_m.append(float(self.state[1]))


def disturbed(records):
    """Closed loops, side by side: everybody is pushed in the same way, and begins with the same landing."""
    random = np.random.default_rng(SEED)
    able = [record for record in records if record.entrant.loops]
    for start in (STARTS[number] for number in LOOP_STARTS):
        # All, because some take the plan of another.
        _, inputs = adopt(records, start)
        loops = [Loop(record, start, inputs) for record in able]
        for _ in range(1, landing.HORIZON):
            push = DISTURBANCE * random.normal(size=6)
            for loop in loops:
                loop.advance(push)
        for loop in loops:
            loop.end()
