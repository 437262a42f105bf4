"""What tables are made of."""

import numpy as np

# An answer that costs more than the cheapest found by this share and this much is another, dearer landing.
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


def shown(failed, worse=0):
    words = [f"{failed} fail"] if failed else []
    words += [f"{worse} dearer"] if worse else []
    return ("; " + ", ".join(words)) if words else ""
