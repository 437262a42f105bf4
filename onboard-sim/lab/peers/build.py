"""Compiles the landing's functions to C libraries, once; `build.py FOLDER SOLVER...`."""

import itertools
import multiprocessing
import os
import sys

import compiled
import measure
import space_landing
from space_landing import HARD, HORIZON, SOFT


def jobs(solvers, folder):
    """(solver, problem, intervals, library, effort): every horizon that a warm solve may have left. Those of the cold and the
    kicked solves are compiled with more effort, and first."""
    fully = [HORIZON, *(HORIZON - samples for samples in measure.KICK_SAMPLES)]
    quickly = [intervals for intervals in range(HORIZON - 1, HORIZON - 1 - measure.LOOP_SAMPLES, -1) if intervals not in fully]
    for effort, horizons in ((compiled.FULLY, fully), (compiled.QUICKLY, quickly)):
        for intervals, problem, solver in itertools.product(horizons, (HARD, SOFT), solvers):
            yield solver, problem, intervals, space_landing.library_path(solver, intervals, problem, folder), effort


def build(job):
    solver, problem, intervals, library, effort = job
    posed, options = space_landing.nlp(intervals, problem), space_landing.structure(solver, intervals, problem)
    compiled.functions(solver, posed, options, library, effort)


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
