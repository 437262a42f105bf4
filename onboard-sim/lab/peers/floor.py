"""The floating-point limit of one sweep: how much arithmetic it is, and how fast this machine does arithmetic."""

import numpy as np

import landing
import sweep
from counted import Count, Number

COUNTED_AS_ONE = ("add", "multiply", "divide", "root")


def floor(states, gimbals, peak):
    """Flops and ns of each phase, at a path. `peak`: flop/ns and latencies, as the solver's side measured them."""
    flop_per_ns, *latencies = peak
    count = Count(dict(zip(COUNTED_AS_ONE, latencies)))
    rng = np.random.default_rng(1)
    intervals = len(gimbals)
    lambdas = rng.normal(size=(intervals, 6)) * 50.0

    def numbers(values):
        return [Number(value, count) for value in values]

    phases = {}

    def close(name, results):
        counted = count.take()
        flops = sum(counted.values())
        chain = max((n.ready for n in results if isinstance(n, Number)), default=0.0)
        phases[name] = (flops, flops / flop_per_ns, chain, counted)

    evaluated = [
        sweep.interval(numbers(states[k]), Number(gimbals[k], count), numbers(lambdas[k])) for k in range(intervals)
    ]
    ends = [n for after, pulled, rows, bend in evaluated for part in (after, pulled, *rows, *bend) for n in part]
    close("tangents, adjoints, exact Hessian", ends)

    weights = landing.STEP_S * landing.STATE_WEIGHTS
    slopes = [[(value - t) * w for value, t, w in zip(numbers(x), landing.TARGET, weights)] for x in states]
    gaps = [[after - there for after, there in zip(e[0], numbers(x))] for e, x in zip(evaluated, states[1:])]
    limit, barrier = landing.GIMBAL_LIMIT_RAD, 1e-2
    inputs = []
    for gimbal in numbers(gimbals):
        below, above = 1.0 / (gimbal + limit), 1.0 / (limit - gimbal)
        bound = (Number(barrier * 10, count), Number(barrier * 10, count))
        curvature = bound[0] * below + bound[1] * above + landing.STEP_S * landing.INPUT_WEIGHT
        slope = gimbal * (landing.STEP_S * landing.INPUT_WEIGHT) + (above - below) * barrier
        inputs.append((curvature, slope))
    node_weights = [numbers(weights) for _ in states]
    node_weights[-1][1] = Number(1e3, count)  # the end height's condition
    close("gradient, limits, defects", [n for row in gaps for n in row])

    for row in evaluated:  # each phase's latency from its own beginning
        for part in (row[0], row[1], *row[2], *row[3]):
            for n in part:
                if isinstance(n, Number):
                    n.ready = 0.0
    for n in [n for row in (*slopes, *gaps, *inputs) for n in row]:
        n.ready = 0.0
    rows, bends = [e[2] for e in evaluated], [e[3] for e in evaluated]
    # Enough convexity for the random costates.
    for pair in inputs:
        pair[0].value += 1e3
    answers = sweep.backward(rows, bends, node_weights, slopes, inputs, gaps)
    flat = [n for gain, offset in answers for n in (*(gain or ()), offset)]
    close("backward Riccati sweep", flat)
    for n in flat:
        n.ready = 0.0
    changes, moves = sweep.forward(rows, answers, gaps)
    flat = [n for row in (*changes, moves) for n in row]
    close("forward sweep", flat)
    for n in flat:
        if isinstance(n, Number):
            n.ready = 0.0
    fresh = sweep.costates(rows, bends, node_weights, slopes, changes, moves)
    close("new costates", [n for row in fresh[1:] for n in row])
    wrong = sweep.check(
        states, gimbals, lambdas, evaluated, node_weights, slopes, inputs, gaps, changes, moves
    )
    return phases, wrong


def report(states, gimbals, peak, measured):
    """Prints the limit and what was measured beside it."""
    phases, wrong = floor(states, gimbals, peak)
    if wrong > 1e-6:
        raise SystemExit(f"the counted sweep computes something else: {wrong:.1e}")
    flops = sum(phase[0] for phase in phases.values())
    by_flops = sum(phase[1] for phase in phases.values())
    limit = sum(max(phase[1], phase[2]) for phase in phases.values())
    print(f"\nfloating-point limit of one sweep, N = {len(gimbals)}; this machine's multiply-adds: {peak[0]:.1f} flop/ns")
    print(f"{'':<40}{'flops':>8}{'at peak us':>12}{'chain us':>10}")
    for name, (count, peak_ns, chain_ns, _) in phases.items():
        print(f"{name:<40}{count:>8}{peak_ns / 1e3:>12.2f}{chain_ns / 1e3:>10.2f}")
    print(f"{'limit, throughput alone':<40}{flops:>8}{by_flops / 1e3:>12.2f}")
    print(f"{'limit, throughput or latency by phase':<40}{'':>8}{limit / 1e3:>12.2f}")
    evaluate, step, iteration = measured
    for name, ns in (
        ("measured: derivatives", evaluate),
        ("measured: Newton step", step),
        ("measured: both", evaluate + step),
        ("measured: whole solve of one iteration", iteration),
    ):
        print(f"{name:<48}{ns / 1e3:>12.2f}    / throughput {ns / by_flops:5.2f}    / limit {ns / limit:5.2f}")
    print(f"(the counted sweep agrees with CasADi's derivatives and a dense solve to {wrong:.0e})")
