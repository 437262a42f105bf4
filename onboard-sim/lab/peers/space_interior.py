"""fatrop and IPOPT on the landing in space, cold and warm."""

import numpy as np

import space_landing
from interior import COLD, WARM, Nlp, options


class SpaceInterior:
    """One of them."""

    problem, makes, loops = "space", (), False

    def __init__(self, solver, folder):
        self.name, self.solver, self.folder = solver, solver, folder
        self.nlps, self.plan, self.thrust = {}, None, None

    def solve(self, intervals, how, parameter, *given):
        """(converged, ns, claimed cost, inputs) and the plan."""
        if (intervals, how) not in self.nlps:
            library = space_landing.library_path(self.solver, intervals, self.folder)
            chosen = options(self.solver, how) | space_landing.structure(self.solver, intervals)
            self.nlps[intervals, how] = Nlp(self.solver, library, chosen, space_landing.bounds(intervals))
        nlp = self.nlps[intervals, how]
        converged, ns, _, plan = nlp.solve(parameter, *given)
        inputs = plan[0].reshape(-1, space_landing.WIDTH)[:, : space_landing.INPUTS]
        return (converged, ns, float(nlp.outputs["f"][0]), inputs), plan

    def space_cold(self, ratio, start):
        """From both guesses; the cheaper landing, and the time of both."""
        parameter = np.append(start, space_landing.thrusts(ratio))
        found = [
            self.solve(space_landing.INTERVALS, COLD, parameter, space_landing.guess(start, turns))[0]
            for turns in space_landing.TURNS
        ]
        converged, _, claimed, inputs = min(found, key=lambda one: (not one[0], one[2]))
        return converged, sum(one[1] for one in found), claimed, inputs

    def space_adopt(self, ratio, start, inputs, nodes):
        """Converges from a given optimum and holds it."""
        self.thrust = space_landing.thrusts(ratio)
        first = np.hstack([inputs, nodes[1:]]).ravel()
        _, self.plan = self.solve(space_landing.INTERVALS, COLD, np.append(start, self.thrust), first)

    def space_warm(self, samples, start):
        """Solves what is left some samples after the plan began."""
        path, lam_x, lam_g = self.plan
        gone, equations = space_landing.WIDTH * samples, space_landing.STATES * samples
        parameter = np.append(start, self.thrust[samples:])
        intervals = space_landing.INTERVALS - samples
        result, _ = self.solve(intervals, WARM, parameter, path[gone:], lam_x[gone:], lam_g[equations:])
        return result


def entrants(solver, folder):
    """Called by `worker`."""
    return solver, [SpaceInterior(solver, folder)]
