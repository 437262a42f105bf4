"""Every solver's inputs flown again, apart from any solver: the cost, the miss, and what is left of optimality."""

import casadi as ca
import numpy as np

import landing

_POINT, _GIMBAL = ca.SX.sym("x", 6), ca.SX.sym("d")
_AFTER = landing.STEP(_POINT, _GIMBAL)
tangent = ca.Function(
    "tangent", [_POINT, _GIMBAL], [_AFTER, ca.jacobian(_AFTER, _POINT), ca.jacobian(_AFTER, _GIMBAL)]
)

# An input this close to its limit does not count for the multiplier of the end height, rad.
ON_LIMIT_RAD = 1e-3


def states(start, inputs):
    """States at the nodes."""
    nodes = [np.asarray(start, dtype=float)]
    for gimbal in inputs:
        nodes.append(np.array(landing.STEP(nodes[-1], gimbal)).ravel())
    return np.array(nodes)


def cost(nodes, inputs):
    """Running cost of a path."""
    misses = nodes[1:] - landing.TARGET
    rates = misses**2 @ landing.STATE_WEIGHTS + landing.INPUT_WEIGHT * np.asarray(inputs) ** 2
    return 0.5 * landing.STEP_S * rates.sum()


def optimality(start, inputs):
    """(cost, |z| and excess |x| at the end in m, largest component of the projected gradient by the inputs;
    the problem's own units).

    The gradient is that of the cost plus nu z_N as a function of the inputs alone; nu is the one that fits the
    inputs off their limits best. It comes from an adjoint sweep, with no solver's multipliers.
    """
    inputs = np.asarray(inputs)
    nodes, tangents = [np.asarray(start, dtype=float)], []
    for gimbal in inputs:
        after, by_state, by_input = (np.array(m) for m in tangent(nodes[-1], gimbal))
        nodes.append(after.ravel())
        tangents.append((by_state, by_input.ravel()))
    nodes = np.array(nodes)
    weights = landing.STEP_S * landing.STATE_WEIGHTS
    by_cost = weights * (nodes[-1] - landing.TARGET)
    by_height = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    gradient, height = np.zeros(len(inputs)), np.zeros(len(inputs))
    for k in range(len(inputs) - 1, -1, -1):
        by_state, by_input = tangents[k]
        gradient[k] = by_input @ by_cost + landing.STEP_S * landing.INPUT_WEIGHT * inputs[k]
        height[k] = by_input @ by_height
        by_cost = by_state.T @ by_cost + weights * (nodes[k] - landing.TARGET)
        by_height = by_state.T @ by_height
    free = np.abs(inputs) < landing.GIMBAL_LIMIT_RAD - ON_LIMIT_RAD
    scale = height[free] @ height[free]
    nu = -(height[free] @ gradient[free]) / scale if scale > 0.0 else 0.0
    total = gradient + nu * height
    # Where the input would go by the gradient, were it not for its limit: zero at an optimum.
    limit = landing.GIMBAL_LIMIT_RAD
    wrong = np.abs(inputs - np.clip(inputs - total, -limit, limit))
    miss = max(abs(nodes[-1, 1]), abs(nodes[-1, 0]) - landing.X_FINAL_M)
    return cost(nodes, inputs), miss, wrong.max()
