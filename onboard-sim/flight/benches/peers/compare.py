"""The landing problem solved by public solvers and ours, taking turns; `compare.py OUR_PROGRAM FUNCTIONS_FOLDER`."""

import os
import sys

import numpy as np

import acados_solver
import floor
import landing
import rollout
from solvers import Ours, Public

BEND_RAD = 0.3
COLD_ROUNDS = 20
KICK_SAMPLES = range(1, 49, 6)
KICK_SIGNS = ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, -1))
KICK = np.array([0.0, 0.0, 0.0, 0.02, 0.02, np.radians(0.5)])
DISTURBANCE = np.array([0.0, 0.0, 0.0, 0.002, 0.002, np.radians(0.05)])
SEED = 20
# An answer whose cost is larger by this share is another, dearer landing.
DEARER = 1e-4


def starts():
    """The paper's seven: nominal, tilted, drifting, turning."""
    for pitch_deg, w, q_deg in ((90, 0, 0), (60, 0, 0), (120, 0, 0), (90, -1, 0), (90, 1, 0), (90, 0, -5), (90, 0, 5)):
        name = f"theta {pitch_deg} w {w:+d} q {q_deg:+d}"
        yield name, np.array([0.0, 15.0, np.radians(pitch_deg), -5.0, w, np.radians(q_deg)])


def geometric(values):
    return float(np.exp(np.mean(np.log(values))))


def line(name, times, against=None, iterations=None, note=""):
    """One row of a table; times in ns."""
    times = np.array(times) / 1e6
    ratio = "" if against is None else f"{geometric(times) / (geometric(against) / 1e6):>8.1f}"
    many = "" if iterations is None else f"{np.mean(iterations):.1f}"
    low, high = np.median(times), np.percentile(times, 99)
    print(f"{name:<28}{geometric(times):>9.4f}{low:>9.4f}{high:>9.4f}{times.max():>9.4f}{many:>7}{ratio:>8}  {note}")


def head(title, ratio="ratio"):
    print(f"\n{title}\n{'ms of processor time':<28}{'geomean':>9}{'median':>9}{'p99':>9}{'max':>9}{'iter':>7}{ratio:>8}")


class Agreement:
    """The worst of what independent roll-outs of a solver's inputs say."""

    def __init__(self):
        self.cost = self.miss = self.gradient = 0.0

    def add(self, start, result):
        cost, miss, gradient = rollout.optimality(start, result.inputs)
        self.cost = max(self.cost, abs(cost - result.cost))
        self.miss, self.gradient = max(self.miss, miss), max(self.gradient, gradient)

    def __str__(self):
        return f"cost off {self.cost:.0e}, z_N {self.miss:.0e} m, gradient {self.gradient:.0e}"


def cold(ours, public):
    """Cold solves of the seven starts; the costs each found."""
    times, iterations, results, agreement = {}, {}, {}, {}
    runs = [("ours, both guesses", ours.cold)]
    for name, solver in public.items():
        runs += [(f"{name}, {bend:+.1f}", lambda s, v=solver, b=bend: v.cold(s, b)) for bend in (BEND_RAD, -BEND_RAD)]
    for _ in range(COLD_ROUNDS):
        for start_name, start in starts():
            for name, run in runs:
                result = run(start)
                times.setdefault((name, start_name), []).append(result.ns)
                results[name, start_name], iterations[name, start_name] = result, result.iterations
    names = [name for name, _ in starts()]

    def medians(name):
        return np.array([np.median(times[name, start]) for start in names])

    for name, _ in runs:
        agreement[name] = Agreement()
        for start_name, start in starts():
            if results[name, start_name].converged:
                agreement[name].add(start, results[name, start_name])
    own = medians("ours, both guesses")
    head(f"cold, seven starts, median of {COLD_ROUNDS} each", "/ ours")
    for name, _ in runs:
        failed = sum(not results[name, start].converged for start in names)
        note = (f"{failed} failed; " if failed else "") + str(agreement[name])
        line(name, medians(name), own, [iterations[name, s] for s in names], note)
    for name in public:
        both = medians(f"{name}, {BEND_RAD:+.1f}") + medians(f"{name}, {-BEND_RAD:+.1f}")
        line(f"{name}, both guesses", both, own)
    print(f"\n{'cost':<22}" + "".join(f"{name:>20}" for name, _ in runs))
    for start in names:
        found = (results[name, start] for name, _ in runs)
        print(f"{start:<22}" + "".join(f"{r.cost if r.converged else float('nan'):>20.5f}" for r in found))


def warm(ours, public):
    """Undisturbed and kicked warm solves along each start's best landing, which is every solver's plan."""
    everyone = {"ours": ours, **public}
    calm = {name: [] for name in everyone}
    kicked = {name: [] for name in everyone}
    agreement = {name: Agreement() for name in everyone}
    for _, start in starts():
        best = ours.cold(start)
        nodes = rollout.states(start, best.inputs)
        ours.hold(best)
        for solver in public.values():
            solver.adopt(start, nodes, best.inputs)
        for samples in range(1, landing.HORIZON):
            for name, solver in everyone.items():
                calm[name].append(solver.warm(samples, nodes[samples]))
        for samples in KICK_SAMPLES:
            for signs in KICK_SIGNS:
                state = nodes[samples] + KICK * np.array([0, 0, 0, *signs])
                for name, solver in everyone.items():
                    result = solver.warm(samples, state)
                    kicked[name].append(result)
                    if result.converged and result.lands:
                        agreement[name].add(state, result)
    soft = [not result.lands for result in kicked["ours"]]
    table("warm, undisturbed, horizon shrinking from 49 to 1", calm, np.zeros(len(calm["ours"]), bool))
    table("warm, kicked by 2 cm/s in u and w and 0.5 deg/s in q", kicked, np.array(soft), agreement)


def table(title, results, soft, agreement=None):
    """Times of each solver where it and ours converged; who failed otherwise. `soft`: no landing at zero height exists."""
    head(f"{title}: {len(soft)} solves, {soft.sum()} of them without a landing at zero height", "/ ours")
    for name, each in results.items():
        pairs = [(r, own) for r, own, no in zip(each, results["ours"], soft) if not no and r.converged and own.converged]
        own_ns = [own.ns for _, own in pairs]
        landable = sum(not r.converged for r, no in zip(each, soft) if not no)
        dearer = sum(r.cost > own.cost * (1.0 + DEARER) for r, own in pairs)
        note = f"{landable} landable ones failed, {dearer} dearer" + (f"; {agreement[name]}" if agreement else "")
        line(name, [r.ns for r, _ in pairs], own_ns, [r.iterations for r, _ in pairs], note)
    if soft.any():
        line("ours, all", [r.ns for r in results["ours"]], None, [r.iterations for r in results["ours"]])


def disturbed(ours, public):
    """Closed loops from the seven starts: each solver flies its own plan under the same disturbances. A public
    solver that fails warm may try again with the barrier of a cold solve."""
    head("closed loop, 2 mm/s in u and w and 0.05 deg/s in q (standard deviations) a sample, 7 x 49 solves")
    for name, solver in {"ours": ours, **public}.items():
        random = np.random.default_rng(SEED)
        times, iterations, failed, soft = [], [], 0, 0
        for _, start in starts():
            result = solver.cold(start) if name == "ours" else solver.cold(start, BEND_RAD)
            solver.hold(result)
            inputs, state, since = result.inputs, start, 0
            for _ in range(1, landing.HORIZON):
                state = np.array(landing.STEP(state, inputs[since])).ravel() + DISTURBANCE * random.normal(size=6)
                since += 1
                result = solver.warm(since, state)
                ns = result.ns
                if not result.converged and name != "ours":
                    result = solver.warm(since, state, retry=True)
                    ns += result.ns
                times.append(ns)
                iterations.append(result.iterations)
                failed += not result.converged
                soft += result.converged and not result.lands
                # Even a failed solve's best iterate is flown, if it can be.
                if len(result.inputs) and np.all(np.isfinite(result.inputs)):
                    solver.hold(result)
                    limit_rad = landing.GIMBAL_LIMIT_RAD
                    inputs, since = np.clip(result.inputs, -limit_rad, limit_rad), 0
        note = f"failed {failed} of {len(times)}" + (f", {soft} touch down off zero height" if soft else "")
        line(name, times, None, iterations, note)


def limit(ours):
    """One iteration beside the floating-point limit of its sweep."""
    _, start = next(starts())
    inputs = ours.cold(start).inputs
    floor.report(rollout.states(start, inputs), inputs, ours.peak(), ours.layers(start))


def main():
    program, folder = sys.argv[1:]
    ours = Ours(program)
    asked = os.environ.get("PEERS", "fatrop ipopt acados").split()
    public = {name: Public(name, folder) for name in ("fatrop", "ipopt") if name in asked}
    if "acados" in asked:
        print(f"acados: {acados_solver.installed()}")
        for name, priced in (("acados, hard", False), ("acados, priced", True)):
            public[name] = acados_solver.Acados(os.path.join(folder, "acados"), priced)
    cold(ours, public)
    warm(ours, public)
    disturbed(ours, public)
    limit(ours)


if __name__ == "__main__":
    main()
