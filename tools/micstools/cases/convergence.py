"""Observed order of a number on several grids, and an estimate of its error on the finest.

Source: P. J. Roache, Verification and validation in computational science and engineering (1998),
chapter 5, for grids whose ratios may differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_ORDERS = (0.05, 12.0)  # between which an order is looked for
_EQUAL = 1e-12  # of the largest value: what rounding leaves between equal numbers


@dataclass(frozen=True)
class Convergence:
    """What the values on the grids tell; nan where they tell nothing."""

    order: float  # observed on the three finest grids
    limit: float  # the value on endlessly fine cells
    error: float  # of the value on the finest grid: value - limit
    words: str  # why there is no order, or none is needed; empty where there is one
    range: float = float("nan")  # of the values on the three finest grids, where no order is found


def converge(fineness: Sequence[float], values: Sequence[float]) -> Convergence:
    """From values on rising `fineness`, cells per length: v = limit + c fineness^-order."""
    if len(values) > 1 and _equal(values):
        return _converged("all grids", values[-1])
    if len(values) < 3:
        return _nothing("three grids are needed")
    f, (a, b, c) = [float(v) for v in fineness[-3:]], values[-3:]
    if not np.isfinite([a, b, c]).all():
        return _nothing("not known on all grids")
    if _equal([b, c]):
        return _converged("the two finest grids", c)
    if (a - b) * (b - c) <= 0:
        return _nothing("not monotone", float(np.ptp([a, b, c])))
    order = _order(f, (a - b) / (b - c))
    if order != order:
        return _nothing("no order fits", float(np.ptp([a, b, c])))
    steps = [value**-order for value in f]
    error = (b - c) * steps[2] / (steps[1] - steps[2])
    return Convergence(order, c - error, error, "")


def _equal(values: Sequence[float]) -> bool:
    """Are all values one but for rounding? Unknown ones are not."""
    return bool(np.ptp(values) <= _EQUAL * np.abs(values).max())


def _converged(grids: str, value: float) -> Convergence:
    return Convergence(float("nan"), value, 0.0, f"converged: equal on {grids}")


def _nothing(words: str, spread: float = float("nan")) -> Convergence:
    return Convergence(float("nan"), float("nan"), float("nan"), words, spread)


def _order(f: list[float], ratio: float) -> float:
    """The order at which differences of the three values have a ratio, by halving."""

    def excess(order: float) -> float:
        a, b, c = (float(value**-order) for value in f)
        return (a - b) / (b - c) - ratio

    low, high = _ORDERS
    if excess(low) * excess(high) > 0:
        return float("nan")
    for _ in range(80):
        middle = (low + high) / 2
        if excess(low) * excess(middle) <= 0:
            high = middle
        else:
            low = middle
    return (low + high) / 2
