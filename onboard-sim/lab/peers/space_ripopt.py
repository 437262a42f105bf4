"""ripopt on the landing in space, with the functions that IPOPT gets."""

import landing
import space_landing
from ripopt_solver import Functions, Solver, loaded
from space_interior import SpaceInterior


class SpaceRipopt(SpaceInterior):
    """On one of the two problems."""

    def __init__(self, ripopt, bridge, problem, folder):
        super().__init__("ripopt", problem, folder)
        self.ripopt, self.bridge = ripopt, bridge

    def made(self, intervals, how, limits):
        functions = Functions(space_landing.library_path("ipopt", intervals, self.problem, self.folder))
        return Solver(self.ripopt, self.bridge, functions, limits, how)


def entrants(library, bridge, folder):
    """Called by `worker`."""
    ripopt, bridge, version = loaded(library, bridge)
    return version, [SpaceRipopt(ripopt, bridge, problem, folder) for problem in (landing.HARD, landing.SOFT)]
