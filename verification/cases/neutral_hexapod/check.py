"""A block as heavy as the water around it stays."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

BAND = 1e-6  # of the speed that free fall would give in the same time


def check(runs: list[Run], checks: Checks) -> None:
    """Largest speed and turning of the block at any row."""
    for run in runs:
        b = run.bodies
        free_fall = 9.81 * float(b.time[-1])
        size = run.shapes[b.shape[0]].radius
        speed = float(np.linalg.norm(b.velocity[:, 0], axis=1).max())
        turning = float(np.linalg.norm(b.angular_velocity[:, 0], axis=1).max())
        checks.below("speed / that of free fall", speed / free_fall, BAND)
        checks.below("speed of the rim by turning / that", turning * size / free_fall, BAND)
