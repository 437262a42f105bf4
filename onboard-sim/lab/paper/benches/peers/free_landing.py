"""The landing with a free final time, cold and kicked: ours, which searches around its solver, and fatrop and IPOPT.

Thrust falls with the square of time to the weight and on; the landing may end from then to 1.5 s later, as in
`onboard-sim/flight/examples/peer/free.rs`. For the public ones the final time is a state that stays as it is. Their variables are
ordered by stage, (end_k, u_k, x_{k+1}), and the last end; z_N = 0 is hard. They begin in the middle of the allowed times.
"""

import os

import casadi as ca
import numpy as np

import compiled
import landing
from interior import COLD, WARM, Nlp, options
from measure import KICK, KICK_SIGNS, SMALL, STARTS
from result import BENDS_RAD, guess
from rollout import COST_SHARE, LANDED_M
from tables import DEARER, NS_PER_MS, geometric, head, number, row

# Thrust over weight at ignition, and the time at which it is the weight, s.
MOTORS = ((1.5, 4.0), (1.3, 5.0))
SPAN_S = 1.5
ROUNDS = 1 if SMALL else 5

COUNT, WEIGHT_N = landing.HORIZON, landing.MASS_KG * landing.GRAVITY_M_S2
STRUCTURE = {
    "structure_detection": "manual",
    "N": COUNT,
    "nx": [1] + [7] * COUNT,
    "nu": [1] * COUNT + [0],
    "ng": [0] * (COUNT + 1),
    "equality": [True] * (7 * COUNT),
}


def steps(points, gimbals, motor, over):
    """All steps one by one or, with `mapaccum`, one after the other: (state, final time) -> (state, final time)."""
    point, gimbal, k, falls = ca.SX.sym("point", 7), ca.SX.sym("gimbal"), ca.SX.sym("k"), ca.SX.sym("motor", 2)
    step_s = point[6] / COUNT
    lost = (falls[0] - 1.0) * (step_s / falls[1]) ** 2 * (k * k + k + 1.0 / 3.0)
    there = landing.after(point[:6], gimbal, step_s, WEIGHT_N * (falls[0] - lost))
    step = ca.Function("step", [point, gimbal, k, falls], [ca.vertcat(there, point[6])])
    return getattr(step, over)(COUNT)(points, gimbals, ca.DM(range(COUNT)).T, ca.repmat(motor, 1, COUNT))


def cost(points, gimbals, ends_s):
    """Running cost of the path."""
    misses = points - ca.repmat(ca.DM(landing.TARGET), 1, COUNT)
    rates = ca.sum1(misses**2 * ca.DM(landing.STATE_WEIGHTS)) + landing.INPUT_WEIGHT * gimbals**2
    return 0.5 / COUNT * ca.dot(ends_s, rates)


def nlp():
    given, path, last = ca.MX.sym("given", 8), ca.MX.sym("path", 8, COUNT), ca.MX.sym("last")
    ends, gimbals, after = path[0, :], path[1, :], path[2:, :]
    there = steps(ca.vertcat(ca.horzcat(given[:6], after[:, :-1]), ends), gimbals, given[6:], "map")
    gaps = ca.vertcat(after, ca.horzcat(ends[1:], last)) - there
    return {"x": ca.vertcat(ca.vec(path), last), "p": given, "f": cost(after, gimbals, ends), "g": ca.vec(gaps)}


def bounds(until_s):
    both = zip(landing.bounds(COUNT, landing.HARD), (until_s, until_s + SPAN_S))
    return [np.append(np.insert(bound.reshape(COUNT, 7), 0, end_s, axis=1), end_s) for bound, end_s in both]


class Free:
    """fatrop or IPOPT."""

    problem, makes, loops = "free", (), False

    def __init__(self, solver, folder):
        self.name, structure = solver, STRUCTURE if solver == "fatrop" else {}
        library = os.path.join(folder, f"free_{solver}.so")
        compiled.functions(solver, nlp(), structure, library, compiled.FULLY)
        self.nlps = {how: Nlp(solver, library, options(solver, how) | structure, bounds(MOTORS[0][1])) for how in (COLD, WARM)}

    def solve(self, how, motor, start, *given):
        """The answer as `run` has it, and the plan."""
        solver = self.nlps[how]
        solver.inputs["lbx"][:], solver.inputs["ubx"][:] = bounds(motor[1])
        good, ns, _, plan = solver.solve(np.append(start, motor), *given)
        return (good, ns, float(solver.outputs["f"][0]), plan[0][-1], plan[0][1:-1:8]), plan

    def free(self, warm, motor, start):
        if warm:
            return self.solve(WARM, motor, start, *self.plan)[0]
        middle_s, found = motor[1] + 0.5 * SPAN_S, []
        for bend_rad in BENDS_RAD:
            states, inputs = guess(start, bend_rad)
            path = np.column_stack([np.full(COUNT, middle_s), inputs, states[1:]]).ravel()
            found.append(self.solve(COLD, motor, start, np.append(path, middle_s)))
        best, self.plan = min(found, key=lambda one: (not one[0][0], one[0][2]))
        return best[0], sum(answer[1] for answer, _ in found), *best[2:]


def entrants(solver, folder):
    """Called by `worker`."""
    return solver, [Free(solver, folder)]


def flown(motor, start, answer):
    """Cost of an answer's inputs; infinite if it has not converged, misses z_N = 0 or claims another cost."""
    good, _, claimed, end_s, inputs = answer
    if not good:
        return np.inf
    gimbals = np.reshape(inputs, (1, -1))
    points = steps(np.append(start, end_s), gimbals, ca.DM(motor), "mapaccum")
    found = float(cost(points[:6, :], gimbals, points[6, :]))
    return found if abs(points[1, -1]) <= LANDED_M and abs(found - claimed) <= COST_SHARE * found else np.inf


def run(everyone):
    """The table; ours first. An entrant's answer is (converged, ns, claimed cost, final time, inputs)."""
    found = {False: [], True: []}
    for motor in MOTORS:
        for start in STARTS:
            kicks = [start + KICK * np.array([0, 0, 0, *signs]) for signs in KICK_SIGNS]
            for warm, state in [(False, start), *((True, kicked) for kicked in kicks)]:
                rounds = [[entrant.free(warm, motor, state) for entrant in everyone] for _ in range(ROUNDS)]
                found[warm].append([(min(a[1] for a in each), flown(motor, state, each[0])) for each in zip(*rounds)])
    for warm, title in ((False, "cold"), (True, "kicked")):
        ns, costs = np.moveaxis(np.array(found[warm]), 2, 0)
        best = costs.min(axis=1)
        print(f"\n**free final time, {title}**: {len(ns)} problems; ratio where both find the same landing\n")
        head(["", "ms", "ratio", "fail", "dearer than the best", "by at most"])
        for index, entrant in enumerate(everyone):
            lands = np.isfinite(costs[:, index])
            same = lands & np.isclose(costs[:, index], costs[:, 0], rtol=DEARER)
            worse = costs[lands, index] / best[lands] - 1.0
            cells = geometric(ns[lands, index]) / NS_PER_MS, geometric(ns[same, index] / ns[same, 0])
            row([entrant.name, *map(number, cells), str(sum(~lands)), str(sum(worse > DEARER)), f"{worse.max():.1%}"])
