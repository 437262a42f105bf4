"""What a solve gives, and the first guesses of a cold one."""

import dataclasses

import numpy as np

import landing

# Several times what any solve of these problems that ends takes.
MOST_ITERATIONS = 100

# Amplitudes of the cold guesses' pitch, rad.
BENDS_RAD = (0.3, -0.3)


@dataclasses.dataclass
class Result:
    """One solve. `cost` is the running cost that the solver claims, without the penalty of a miss; inputs in rad."""

    converged: bool
    ns: int
    iterations: int
    cost: float
    inputs: np.ndarray


def guess(start, bend_rad):
    """Straight line in the states, the pitch bent by `bend` sin(2 pi k / N); (states, inputs), the inputs zero."""
    share = np.arange(landing.HORIZON + 1) / landing.HORIZON
    states = start + np.outer(share, landing.TARGET - start)
    states[:, 2] += bend_rad * np.sin(2.0 * np.pi * share)
    return states, np.zeros(landing.HORIZON)


def cost(states, inputs, posed=landing):
    """Running cost of a path."""
    misses, off = states[1:] - posed.TARGET, np.reshape(inputs, (-1, posed.INPUTS)) - posed.REST
    return float(0.5 * posed.STEP_S * (misses**2 @ posed.STATE_WEIGHTS + off**2 @ posed.INPUT_WEIGHTS).sum())
