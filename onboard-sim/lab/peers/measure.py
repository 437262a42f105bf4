"""The landing in space: cold, kicked, undisturbed, and the disturbed closed loop, with a hard end and with one that has a price."""

import dataclasses
import os

import numpy as np

import space_landing
from ours import Ours
from space_landing import HARD, SOFT
from tables import NS_PER_MS, dearer, geometric, head, number, row, shown

# Whether to solve only a part of the problems.
SMALL = bool(os.environ.get("PEERS_SMALL"))

RATIOS = (1.6, 1.8)
START = np.array([0.3, 0.0, 17.6, -0.4, -0.5, -12.5, -0.05, 0.03, 0.0, 0.0])
# Added to the start, one case each: nothing, drift, another drift, a lean.
CASES = ({}, {3: 0.8, 4: 0.5}, {3: -0.6, 4: 1.0}, {6: 0.1, 9: 0.2})
KICK_SAMPLES = (1, 11, 21)
# Sideways, m/s, and of the lean's rate, rad/s.
KICKS = ((0.1, -0.05), (-0.1, 0.05), (0.1, 0.05), (-0.1, -0.05))
# At every sample of the loop, up or down: of the velocity and of the leans' rates.
PUSH = np.array([0.0] * 3 + [0.02, 0.02, 0.02] + [0.0] * 2 + [np.radians(0.5)] * 2)
SEED = 20
ROUNDS = 1 if SMALL else 5
LOOPS = (0, 4) if SMALL else range(len(RATIOS) * len(CASES))
# Ours wants more intervals than the box has nodes.
LOOP_SAMPLES = space_landing.HORIZON - space_landing.SETTLED_NODES - 1

# An answer that breaks a condition by more is no landing, m, m/s, rad or rad/s.
LANDED = 1e-3
# What an answer may claim and fly apart: share of the cost.
COST_SHARE = 1e-4

COLD, KICKED, CALM, LOOP = "cold, both guesses", "kicked", "undisturbed", "closed loop"


def cases():
    for ratio in RATIOS:
        for case in CASES:
            start = START.copy()
            for index, change in case.items():
                start[index] += change
            yield ratio, start


@dataclasses.dataclass
class Solve:
    ns: float
    solved: bool
    cost: float


class Record:
    """One entrant's solves: by kind and by problem, the fastest of its repeats."""

    def __init__(self, entrant):
        self.entrant, self.cost_off, self.ends = entrant, 0.0, []
        self.solves = {kind: {} for kind in (COLD, KICKED, CALM, LOOP)}

    def take(self, kind, number_of, start, thrust, answer):
        """Flies an answer again; whether it is one."""
        converged, ns, claimed, inputs = answer
        solved, cost = False, np.inf
        if converged:
            cost, broken, missed, _ = space_landing.flown(start, inputs, thrust, self.entrant.problem)
            off = abs(cost - claimed)
            solved = broken <= LANDED and off <= COST_SHARE * max(1.0, cost)
            cost += space_landing.PENALTY_PER_UNIT * missed
            self.cost_off = max(self.cost_off, off)
        before = self.solves[kind].get(number_of)
        self.solves[kind][number_of] = Solve(min(ns, before.ns) if before else ns, solved, cost)
        return solved


def run(entrants):
    """All tables. The entrants of both problems take turns."""
    records = [Record(entrant) for entrant in entrants]
    random = np.random.default_rng(SEED)
    for repeat in range(ROUNDS):
        for number_of, (ratio, start) in enumerate(cases()):
            thrust = space_landing.thrusts(ratio)
            for record in records:
                record.take(COLD, number_of, start, thrust, record.entrant.cold(ratio, start))
            if repeat == 0:
                warm(records, number_of, ratio, start)
            if repeat == 0 and number_of in LOOPS:
                loop(records, number_of, ratio, start, PUSH * random.choice((-1.0, 1.0), (LOOP_SAMPLES, space_landing.STATES)))
    for problem in (HARD, SOFT):
        show(problem, [record for record in records if record.entrant.problem == problem])


def adopt(records, ratio, start):
    """The same landing is everybody's plan; its states and inputs."""
    inputs = records[0].entrant.cold(ratio, start)[3]
    nodes = space_landing.flown(start, inputs, space_landing.thrusts(ratio))[-1]
    for record in records:
        record.entrant.adopt(ratio, start, inputs, nodes)
    return nodes, inputs


def warm(records, number_of, ratio, start):
    """Along one case's landing, from the planned state and after each kick."""
    thrust = space_landing.thrusts(ratio)
    nodes, _ = adopt(records, ratio, start)
    for samples in KICK_SAMPLES:
        for index, (push, turn) in enumerate(((0.0, 0.0), *KICKS)):
            state = nodes[samples].copy()
            state[3] += push
            state[8] += turn
            for record in records:
                answer = record.entrant.warm(samples, state)
                record.take(KICKED if index else CALM, (number_of, samples, index), state, thrust[samples:], answer)


def loop(records, number_of, ratio, start, pushes):
    """Closed loops side by side, pushed in the same way."""
    thrust = space_landing.thrusts(ratio)
    nodes, inputs = adopt(records, ratio, start)
    flights = [[record, nodes[0], inputs, 0] for record in records]
    for sample, push in enumerate(pushes, 1):
        for flight in flights:
            flight[1:] = advance(*flight, push, thrust[sample - 1 :], (number_of, sample))
    for record, state, inputs, since in flights:
        record.ends.append(space_landing.flown(state, inputs[since:], thrust[LOOP_SAMPLES:])[1])


def advance(record, state, inputs, since, push, thrust, number_of):
    """One sample: flies the plan's input, is pushed, plans again. A public solver that fails may try again more as in a cold solve.
    What has failed even so is flown if that is nearer to a landing than the old plan."""
    entrant, rest = record.entrant, thrust[1:]
    state = np.array(space_landing.STEP(state, inputs[since], thrust[0])).ravel() + push
    answer = entrant.warm(since + 1, state)
    if not answer[0] and not isinstance(entrant, Ours):
        first, answer = answer, entrant.warm(since + 1, state, retry=True)
        answer = answer[0], answer[1] + first[1], *answer[2:]
    found = np.clip(answer[3], *space_landing.INPUT_RANGE)
    old = inputs[since + 1 :]
    if record.take(LOOP, number_of, state, rest, answer) or miss(state, found, rest) < miss(state, old, rest):
        entrant.hold()
        return state, found, 0
    return state, inputs, since + 1


def miss(state, inputs, thrust):
    """By how much inputs break a condition."""
    if not np.all(np.isfinite(inputs)):
        return np.inf
    broken = space_landing.flown(state, inputs, thrust)[1]
    return broken if np.isfinite(broken) else np.inf


def show(problem, records):
    own, kinds = records[0].solves, (COLD, KICKED, CALM, LOOP)
    counts = ", ".join(f"{len(own[kind])} {kind}" for kind in kinds)
    end = "hard" if problem == HARD else f"at a price, {space_landing.PENALTY_PER_UNIT:.0f} a unit"
    print(f"\n**in space, the end {end}**: ms, and ratio to ours; {counts}\n")
    head(["", *(cell for kind in kinds for cell in (kind, "ratio")), "largest miss at the loops' ends", "cost off when flown again"])
    for record in records:
        cells = []
        for kind in kinds:
            solves = record.solves[kind]
            good = [p for p in solves if solves[p].solved and own[kind][p].solved]
            fails = sum(not solve.solved for solve in solves.values())
            best = {p: min((r.solves[kind][p].cost for r in records if r.solves[kind][p].solved), default=np.inf) for p in solves}
            # In the loop everybody is somewhere else.
            worse = sum(s.solved and dearer(s.cost, best[p]) for p, s in solves.items()) if kind != LOOP else 0
            counted = solves if kind == LOOP else good
            time = geometric(solves[p].ns for p in counted) / NS_PER_MS
            cells += [number(time) + shown(fails, worse), number(geometric(solves[p].ns / own[kind][p].ns for p in counted))]
        row([record.entrant.name, *cells, number(max(record.ends, default=np.nan)), f"{record.cost_off:.0e}"])
