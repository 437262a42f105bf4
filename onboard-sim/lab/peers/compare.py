"""The landing problem solved by public solvers and ours, taking turns; `compare.py --help`."""

import argparse
import os
import platform
import subprocess
import sys

import floor
import landing
import measure
import quadratic
import worker
from ours import Ours
from space_landing import HARD, SOFT


# Who gets one step's quadratic problem alone.
QUADRATIC = ("piqp", "hpipm")


def said(*command):
    """First line of what a command prints."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0]
    except (OSError, subprocess.CalledProcessError, IndexError):
        return f"{command[0]} of unknown version"


def machine():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as info:
            return next(line.split(":")[1].strip() for line in info if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


def limit(ours):
    """One iteration beside the floating-point limit of its sweep."""
    start = quadratic.STARTS[0]
    inputs = ours.plane_cold(start)
    floor.report(landing.states(start, inputs), inputs, ours.peak(), ours.layers(start))


def asked():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ours", required=True, help="our program")
    parser.add_argument("--functions", required=True, help="folder of the compiled functions")
    parser.add_argument("--wheel", required=True, help="folder of the acados wheel")
    parser.add_argument("--acados", required=True, help="folder of the programs that acados generates")
    parser.add_argument("--ripopt", required=True, help="ripopt's library")
    parser.add_argument("--bridge", required=True, help="the library between ripopt and the functions")
    parser.add_argument("peers", nargs="+", choices=("fatrop", "ipopt", "ripopt", "acados", *QUADRATIC))
    return parser.parse_args()


def main():
    sys.stdout.reconfigure(line_buffering=True)
    words = asked()
    functions = words.functions
    workers = {
        "fatrop": ("interior", "fatrop", functions),
        "ipopt": ("interior", "ipopt", functions),
        "ripopt": ("ripopt_solver", words.ripopt, words.bridge, functions),
        "acados": ("acados_solver", words.acados, words.wheel),
    } | {peer: ("quadratic", peer, words.wheel) for peer in QUADRATIC}
    print(f"{machine()}; {said(os.environ.get('CC', 'cc'), '--version')}; {said('rustc', '--version')}")
    print(f"ours at {said('git', '-C', os.path.dirname(__file__), 'describe', '--always', '--dirty', '--exclude=*')}")
    plane, steps, entrants = Ours(words.ours), [], [Ours(words.ours, problem) for problem in (HARD, SOFT)]
    for peer in words.peers:
        version, made = worker.start(*workers[peer])
        print(version, flush=True)
        (steps if peer in QUADRATIC else entrants).extend(made)
    measure.run(entrants)
    if steps:
        quadratic.run(plane, steps)
        limit(plane)


if __name__ == "__main__":
    main()
