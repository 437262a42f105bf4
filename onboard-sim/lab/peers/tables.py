"""The measurements as tables."""

import numpy as np

import landing
from measure import STARTS
from ours import Ours
from result import BENDS_RAD

# An answer that costs more than the cheapest found by this share and this much is another, dearer landing. The second is
# for the last samples, which cost little: a hard end height that is missed by a tenth of a millimetre is worth as much.
DEARER, DEARER_BY = 1e-4, 0.02

NS_PER_MS = 1e6


def geometric(values):
    values = np.asarray(list(values), dtype=float)
    return float(np.exp(np.mean(np.log(values)))) if len(values) else float("nan")


def dearer(cost, best):
    return cost > best * (1.0 + DEARER) + DEARER_BY


def number(value, digits=3):
    if not np.isfinite(value):
        return "-"
    return f"{float(f'{value:.{digits}g}'):.10g}"


def row(cells):
    print("| " + " | ".join(cells) + " |")


def head(cells):
    row(cells)
    print("|" + "---|" * len(cells))


class Field:
    """The records of one problem, and which of its kicks can be solved."""

    def __init__(self, records, problem):
        self.problem = problem
        self.records = [record for record in records if record.problem == problem]
        self.ours = next(record for record in self.records if isinstance(record.entrant, Ours))
        kicked = [record.kicked for record in self.records if record.kicked]
        self.best = [min((s.flown.worth(problem) for s in each if s.confirmed), default=np.inf) for each in zip(*kicked)]
        self.solvable = np.isfinite(self.best)
        cold = {key for record in self.records for key in record.cold if key[1] != "both"}
        self.cold_best = {}
        for start, bend in cold:
            found = [s.flown.worth(problem) for r in self.records for s in r.cold.get((start, bend), []) if s.confirmed]
            self.cold_best[start] = min([self.cold_best.get(start, np.inf), *found])


def shown(failed, worse=0):
    words = [f"{failed} fail"] if failed else []
    words += [f"{worse} dearer"] if worse else []
    return ("; " + ", ".join(words)) if words else ""


def cold_cells(field, record, both):
    """Time and ratio of cold solves: of each guess alone, or of both together."""
    times, ratios, failed = [], [], 0
    for start in range(len(STARTS)):
        groups = [BENDS_RAD] if both else [(bend,) for bend in BENDS_RAD]
        for bends in groups:
            if not record.cold:
                return ["", ""]
            failed += sum(not record.cold[start, bend][-1].converged for bend in bends)
            own = _own(field, start, bends)
            its = own if record is field.ours else sum(_median(record, start, bend) for bend in bends)
            times.append(its)
            if all(r.cold[start, bend][-1].converged for bend in bends for r in (record, field.ours)):
                ratios.append(its / own)
    return [number(geometric(times) / NS_PER_MS) + shown(failed), number(geometric(ratios))]


def _median(record, start, bend):
    return float(np.median([solve.ns for solve in record.cold[start, bend]]))


def _own(field, start, bends):
    return _median(field.ours, start, bends[0] if len(bends) == 1 else "both")


def dearer_starts(field, record):
    """Starts whose better landing of both guesses is dearer than the best that anybody found."""
    count = 0
    for start, best in field.cold_best.items():
        found = [s.flown.worth(field.problem) for bend in BENDS_RAD for s in record.cold[start, bend] if s.confirmed]
        count += bool(found) and dearer(min(found), best)
    return count


def warm_cells(field, solves, own, counted, best=None):
    """Time and ratio of warm solves that both it and ours converged."""
    pairs = [(s, o) for s, o, use in zip(solves, own, counted) if use and s.converged and o.converged]
    failed = sum(use and not s.converged for s, use in zip(solves, counted))
    worse = 0
    if best is not None:
        worth = [(s.flown.worth(field.problem), b) for s, b, use in zip(solves, best, counted) if use and s.converged]
        worse = sum(dearer(*pair) for pair in worth)
    time = geometric(s.ns for s, _ in pairs) / NS_PER_MS
    return [number(time) + shown(failed, worse), number(geometric(s.ns / o.ns for s, o in pairs))]


def solves(field):
    """Cold, kicked and undisturbed."""
    kicks, solvable = len(field.solvable), int(field.solvable.sum())
    what = "z_N = 0 hard" if field.problem == landing.HARD else "z_N soft"
    print(f"\n**{what}**: ms, and ratio to ours; {solvable} of {kicks} kicks have a solution\n")
    head(["", "cold, one guess", "ratio", "cold, both", "ratio", "kicked", "ratio", "undisturbed", "ratio"])
    for record in field.records:
        if "warm" not in record.entrant.makes:
            continue
        cells = cold_cells(field, record, both=False) + cold_cells(field, record, both=True)
        cells[2] += shown(0, dearer_starts(field, record))
        cells += warm_cells(field, record.kicked, field.ours.kicked, field.solvable, field.best)
        cells += warm_cells(field, record.calm, field.ours.calm, [True] * len(record.calm))
        row([record.name, *cells])


def steps(field, planned_rad):
    """Single iterations after the kicks: how near the first input is to the optimum's."""
    truth = [s.first_rad if s.confirmed else np.nan for s in field.ours.kicked]
    print(f"\n**one iteration after a kick, {field.problem}**: first input's distance from the optimum's, degrees\n")
    head(["", "ms", "ratio to ours converged", "mean", "median", "largest", "fail"])

    def line(name, solves):
        use = [i for i, t in enumerate(truth) if field.solvable[i] and np.isfinite(t)]
        good = [i for i in use if solves[i].converged]
        off = np.degrees([abs(solves[i].first_rad - truth[i]) for i in good])
        time = geometric(solves[i].ns for i in good) / NS_PER_MS
        ratio = geometric(solves[i].ns / field.ours.kicked[i].ns for i in good)
        cells = [number(v) for v in (off.mean(), np.median(off), off.max())] if len(off) else ["-"] * 3
        row([name, number(time), number(ratio), *cells, str(len(use) - len(good))])

    off = np.degrees([abs(p - t) for p, t, use in zip(planned_rad, truth, field.solvable) if use and np.isfinite(t)])
    row(["no new plan", "", "", number(off.mean()), number(np.median(off)), number(off.max()), ""])
    for cap, capped in field.ours.capped.items():
        line(f"ours, at most {cap}", capped)
    line("ours, converged", field.ours.kicked)
    for record in field.records:
        if record.steps and record is not field.ours:
            line(record.name, record.steps)


def loops(field):
    """The disturbed closed loop."""
    count = len(field.ours.loop)
    print(f"\n**disturbed closed loop, {field.problem}**: {count} solves\n")
    head(["", "failed", "ms a step", "ratio", "median", "worst", "largest height off at burn-out, m"])
    own = geometric(s.ns for s in field.ours.loop)
    for record in field.records:
        if not record.loop:
            continue
        ns = np.array([s.ns for s in record.loop], dtype=float)
        failed = sum(not s.converged for s in record.loop)
        cells = [geometric(ns) / NS_PER_MS, geometric(ns) / own, np.median(ns) / NS_PER_MS, ns.max() / NS_PER_MS]
        row([record.name, str(failed), *map(number, cells), number(np.abs(record.heights_m).max())])


def checks(fields):
    """What flying all answers again says."""
    print("\n**every converged answer flown again**\n")
    head(["", "problem", "answers", "refuted", "cost off", "z_N, m", "gradient"])
    for field in fields:
        for record in field.records:
            found = record.checks
            if found.flown:
                worst = [f"{value:.0e}" for value in (found.cost, found.miss_m, found.gradient)]
                row([record.name, field.problem, str(found.flown), str(found.refuted), *worst])
