"""Every solver's inputs flown again, apart from any solver: the cost, the miss, and what is left of optimality."""

import dataclasses
import functools

import casadi as ca
import numpy as np

import landing
import result

_POINT, _GIMBAL = ca.SX.sym("x", 6), ca.SX.sym("d")
_AFTER = landing.STEP(_POINT, _GIMBAL)
tangent = ca.Function(
    "tangent", [_POINT, _GIMBAL], [_AFTER, ca.jacobian(_AFTER, _POINT), ca.jacobian(_AFTER, _GIMBAL)]
)

# An input this close to its limit does not count for the multiplier of the end height, rad.
ON_LIMIT_RAD = 1e-3

# A path that ends within this of z = 0 has landed, m.
LANDED_M = 1e-3

# What an answer may claim and fly apart: share of the cost.
COST_SHARE = 1e-4


@functools.lru_cache(maxsize=None)
def _flight(intervals):
    return landing.STEP.mapaccum("flight", intervals)


@functools.lru_cache(maxsize=None)
def _tangents(intervals):
    return tangent.map(intervals)


def states(start, inputs):
    """States at the nodes, one row each."""
    start = np.asarray(start, dtype=float)
    after = np.array(_flight(len(inputs))(start, np.asarray(inputs).reshape(1, -1)))
    return np.vstack([start, after.T])


@dataclasses.dataclass
class Flown:
    """What the inputs do: running cost, cost with the penalty of the missed end height, height at the end in m, and the
    largest component of the projected gradient by the inputs, in the problem's own units."""

    cost: float
    merit: float
    z_m: float
    gradient: float

    @property
    def lands(self):
        return abs(self.z_m) <= LANDED_M

    def worth(self, problem):
        """What the problem minimises."""
        return self.merit if problem == landing.SOFT else self.cost

    def confirms(self, solved, problem):
        """Whether a converged answer does what it claims."""
        as_claimed = abs(self.cost - solved.cost) <= COST_SHARE * max(1.0, abs(self.cost))
        return as_claimed and (problem == landing.SOFT or self.lands)


def flown(start, inputs, problem):
    """Flies inputs.

    The gradient is that of the cost plus nu z_N as a function of the inputs alone; nu is the penalty where the soft
    problem's end is missed, and else the one that fits the inputs off their limits best. It comes from an adjoint
    sweep, with no solver's multipliers.
    """
    inputs = np.asarray(inputs, dtype=float)
    nodes = states(start, inputs)
    count = len(inputs)
    _, by_state, by_input = (np.array(m) for m in _tangents(count)(nodes[:-1].T, inputs.reshape(1, -1)))
    weights = landing.STEP_S * landing.STATE_WEIGHTS
    by_cost = weights * (nodes[-1] - landing.TARGET)
    by_height = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    gradient, height = np.zeros(count), np.zeros(count)
    for k in range(count - 1, -1, -1):
        a, b = by_state[:, 6 * k : 6 * k + 6], by_input[:, k]
        gradient[k] = b @ by_cost + landing.STEP_S * landing.INPUT_WEIGHT * inputs[k]
        height[k] = b @ by_height
        by_cost = a.T @ by_cost + weights * (nodes[k] - landing.TARGET)
        by_height = a.T @ by_height
    z_m = float(nodes[-1, 1])
    if problem == landing.SOFT and abs(z_m) > LANDED_M:
        nu = landing.PENALTY_PER_M * np.sign(z_m)
    else:
        free = np.abs(inputs) < landing.GIMBAL_LIMIT_RAD - ON_LIMIT_RAD
        scale = height[free] @ height[free]
        nu = -(height[free] @ gradient[free]) / scale if scale > 0.0 else 0.0
    total = gradient + nu * height
    # Where the input would go by the gradient, were it not for its limit: zero at an optimum.
    limit = landing.GIMBAL_LIMIT_RAD
    wrong = np.abs(inputs - np.clip(inputs - total, -limit, limit))
    running = result.cost(nodes, inputs)
    return Flown(running, running + landing.PENALTY_PER_M * abs(z_m), z_m, float(wrong.max()))
