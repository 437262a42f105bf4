"""Compiles every problem's functions to C libraries, once; `build.py FOLDER SOLVER...`. Of PEERS_ONLY alone, if it is given."""

import itertools
import multiprocessing
import os
import sys

import compiled
import landing
import space_landing
import space_measure

# After these the kicks come.
KICKS = range(1, 49, 6)


def jobs(solvers, folder):
    """(plane or space, solver, which problem, intervals, library, effort): every horizon that a warm solve may have left. Those of the cold
    and the kicked solves are compiled with more effort, and first."""
    only = os.environ.get("PEERS_ONLY")
    for posed, least, kicks in ((landing, 1, KICKS), (space_landing, space_landing.SETTLED_NODES + 1, space_measure.KICK_SAMPLES)):
        if only and posed is not {"plane": landing, "space": space_landing}[only]:
            continue
        fully = [posed.HORIZON, *(posed.HORIZON - samples for samples in kicks)]
        quickly = [intervals for intervals in range(posed.HORIZON - 1, least - 1, -1) if intervals not in fully]
        for effort, horizons in ((compiled.FULLY, fully), (compiled.QUICKLY, quickly)):
            for intervals, problem, solver in itertools.product(horizons, (landing.HARD, landing.SOFT), solvers):
                yield posed.__name__, solver, problem, intervals, posed.library_path(solver, intervals, problem, folder), effort


def build(job):
    module, solver, problem, intervals, library, effort = job
    posed = sys.modules[module]
    compiled.functions(solver, posed.nlp(intervals, problem), posed.structure(solver, intervals, problem), library, effort)


def main():
    folder = os.path.abspath(sys.argv[1])
    os.makedirs(folder, exist_ok=True)
    # ripopt takes the functions that are made for IPOPT.
    wanted = {"ipopt" if peer == "ripopt" else peer for peer in sys.argv[2:]}
    todo = list(jobs([solver for solver in ("fatrop", "ipopt") if solver in wanted], folder))
    with multiprocessing.Pool(len(os.sched_getaffinity(0))) as pool:
        for done, _ in enumerate(pool.imap_unordered(build, todo), 1):
            if done % 20 == 0 or done == len(todo):
                print(f"compiling the problems' functions: {done} of {len(todo)}", flush=True)


if __name__ == "__main__":
    main()
