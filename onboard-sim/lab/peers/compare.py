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
import rollout
import scattered
import space_measure
import tables
import worker
from ours import SPACE_HARD_PENALTY, Ours


# "plane" or "space", for one of the two; both without.
ONLY = os.environ.get("PEERS_ONLY")

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
    start = measure.STARTS[0]
    inputs = ours.cold_both(start).inputs
    floor.report(rollout.states(start, inputs), inputs, ours.peak(), ours.layers(start))


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
    plane = {
        "fatrop": ("interior", "fatrop", functions),
        "ipopt": ("interior", "ipopt", functions),
        "ripopt": ("ripopt_solver", words.ripopt, words.bridge, functions),
        "acados": ("acados_solver", words.acados, words.wheel),
    } | {peer: ("quadratic", peer, words.wheel) for peer in QUADRATIC}
    space = {
        "fatrop": ("space_interior", "fatrop", functions),
        "ipopt": ("space_interior", "ipopt", functions),
        "ripopt": ("space_ripopt", words.ripopt, words.bridge, functions),
        "acados": ("space_acados", words.acados, words.wheel),
    }
    own = [Ours(words.ours, problem) for problem in (landing.HARD, landing.SOFT)]
    print(f"{machine()}; {said(os.environ.get('CC', 'cc'), '--version')}; {said('rustc', '--version')}")
    print(f"ours at {said('git', '-C', os.path.dirname(__file__), 'describe', '--always', '--dirty', '--exclude=*')}")
    if ONLY != "space":
        in_plane(own, {peer: started(plane[peer]) for peer in words.peers})
    if ONLY != "plane":
        own = [Ours(words.ours, problem, SPACE_HARD_PENALTY) for problem in (landing.HARD, landing.SOFT)]
        space_measure.run([*own, *(entrant for peer in words.peers if peer in space for entrant in started(space[peer]))])


def started(how):
    """The entrants of a worker; prints what they are."""
    version, made = worker.start(*how)
    print(version, flush=True)
    return made


def in_plane(own, public):
    steps = [entrant for peer, made in public.items() if peer in QUADRATIC for entrant in made]
    if steps:
        quadratic.run(own[0], steps)
    entrants = [*own, *(entrant for peer, made in public.items() if peer not in QUADRATIC for entrant in made)]
    records = [measure.Record(entrant) for entrant in entrants]
    measure.cold(records)
    planned_rad = measure.warm(records)
    fields = [tables.Field(records, problem) for problem in (landing.HARD, landing.SOFT)]
    for field in fields:
        tables.solves(field)
    for field in fields:
        tables.steps(field, planned_rad)
    measure.disturbed(records)
    for field in fields:
        tables.loops(field)
    tables.checks(fields)
    scattered.run(records)
    limit(own[1])


if __name__ == "__main__":
    main()
