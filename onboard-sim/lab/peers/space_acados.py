"""acados on the landing in space: exact Hessian, partial condensing, full steps."""

import os

import numpy as np

import acados_problem
import landing
import space_landing
from acados_solver import Acados, Plan
from space_entrant import InSpace


class SpaceAcados(InSpace, Acados):
    """On one of the two problems. Warm, it gets the plan as it is, with all multipliers: rolled out, it is slower."""

    makes, loops = InSpace.makes, InSpace.loops

    def __init__(self, problem, folder):
        super().__init__(acados_problem.Kind(space_landing, problem, rti=False, exact=True, full=False), folder, None)
        self.makes, self.loops = InSpace.makes, InSpace.loops

    def _solved(self, start, plan, with_multipliers):
        result = self.solve(start, plan, with_multipliers, self.thrust[-len(plan.inputs) :])
        return result.converged, result.ns, result.cost, result.inputs

    def first(self, start, path):
        inputs, after = np.split(path, [space_landing.INPUTS], axis=1)
        return self._solved(start, Plan(np.vstack([start, after]), inputs, None, None), False)

    def rest(self, samples, start, retry):
        rest = self.plan.rest(samples)
        return self._solved(start, rest, not retry)


def entrants(folder, wheel_folder):
    """Called by `worker`."""
    version = acados_problem.installed(wheel_folder)
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)  # acados writes into the working directory
    return version, [SpaceAcados(problem, folder) for problem in (landing.HARD, landing.SOFT)]
