"""Compiles every problem's functions to C libraries, once; `build.py FOLDER SOLVER...`."""

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
    """(solver, which problem, intervals, library, effort): every horizon that a warm solve may have left. Those of the cold
    and the kicked solves are compiled with more effort, and first."""
    for problem in (landing.HARD, landing.SOFT):
        for samples in (0, *KICKS):
            yield from (_plane(solver, problem, landing.HORIZON - samples, folder) for solver in solvers)
    for intervals in range(landing.HORIZON - 1, 0, -1):
        if landing.HORIZON - intervals not in KICKS:
            for problem in (landing.HARD, landing.SOFT):
                yield from (_plane(solver, problem, intervals, folder) for solver in solvers)
    for intervals in space_measure.HORIZONS:
        for solver in solvers:
            yield solver, None, intervals, space_landing.library_path(solver, intervals, folder), compiled.FULLY


def _plane(solver, problem, intervals, folder):
    samples = landing.HORIZON - intervals
    effort = compiled.FULLY if samples == 0 or samples in KICKS else compiled.QUICKLY
    return solver, problem, intervals, landing.library_path(solver, intervals, problem, folder), effort


def build(job):
    solver, problem, intervals, library, effort = job
    if problem is None:
        posed, options = space_landing.nlp(intervals), space_landing.structure(solver, intervals)
    else:
        posed, options = landing.nlp(intervals, problem), landing.structure(solver, intervals, problem)
    compiled.functions(solver, posed, options, library, effort)


def main():
    folder = os.path.abspath(sys.argv[1])
    os.makedirs(folder, exist_ok=True)
    # ripopt takes the functions that are made for IPOPT.
    wanted = {"ipopt" if peer == "ripopt" else peer for peer in sys.argv[2:]}
    todo = list(jobs([solver for solver in ("fatrop", "ipopt") if solver in wanted], folder))
    with multiprocessing.Pool(os.cpu_count()) as pool:
        for done, _ in enumerate(pool.imap_unordered(build, todo), 1):
            if done % 20 == 0 or done == len(todo):
                print(f"compiling the problems' functions: {done} of {len(todo)}", flush=True)


if __name__ == "__main__":
    main()
