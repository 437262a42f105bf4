"""Compiles every problem's functions to C libraries, once; `build.py FOLDER`."""

import multiprocessing
import os
import sys

import landing


def jobs():
    """(solver, intervals, expanded): the whole horizon unrolled, and every shorter one for the warm solves."""
    asked = [solver for solver in ("fatrop", "ipopt") if solver in os.environ.get("PEERS", solver)]
    for solver in asked:
        yield (solver, landing.HORIZON, True)
    for intervals in range(landing.HORIZON, 0, -1):
        for solver in asked:
            yield (solver, intervals, False)


def build(job):
    solver, intervals, expand = job
    landing.compiled(solver, intervals, sys.argv[1], expand)
    return job


def main():
    os.makedirs(sys.argv[1], exist_ok=True)
    todo = list(jobs())
    with multiprocessing.Pool(os.cpu_count()) as pool:
        for done, _ in enumerate(pool.imap_unordered(build, todo), 1):
            if done % 10 == 0 or done == len(todo):
                print(f"compiling the problem's functions: {done} of {len(todo)}", flush=True)


if __name__ == "__main__":
    main()
