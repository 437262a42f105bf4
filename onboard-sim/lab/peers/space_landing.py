"""A landing in space as a CasADi NLP: gimbal in two directions, fins, a box at the end, a given final time.

The equations are those of `onboard-sim/ocp`, the numbers those of `onboard-sim/lab/paper/examples/peer/space.rs`. Variables
are ordered by stage, (u_k, x_{k+1}); parameters are the start and the thrust over mass of each interval. All conditions
are bounds of states, and hard.
"""

import os

import casadi as ca
import numpy as np

INTERVALS, STEP_S = 38, 0.1
STATES, INPUTS = 10, 3
WIDTH = INPUTS + STATES
GRAVITY_M_S2, TURNING_PER_THRUST, MASS_KG = 9.80665, 6.0, 1.2
FINS, AXIAL, CROSSFLOW = 0.05, 0.003, 0.04
WIND_M_S = (2.0, 0.5)
SMOOTH = 1e-4
STATE_WEIGHTS = STEP_S * np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1000.0, 1000.0, 0.0, 0.0])
INPUT_WEIGHTS = STEP_S * np.array([20_000.0, 20_000.0, 20.0])
HALF_OPEN = np.array([0.0, 0.0, 0.5])
GIMBAL_RAD, LEAN_RAD = np.radians(4.5), np.radians(50.0)
END_LATERAL_M_S, END_LEAN_RAD, END_RATE_RAD_S = 0.06, np.radians(1.0), np.radians(1.0)
END_VERTICAL_M_S = (-0.3, -0.05)
SETTLED_NODES = 3
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
    share = np.arange(INTERVALS) / INTERVALS
    return GRAVITY_M_S2 * (thrust_over_weight - (thrust_over_weight - 1.0) * share * share)


def nlp(intervals):
    start, thrust, path = ca.MX.sym("start", STATES), ca.MX.sym("thrust", intervals), ca.MX.sym("path", WIDTH, intervals)
    inputs, after = path[:INPUTS, :], path[INPUTS:, :]
    gaps = after - STEP.map(intervals)(ca.horzcat(start, after[:, :-1]), inputs, thrust.T)
    off = inputs - ca.repmat(ca.DM(HALF_OPEN), 1, intervals)
    weighted = ca.dot(after, ca.mtimes(ca.diag(ca.DM(STATE_WEIGHTS)), after))
    cost = 0.5 * (weighted + ca.dot(off, ca.mtimes(ca.diag(ca.DM(INPUT_WEIGHTS)), off)))
    return {"x": ca.vec(path), "p": ca.vertcat(start, thrust), "f": cost, "g": ca.vec(gaps)}


def bounds(intervals):
    """Lower and upper bounds of the variables."""
    upper = np.full((intervals, WIDTH), np.inf)
    lower = -upper
    lower[:, :INPUTS], upper[:, :INPUTS] = (-GIMBAL_RAD, -GIMBAL_RAD, 0.0), (GIMBAL_RAD, GIMBAL_RAD, 1.0)
    low, high = lower[:, INPUTS:], upper[:, INPUTS:]
    low[:, 6:8], high[:, 6:8] = -LEAN_RAD, LEAN_RAD
    low[:, 2] = FLOOR_RISE_M_S * STEP_S * np.arange(intervals - 1, -1, -1)
    settled = slice(intervals - SETTLED_NODES, None)
    for part, most in ((slice(3, 5), END_LATERAL_M_S), (slice(6, 8), END_LEAN_RAD), (slice(8, 10), END_RATE_RAD_S)):
        low[settled, part], high[settled, part] = -most, most
    low[-1, 5], high[-1, 5] = END_VERTICAL_M_S
    low[-1, 2] = high[-1, 2] = 0.0
    return lower.ravel(), upper.ravel()


def guess(start, turns):
    """Straight lines to rest at the target, and a lean that turns around; as variables."""
    share = np.arange(INTERVALS + 1) / INTERVALS
    states = start + np.outer(share, np.array([0.0] * STATES) - start)
    size = GUESS_LEAN_RAD * 4.0 * share * (1.0 - share) * abs(turns)
    towards = GUESS_TOWARDS_RAD + 2.0 * np.pi * turns * share
    states[:, 6] += size * np.cos(towards)
    states[:, 7] += size * np.sin(towards)
    return np.hstack([np.tile(HALF_OPEN, (INTERVALS, 1)), states[1:]]).ravel()


def flown(start, inputs, thrust):
    """(cost, worst broken condition in its own unit, states) of inputs."""
    nodes = [np.asarray(start, dtype=float)]
    for k, push in enumerate(thrust):
        nodes.append(np.array(STEP(nodes[-1], inputs[k], push)).ravel())
    nodes = np.array(nodes)
    off = inputs - HALF_OPEN
    cost = 0.5 * ((nodes[1:] ** 2 @ STATE_WEIGHTS).sum() + (off**2 @ INPUT_WEIGHTS).sum())
    lower, upper = (bound.reshape(-1, WIDTH) for bound in bounds(len(inputs)))
    path = np.hstack([inputs, nodes[1:]])
    return float(cost), float(np.maximum(lower - path, path - upper).max()), nodes


def structure(solver, intervals):
    if solver != "fatrop":
        return {}
    return {
        "structure_detection": "manual",
        "N": intervals,
        "nx": [0] + [STATES] * intervals,
        "nu": [INPUTS] * intervals + [0],
        "ng": [0] * (intervals + 1),
        "equality": [True] * (STATES * intervals),
    }


def library_path(solver, intervals, folder):
    return os.path.join(folder, f"space_{solver}_{intervals}.so")
