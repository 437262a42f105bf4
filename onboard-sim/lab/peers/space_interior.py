"""fatrop and IPOPT on the landing in space."""

import numpy as np

import landing
import space_landing
from interior import COLD, WARM, Nlp, options, version
from result import cost
from space_entrant import InSpace


# The fastest found, as in the plane; with the barrier of the plane fatrop fails now and then.
WARM_IN_SPACE = {"fatrop": {"fatrop.mu_init": 1e-7, "fatrop.bound_push": 1e-12, "fatrop.bound_frac": 1e-12}}


class SpaceInterior(InSpace):
    """One of them on one of the two problems."""

    def __init__(self, solver, problem, folder):
        self.name, self.solver, self.problem, self.folder = solver, solver, problem, folder
        self.nlps = {}

    def made(self, intervals, how, limits):
        library = space_landing.library_path(self.solver, intervals, self.problem, self.folder)
        warm = {} if how == COLD else WARM_IN_SPACE.get(self.solver, {})
        chosen = options(self.solver, how) | warm | space_landing.structure(self.solver, intervals, self.problem)
        return Nlp(self.solver, library, chosen, limits)

    def _solved(self, intervals, how, start, *given):
        if (intervals, how) not in self.nlps:
            self.nlps[intervals, how] = self.made(intervals, how, space_landing.limits(intervals, self.problem))
        converged, ns, _, found = self.nlps[intervals, how].solve([*start, *self.thrust[-intervals:]], *given)
        inputs, states = (found[0][at] for at in space_landing.places(intervals, self.problem)[:2])
        self.last = intervals, *found
        return converged, ns, cost(np.vstack([start, states]), inputs, space_landing), inputs

    def first(self, start, path):
        return self._solved(len(path), COLD, start, space_landing.variables(path, self.problem))

    def rest(self, samples, start, retry):
        planned, path, lam_x, lam_g = self.plan
        gone, equations = space_landing.WIDTH * samples, space_landing.STATES * samples
        return self._solved(planned - samples, COLD if retry else WARM, start, path[gone:], lam_x[gone:], lam_g[equations:])


def entrants(solver, folder):
    """Called by `worker`."""
    return version(solver), [SpaceInterior(solver, problem, folder) for problem in (landing.HARD, landing.SOFT)]
