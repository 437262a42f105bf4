"""The landing paper's problem in the plane, for the quadratic problem of one step and for the limit of one sweep.

SI and radians; states are (x, z, theta, u, w, q) as in the controller.
"""

import math

import casadi as ca
import numpy as np

MASS_KG, INERTIA_KG_M2, ARM_M, GRAVITY_M_S2, THRUST_N = 3.0, 0.12, 0.52, 9.81, 33.3
DRAG_PER_M = 1.225 * 0.0043 * 1.0 / (2.0 * MASS_KG)
STEP_S, HORIZON = 0.1, 50
STATE_WEIGHTS = np.array([0.5, 60.0, 150.0, 50.0, 70.0, 90.0])
INPUT_WEIGHT = 1.0
TARGET = np.array([0.0, 0.0, math.pi / 2.0, 0.0, 0.0, 0.0])
GIMBAL_LIMIT_RAD = math.radians(20.0)
X_FINAL_M = 20.0
TOLERANCE = 1e-6


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


def bounds(intervals):
    """Lower and upper bounds of the variables (u_k, x_{k+1}); z_N = 0 is hard."""
    lower = np.full((intervals, 7), -np.inf)
    lower[:, 0] = -GIMBAL_LIMIT_RAD
    lower[-1, 1] = -X_FINAL_M
    upper = -lower
    lower[-1, 2] = upper[-1, 2] = 0.0
    return lower.ravel(), upper.ravel()


def states(start, inputs):
    """States at the nodes, one row each."""
    after = np.array(STEP.mapaccum(len(inputs))(start, np.reshape(inputs, (1, -1))))
    return np.vstack([start, after.T])
