"""Lengths, times and weights of the blocks of a run: every limit is measured by them."""

import numpy as np

from micstools.reading.reader import Run

REACH = 1 / 120
"""Blocks nearer than this part of the smallest block's length touch (0.5 mm of 60 mm)."""


def smallest(run: Run) -> float:
    """Length of the smallest block [m]."""
    return min(run.shapes[name].length for name in set(run.bodies.shape))


def reach(run: Run) -> float:
    """Blocks, walls and bed nearer to each other than this touch [m]."""
    return REACH * smallest(run) if run.bodies.n else 0.0


def weight(run: Run) -> float:
    """Weight of the lightest block in air [N]; zero without gravity."""
    return float(run.bodies.mass.min() * np.linalg.norm(run.gravity))
