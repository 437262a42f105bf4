"""Random cold starts in a box around the paper's nominal one: ours on all of them, public solvers on the first."""

import collections

import numpy as np

import landing
from measure import SMALL, Checks
from ours import Ours
from result import BENDS_RAD
from tables import NS_PER_MS, dearer, geometric, head, number, row

OURS, THEIRS = 10_000, 12 if SMALL else 60
SEED = 1


def draws():
    """Pitch 60 to 120 deg, w within 3 m/s, q within 60 deg/s, height and speed within 20 %."""
    random = np.random.default_rng(SEED)
    low = np.array([0.0, 12.0, np.radians(60.0), -6.0, -3.0, np.radians(-60.0)])
    high = np.array([0.0, 18.0, np.radians(120.0), -4.0, 3.0, np.radians(60.0)])
    return random.uniform(low, high, (OURS, 6))


def ours(own, all_starts):
    """What becomes of every start in our solver, and whether each lands."""
    ends, lands, times, odd = collections.Counter(), [], [], []
    checks = Checks()
    for start in all_starts:
        result = own.cold_both(start)
        solve = checks.take(own.problem, start, result)
        landed = solve.confirmed and solve.flown.lands
        lands.append(landed)
        times.append(result.ns)
        if result.converged:
            ends["converged to a landing" if landed else "converged, the end height missed at its penalty"] += 1
        else:
            ends[own.status] += 1
            if own.status != "not landable":
                odd.append((own.status, start))
    print(f"\n**{len(all_starts)} random cold starts, ours, soft**\n")
    head(["end", "starts"])
    for end, count in ends.most_common():
        row([end, str(count)])
    ms = np.array(times) / NS_PER_MS
    print(f"\nmedian {number(np.median(ms))} ms, largest {number(ms.max())} ms; {checks.flown} flown again, {checks.refuted} refuted")
    for status, start in odd:
        print(f"{status} from {start.tolist()}")
    return lands


def run(records):
    """Both tables."""
    all_starts = draws()
    own = {record.problem: record.entrant for record in records if isinstance(record.entrant, Ours)}
    lands = ours(own[landing.SOFT], all_starts)
    few = [start for start, landed in zip(all_starts[:THEIRS], lands) if landed]
    print(f"\n**the first {len(few)} of them that ours lands, both guesses each**\n")
    head(["", "problem", "neither guess lands", "dearer than the best", "ms", "ratio"])
    found = {record: [] for record in records if "cold" in record.entrant.makes}
    best = [np.inf] * len(few)
    for index, start in enumerate(few):
        for record, solves in found.items():
            merit, ns = attempt(record, start)
            best[index] = min(best[index], merit)
            solves.append((merit, ns))
    for record, solves in found.items():
        base = next(each for other, each in found.items() if isinstance(other.entrant, Ours) and other.problem == record.problem)
        failed = sum(not np.isfinite(merit) for merit, _ in solves)
        worse = sum(np.isfinite(merit) and dearer(merit, least) for (merit, _), least in zip(solves, best))
        pairs = [(ns, own_ns) for (merit, ns), (_, own_ns) in zip(solves, base) if np.isfinite(merit)]
        time, ratio = geometric(ns for ns, _ in pairs) / NS_PER_MS, geometric(ns / own_ns for ns, own_ns in pairs)
        row([record.name, record.problem, str(failed), str(worse), number(time), number(ratio)])


def attempt(record, start):
    """The merit of the better landing of both guesses, infinite if there is none, and the time of both."""
    entrant = record.entrant
    if isinstance(entrant, Ours):
        results = [entrant.cold_both(start)]
    else:
        results = [entrant.cold(start, bend) for bend in BENDS_RAD]
    solves = [record.solved(start, result) for result in results]
    merits = [s.flown.worth(record.problem) for s in solves if s.confirmed and s.flown.lands]
    return min(merits, default=np.inf), sum(s.ns for s in solves)
