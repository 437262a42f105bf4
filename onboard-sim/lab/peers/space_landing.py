"""A landing in space as a CasADi NLP: gimbal in two directions, fins, a box at the end, a given final time.

The equations are those of `onboard-sim/ocp`, the numbers those of `onboard-sim/lab/paper/examples/peer/space.rs`. Variables
are ordered by stage, (u_k, x_{k+1}); parameters are the start and the thrust over mass of each interval. All conditions
are bounds of states. Those of the last three nodes are hard, or have a price.
"""

import functools
import os

import casadi as ca
import numpy as np

HARD, SOFT = "hard", "soft"
# Of a metre, a metre a second, a radian or a radian a second by which the end is missed, cost units.
PENALTY_PER_UNIT = 1000.0

HORIZON, STEP_S = 38, 0.1
STATES, INPUTS = 10, 3
WIDTH = INPUTS + STATES
GRAVITY_M_S2, TURNING_PER_THRUST, MASS_KG = 9.80665, 6.0, 1.2
FINS, AXIAL, CROSSFLOW = 0.05, 0.003, 0.04
WIND_M_S = (2.0, 0.5)
SMOOTH = 1e-4
STATE_WEIGHTS = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1000.0, 1000.0, 0.0, 0.0])
INPUT_WEIGHTS = np.array([20_000.0, 20_000.0, 20.0])
# The target, and inputs that cost nothing: fins half open.
TARGET, REST = np.zeros(STATES), np.array([0.0, 0.0, 0.5])
GIMBAL_RAD, LEAN_RAD = np.radians(4.5), np.radians(50.0)
END_LATERAL_M_S, END_LEAN_RAD, END_RATE_RAD_S = 0.06, np.radians(1.0), np.radians(1.0)
END_VERTICAL_M_S = (-0.3, -0.05)
SETTLED_NODES = 3
INPUT_RANGE = np.array([[-GIMBAL_RAD, -GIMBAL_RAD, 0.0], [GIMBAL_RAD, GIMBAL_RAD, 1.0]])
FLOOR_RISE_M_S = 0.2
GUESS_LEAN_RAD, GUESS_TOWARDS_RAD = 0.5, 0.6
TURNS = (1.0, -1.0)


def step_function():
    """One interval, (state, input, thrust over mass) -> state."""
    x, u, thrust = ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("thrust")
    h, turning = STEP_S, TURNING_PER_THRUST * thrust
    p = x[6] + 0.5 * h * x[8] + h * h / 6.0 * turning * u[0]
    r = x[7] + 0.5 * h * x[9] + h * h / 6.0 * turning * u[1]
    p_rate, r_rate = x[8] + 0.5 * h * turning * u[0], x[9] + 0.5 * h * turning * u[1]
    n = ca.vertcat(ca.sin(p), ca.cos(p) * ca.sin(r), ca.cos(p) * ca.cos(r))
    e_p = ca.vertcat(ca.cos(p), -ca.sin(p) * ca.sin(r), -ca.sin(p) * ca.cos(r))
    e_r = ca.vertcat(0.0, ca.cos(r), -ca.sin(r))
    v = ca.vertcat(x[3] - WIND_M_S[0], x[4] - WIND_M_S[1], x[5] + 0.5 * h * (thrust - GRAVITY_M_S2))
    speed, along = ca.sqrt(ca.dot(v, v) + SMOOTH), ca.dot(v, n)
    across = v - along * n
    across_speed = ca.sqrt(ca.dot(across, across) + SMOOTH)
    force = -FINS * u[2] * speed * v - AXIAL * speed * along * n - CROSSFLOW * across_speed * across
    a = thrust * (n - u[0] * e_p - u[1] * e_r) + force / MASS_KG - ca.vertcat(0.0, 0.0, GRAVITY_M_S2)
    a_lean = ca.vertcat(
        turning * u[0] - r_rate * r_rate * ca.sin(p) * ca.cos(p),
        (turning * u[1] + 2.0 * p_rate * r_rate * ca.sin(p)) / ca.cos(p),
    )
    half = 0.5 * h * h
    after = ca.vertcat(x[:3] + h * x[3:6] + half * a, x[3:6] + h * a, x[6:8] + h * x[8:] + half * a_lean, x[8:] + h * a_lean)
    return ca.Function("step", [x, u, thrust], [after])


STEP = step_function()


def thrusts(thrust_over_weight):
    """Thrust over mass of each interval, m/s^2: it falls with the square of time to the weight."""
    share = np.arange(HORIZON) / HORIZON
    return GRAVITY_M_S2 * (thrust_over_weight - (thrust_over_weight - 1.0) * share * share)


@functools.cache
def sides(node, intervals, problem):
    """The sides of a node's conditions that have a price: (component of the state, 1 below or -1 above)."""
    if problem == HARD or node <= intervals - SETTLED_NODES:
        return []
    lower, upper = (bound.reshape(-1, WIDTH)[node - 1, INPUTS:] for bound in bounds(intervals))
    return [(index, sign) for index in range(STATES) for bound, sign in ((lower, 1), (upper, -1)) if np.isfinite(bound[index])]


@functools.cache
def places(intervals, problem):
    """Where inputs, states and misses are among the variables, one row a stage: (u_k, misses of node k, x_{k+1}), and last the
    misses of node N."""
    at, inputs, states, misses = 0, [], [], []
    for node in range(intervals + 1):
        missed = len(sides(node, intervals, problem))
        inputs.append(np.arange(at, at + INPUTS))
        at += INPUTS if node < intervals else 0
        misses.append(np.arange(at, at + missed))
        at += missed
        states.append(np.arange(at, at + STATES))
        at += STATES
    return np.array(inputs[:-1]), np.array(states[:-1]), misses


@functools.cache
def conditions(intervals, problem):
    """The conditions with a price, by node: (component, lower and upper bound, which sides)."""
    lower, upper = (bound.reshape(-1, WIDTH)[:, INPUTS:] for bound in bounds(intervals))
    found = []
    for node in range(intervals + 1):
        components = sorted({index for index, _ in sides(node, intervals, problem)})
        found.append([(index, lower[node - 1, index], upper[node - 1, index]) for index in components])
    return found


def nlp(intervals, problem):
    at_inputs, at_states, at_misses = places(intervals, problem)
    start, thrust = ca.MX.sym("start", STATES), ca.MX.sym("thrust", intervals)
    path = ca.MX.sym("path", at_inputs.size + at_states.size + sum(map(len, at_misses)))
    inputs, after = (ca.reshape(path[at.ravel().tolist()], -1, intervals) for at in (at_inputs, at_states))
    gaps = after - STEP.map(intervals)(ca.horzcat(start, after[:, :-1]), inputs, thrust.T)
    off = inputs - ca.repmat(ca.DM(REST), 1, intervals)
    weighted = ca.dot(after, ca.mtimes(ca.diag(ca.DM(STATE_WEIGHTS)), after))
    cost = 0.5 * STEP_S * (weighted + ca.dot(off, ca.mtimes(ca.diag(ca.DM(INPUT_WEIGHTS)), off)))
    # fatrop has the dynamics of a stage before its conditions.
    priced = [node for node, at in enumerate(at_misses) if len(at)]
    equations = [ca.vec(gaps[:, : min([*priced, intervals])])]
    for node in priced:
        missed, rows = path[at_misses[node].tolist()], conditions(intervals, problem)[node]
        signs = [[sign * (of == index) for of, sign in sides(node, intervals, problem)] for index, _, _ in rows]
        held = after[[index for index, _, _ in rows], node - 1] + ca.mtimes(ca.sparsify(ca.DM(signs)), missed)
        equations += [gaps[:, node], held] if node < intervals else [held]
        cost += PENALTY_PER_UNIT * ca.sum1(missed)
    return {"x": path, "p": ca.vertcat(start, thrust), "f": cost, "g": ca.vertcat(*equations)}


def variables(path, problem):
    """A path (u_k, x_{k+1}) as the variables, with no miss."""
    intervals = len(path)
    at_inputs, at_states, at_misses = places(intervals, problem)
    made = np.zeros(at_inputs.size + at_states.size + sum(map(len, at_misses)))
    made[at_inputs], made[at_states] = np.split(path, [INPUTS], axis=1)
    return made


def limits(intervals, problem):
    """Lower and upper bounds of variables and of equations."""
    made = []
    for sign, bound in zip((1, -1), bounds(intervals, problem)):
        of_variables = variables(bound.reshape(-1, WIDTH), problem)
        for at in places(intervals, problem)[2]:
            of_variables[at] = 0.0 if sign > 0 else np.inf
        made.append(of_variables)
    for side in (1, 2):
        of_equations = []
        for node, rows in enumerate(conditions(intervals, problem)):
            of_equations += [0.0] * (STATES if node < intervals else 0) + [row[side] for row in rows]
        made.append(np.array(of_equations))
    return made


def bounds(intervals, problem=HARD):
    """Lower and upper bounds of the variables; those of the end are left out where they have a price."""
    upper = np.full((intervals, WIDTH), np.inf)
    lower = -upper
    lower[:, :INPUTS], upper[:, :INPUTS] = INPUT_RANGE
    low, high = lower[:, INPUTS:], upper[:, INPUTS:]
    low[:, 6:8], high[:, 6:8] = -LEAN_RAD, LEAN_RAD
    low[:, 2] = FLOOR_RISE_M_S * STEP_S * np.arange(intervals - 1, -1, -1)
    settled = slice(intervals - SETTLED_NODES, None)
    for part, most in ((slice(3, 5), END_LATERAL_M_S), (slice(6, 8), END_LEAN_RAD), (slice(8, 10), END_RATE_RAD_S)):
        low[settled, part], high[settled, part] = -most, most
    low[-1, 5], high[-1, 5] = END_VERTICAL_M_S
    low[-1, 2] = high[-1, 2] = 0.0
    if problem == SOFT:
        low[settled], high[settled] = -np.inf, np.inf
    return lower.ravel(), upper.ravel()


def guess(start, turns):
    """Straight lines to rest at the target, and a lean that turns around; (u_k, x_{k+1}) a row."""
    share = np.arange(HORIZON + 1) / HORIZON
    states = start + np.outer(share, np.array([0.0] * STATES) - start)
    size = GUESS_LEAN_RAD * 4.0 * share * (1.0 - share) * abs(turns)
    towards = GUESS_TOWARDS_RAD + 2.0 * np.pi * turns * share
    states[:, 6] += size * np.cos(towards)
    states[:, 7] += size * np.sin(towards)
    return np.hstack([np.tile(REST, (HORIZON, 1)), states[1:]])


def cost(nodes, inputs):
    """Of a path, without prices."""
    off = inputs - REST
    return float(0.5 * STEP_S * (((nodes[1:] - TARGET) ** 2 @ STATE_WEIGHTS).sum() + (off**2 @ INPUT_WEIGHTS).sum()))


def flown(start, inputs, thrust, problem=HARD):
    """(cost without prices, worst broken condition in its own unit, sum of the misses that have a price, states) of inputs."""
    nodes = [np.asarray(start, dtype=float)]
    for k, push in enumerate(thrust):
        nodes.append(np.array(STEP(nodes[-1], inputs[k], push)).ravel())
    nodes = np.array(nodes)
    path = np.hstack([inputs, nodes[1:]]).ravel()
    every, kept = (np.maximum(low - path, path - high) for low, high in (bounds(len(inputs), of) for of in (HARD, problem)))
    return cost(nodes, inputs), float(kept.max()), float(np.maximum(every[np.isneginf(kept)], 0.0).sum()), nodes


def structure(solver, intervals, problem):
    if solver != "fatrop":
        return {}
    rows = conditions(intervals, problem)
    missed = [len(sides(node, intervals, problem)) for node in range(intervals + 1)]
    return {
        "structure_detection": "manual",
        "N": intervals,
        "nx": [0] + [STATES] * intervals,
        "nu": [INPUTS + more for more in missed[:-1]] + missed[-1:],
        "ng": [len(row) for row in rows],
        "equality": [same for node, row in enumerate(rows) for same in [True] * (STATES if node < intervals else 0) + [low == high for _, low, high in row]],
    }


def library_path(solver, intervals, problem, folder):
    return os.path.join(folder, f"space_{solver}_{problem}_{intervals}.so")
