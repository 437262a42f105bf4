"""What the public solvers have in common on the landing in space."""

import numpy as np

import space_landing


class InSpace:
    """One of them. It has a method `first(start, path)`, a cold solve from a path of the variables (u_k, x_{k+1}), and a method
    `rest(samples, start, retry)`, a warm solve of what is left of `plan`; both give (converged, ns, claimed cost, inputs), keep
    what is to be held as `last`, and use the end of `thrust`."""

    thrust = plan = last = None

    def cold(self, ratio, start):
        """From both guesses; the cheaper landing, and the time of both."""
        self.thrust = space_landing.thrusts(ratio)
        found = [self.first(start, space_landing.guess(start, turns)) for turns in space_landing.TURNS]
        converged, _, claimed, inputs = min(found, key=lambda one: (not one[0], one[2]))
        return converged, sum(one[1] for one in found), claimed, inputs

    def adopt(self, ratio, start, inputs, nodes):
        """Converges from a given optimum and holds it."""
        self.thrust = space_landing.thrusts(ratio)
        self.first(start, np.hstack([inputs, nodes[1:]]))
        self.hold()

    def hold(self):
        self.plan = self.last

    def warm(self, samples, start, retry=False):
        """Solves what is left some samples after the plan began; with `retry`, more as a cold solve."""
        return self.rest(samples, start, retry)
