"""Values of a field along a line, and reference profiles from CSV files."""

import csv
from pathlib import Path

import numpy as np

from micstools.geometry import Array


def cubic(at: Array, x: Array, values: Array) -> Array:
    """Values at the places `at` (n) from those at `x` (m), the last axis of `values` (..., m), by
    the cubic through the four nearest points; m >= 4."""
    result = np.zeros((*values.shape[:-1], at.size))
    first = np.clip(np.searchsorted(x, at) - 2, 0, x.size - 4)
    for point in range(4):
        weight = np.ones(at.size)
        for other in range(4):
            if other != point:
                weight *= (at - x[first + other]) / (x[first + point] - x[first + other])
        result += weight * values[..., first + point]
    return result


def with_ends(low: float, values: Array, high: float) -> Array:
    """Values at cell centres along the last axis with those on the two walls around them."""
    ends = [np.full((*values.shape[:-1], 1), value) for value in (low, high)]
    return np.concatenate([ends[0], values, ends[1]], axis=-1)


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file whose first lines, with a #, name the source."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))
