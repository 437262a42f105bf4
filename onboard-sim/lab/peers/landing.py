"""The landing paper's problem as a CasADi NLP, compiled to C.

Variables are ordered by stage: (u_0, x_1, u_1, x_2, ..., u_{N-1}, x_N), and for the soft problem two slacks; the start
state is a parameter. SI and radians; states are (x, z, theta, u, w, q) as in the controller.

The end height is either a hard condition, z_N = 0, or soft: a miss costs 1000 a metre.
"""

import math
import os

import casadi as ca
import numpy as np

MASS_KG, INERTIA_KG_M2, ARM_M, GRAVITY_M_S2, THRUST_N = 3.0, 0.12, 0.52, 9.81, 33.3
DRAG_PER_M = 1.225 * 0.0043 * 1.0 / (2.0 * MASS_KG)
STEP_S, HORIZON = 0.1, 50
STATES, INPUTS = 6, 1
STATE_WEIGHTS = np.array([0.5, 60.0, 150.0, 50.0, 70.0, 90.0])
INPUT_WEIGHT = 1.0
INPUT_WEIGHTS, REST = np.array([INPUT_WEIGHT]), np.zeros(1)
TARGET = np.array([0.0, 0.0, math.pi / 2.0, 0.0, 0.0, 0.0])
GIMBAL_LIMIT_RAD = math.radians(20.0)
X_FINAL_M = 20.0
TOLERANCE = 1e-6

HARD, SOFT = "hard", "soft"
# Of a metre of missed end height, cost units.
PENALTY_PER_M = 1000.0


def after(state, gimbal, step_s, thrust_n):
    """State after one RK4 step of the planar equations."""

    def slope(point):
        theta, u, w, q = point[2], point[3], point[4], point[5]
        speed = ca.sqrt(u * u + w * w + 1e-300)
        push, side = thrust_n / MASS_KG * ca.cos(gimbal), -thrust_n / MASS_KG * ca.sin(gimbal)
        return ca.vertcat(
            u * ca.cos(theta) + w * ca.sin(theta),
            u * ca.sin(theta) - w * ca.cos(theta),
            q,
            push - DRAG_PER_M * speed * u - GRAVITY_M_S2 * ca.sin(theta) - q * w,
            side + GRAVITY_M_S2 * ca.cos(theta) + q * u,
            -thrust_n * ca.sin(gimbal) * ARM_M / INERTIA_KG_M2,
        )

    k1 = slope(state)
    k2 = slope(state + step_s / 2 * k1)
    k3 = slope(state + step_s / 2 * k2)
    k4 = slope(state + step_s * k3)
    return state + step_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def step_function():
    """(state, gimbal) -> state after an interval."""
    state, gimbal = ca.SX.sym("state", 6), ca.SX.sym("gimbal")
    return ca.Function("step", [state, gimbal], [after(state, gimbal, STEP_S, THRUST_N)])


STEP = step_function()


def slacks(problem):
    """Number of variables after the path: the miss of the end height, above and below."""
    return 2 if problem == SOFT else 0


def nlp(intervals, problem):
    """The problem over `intervals` samples; one column of the path a stage: (u_k, x_{k+1})."""
    start, path, miss = ca.MX.sym("start", 6), ca.MX.sym("path", 7, intervals), ca.MX.sym("miss", slacks(problem))
    gimbals, after = path[0, :], path[1:, :]
    gaps = after - STEP.map(intervals)(ca.horzcat(start, after[:, :-1]), gimbals)
    misses = after - ca.repmat(ca.DM(TARGET), 1, intervals)
    weighted = ca.mtimes(ca.diag(ca.DM(STATE_WEIGHTS)), misses)
    cost = STEP_S * 0.5 * (ca.dot(misses, weighted) + INPUT_WEIGHT * ca.dot(gimbals, gimbals))
    equations = [ca.vec(gaps)]
    if problem == SOFT:
        cost += PENALTY_PER_M * ca.sum1(miss)
        equations.append(after[1, -1] - miss[0] + miss[1])
    return {"x": ca.vertcat(ca.vec(path), miss), "p": start, "f": cost, "g": ca.vertcat(*equations)}


def bounds(intervals, problem):
    """Lower and upper bounds of the variables."""
    lower = np.full((intervals, 7), -np.inf)
    lower[:, 0] = -GIMBAL_LIMIT_RAD
    lower[-1, 1] = -X_FINAL_M
    upper = -lower
    if problem == HARD:
        lower[-1, 2] = upper[-1, 2] = 0.0
    more = slacks(problem)
    return np.append(lower.ravel(), np.zeros(more)), np.append(upper.ravel(), np.full(more, np.inf))


def structure(solver, intervals, problem):
    """What a solver is told of the problem's structure."""
    if solver != "fatrop":
        return {}
    more = slacks(problem)
    ends = 1 if more else 0
    return {
        "structure_detection": "manual",
        "N": intervals,
        "nx": [0] + [6] * intervals,
        "nu": [1] * intervals + [more],
        "ng": [0] * intervals + [ends],
        "equality": [True] * (6 * intervals + ends),
    }


def library_path(solver, intervals, problem, folder):
    """Where the functions of a problem are, or will be."""
    return os.path.join(folder, f"{solver}_{problem}_{intervals}.so")
