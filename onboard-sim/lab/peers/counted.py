"""Numbers that count the arithmetic done with them, and when the earliest of it could be done.

A plain 0 or 1 is structure, known beforehand: adding nothing or multiplying by one costs nothing.
"""

import collections
import math


class Count:
    """Operations by name, and the latency of each, ns."""

    def __init__(self, latency_ns):
        self.operations = collections.Counter()
        self.latency_ns = latency_ns

    def take(self):
        """What was counted since the last call."""
        counted, self.operations = self.operations, collections.Counter()
        return counted


class Number:
    """A value and the time at which it is known if nothing but latency delays it, ns."""

    __slots__ = ("value", "ready", "count")

    def __init__(self, value, count, ready=0.0):
        self.value, self.count, self.ready = float(value), count, ready

    def _result(self, value, name, other):
        self.count.operations[name] += 1
        ready = max(self.ready, other.ready if isinstance(other, Number) else 0.0)
        return Number(value, self.count, ready + self.count.latency_ns[name])

    def __add__(self, other):
        if _is(other, 0):
            return self
        return self._result(self.value + float(other), "add", other)

    __radd__ = __add__

    def __sub__(self, other):
        if _is(other, 0):
            return self
        return self._result(self.value - float(other), "add", other)

    def __rsub__(self, other):
        if _is(other, 0):
            return -self
        return self._result(float(other) - self.value, "add", other)

    def __neg__(self):
        return Number(-self.value, self.count, self.ready)  # a sign is folded into what uses it

    def __mul__(self, other):
        if _is(other, 0):
            return 0
        if _is(other, 1):
            return self
        return self._result(self.value * float(other), "multiply", other)

    __rmul__ = __mul__

    def __truediv__(self, other):
        return self._result(self.value / float(other), "divide", other)

    def __rtruediv__(self, other):
        return self._result(float(other) / self.value, "divide", other)

    def __float__(self):
        return self.value


def _is(other, structure):
    return isinstance(other, int) and other == structure


def root(number):
    """Square root."""
    return number._result(math.sqrt(number.value), "root", number)


# Additions and multiplications of a sine and cosine together to double precision: reduction by a pi/2 of three parts
# (5 and 4), square and fourth power (0 and 2), two polynomials of six coefficients in pairs (5 and 5 each), and their
# ends (1 and 2, 2 and 2). On the longest path: 9 additions and 9 multiplications.
SINE_COSINE = {"add": 5 + 2 * 5 + 1 + 2, "multiply": 4 + 2 + 2 * 5 + 2 + 2}
SINE_COSINE_DEPTH = 9


def sine_cosine(number):
    """Sine and cosine."""
    count = number.count
    count.operations.update(SINE_COSINE)
    ready = number.ready + SINE_COSINE_DEPTH * (count.latency_ns["add"] + count.latency_ns["multiply"])
    return Number(math.sin(number.value), count, ready), Number(math.cos(number.value), count, ready)
