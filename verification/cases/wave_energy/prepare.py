"""Write small standing waves whose level lies at different heights within a row of cells."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import below_surface, write_initial_state
from micstools.shapes.geometry import Array

CELLS, ROWS, LENGTH = (32, 21, 0.3)


def wave(s: Array) -> Array:
    """Height above the level [m]."""
    return 1e-5 * np.cos(4.0 * np.pi * s / LENGTH)


spacing = LENGTH / CELLS
x = spacing * np.arange(CELLS + 1)
z = spacing * np.arange(ROWS + 1)
for part in (0, 2, 50, 98):  # hundredths of a cell
    level = (16.0 + part / 100.0) * spacing
    liquid = below_surface(lambda s, level=level: level + wave(s), x, z)
    write_initial_state(Path(f"level_{part:02d}.h5"), liquid)
