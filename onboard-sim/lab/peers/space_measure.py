"""The landing in space, cold and kicked: ours, fatrop and IPOPT, taking turns."""

import numpy as np

import space_landing
from measure import SMALL
from tables import NS_PER_MS, dearer, geometric, head, number, row

RATIOS = (1.6, 1.8)
START = np.array([0.3, 0.0, 17.6, -0.4, -0.5, -12.5, -0.05, 0.03, 0.0, 0.0])
# Added to the start, one case each: nothing, drift, another drift, a lean.
CASES = ({}, {3: 0.8, 4: 0.5}, {3: -0.6, 4: 1.0}, {6: 0.1, 9: 0.2})
KICK_SAMPLES = (1, 11, 21)
# Sideways, m/s, and of the lean's rate, rad/s.
KICKS = ((0.1, -0.05), (-0.1, 0.05), (0.1, 0.05), (-0.1, -0.05))
HORIZONS = [space_landing.INTERVALS, *(space_landing.INTERVALS - samples for samples in KICK_SAMPLES)]
ROUNDS = 1 if SMALL else 5

# An answer that breaks a condition by more is no landing, m, m/s, rad or rad/s.
LANDED = 1e-3


def cases():
    for ratio in RATIOS:
        for case in CASES:
            start = START.copy()
            for index, change in case.items():
                start[index] += change
            yield ratio, start


class Tally:
    """One entrant's solves of one kind: (ns, converged, flown cost, lands) by problem, the fastest of its repeats."""

    def __init__(self):
        self.solves = {}
        self.cost_off = 0.0

    def take(self, problem, start, thrust, solved):
        converged, ns, claimed, inputs = solved
        cost, broken, _ = space_landing.flown(start, inputs, thrust) if converged else (np.inf, np.inf, None)
        if converged:
            self.cost_off = max(self.cost_off, abs(cost - claimed))
        before = self.solves.get(problem)
        self.solves[problem] = (min(ns, before[0]) if before else ns, converged, cost, broken <= LANDED)


def run(ours, public):
    """Both tables. `public`: fatrop and IPOPT in space."""
    everyone = [ours, *public]
    cold, kicked = ([Tally() for _ in everyone] for _ in range(2))
    for repeat in range(ROUNDS):
        for number_of, (ratio, start) in enumerate(cases()):
            thrust = space_landing.thrusts(ratio)
            for entrant, tally in zip(everyone, cold):
                tally.take(number_of, start, thrust, entrant.space_cold(ratio, start))
            if repeat == 0:
                kick(everyone, kicked, number_of, ratio, start)
    for title, tallies in (("cold, both guesses each", cold), ("kicked", kicked)):
        show(title, everyone, tallies)


def kick(everyone, tallies, number_of, ratio, start):
    """All kicks along one case's landing, which is every solver's plan."""
    thrust = space_landing.thrusts(ratio)
    _, _, _, inputs = everyone[0].space_cold(ratio, start)
    _, _, nodes = space_landing.flown(start, inputs, thrust)
    for entrant in everyone:
        entrant.space_adopt(ratio, start, inputs, nodes)
    for samples in KICK_SAMPLES:
        for index, (push, turn) in enumerate(KICKS):
            state = nodes[samples].copy()
            state[3] += push
            state[8] += turn
            for entrant, tally in zip(everyone, tallies):
                tally.take((number_of, samples, index), state, thrust[samples:], entrant.space_warm(samples, state))


def show(title, everyone, tallies):
    own = tallies[0].solves
    best = {p: min((t.solves[p][2] for t in tallies if t.solves[p][3]), default=np.inf) for p in own}
    landable = [problem for problem in own if np.isfinite(best[problem])]
    print(f"\n**in space, {title}**: {len(landable)} of {len(own)} problems are solved by somebody\n")
    head(["", "ms", "ratio", "fail", "dearer than the best", "cost off when flown again"])
    for entrant, tally in zip(everyone, tallies):
        solves = tally.solves
        good = [p for p in landable if solves[p][3] and own[p][3]]
        fails = sum(not solves[p][3] for p in landable)
        worse = sum(solves[p][3] and dearer(solves[p][2], best[p]) for p in landable)
        time, ratio = geometric(solves[p][0] for p in good) / NS_PER_MS, geometric(solves[p][0] / own[p][0] for p in good)
        row([entrant.name, number(time), number(ratio), str(fails), str(worse), f"{tally.cost_off:.0e}"])
