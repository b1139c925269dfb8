"""A cube falling on the axis of a square tank does not spin, wherever its faces lie in the grid."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = ("contact contact_time",)  # of one run
SPIN = 1e-3  # rad/s
SIDEWAYS = 1e-4  # of the speed


def check(runs: list[Run], checks: Checks) -> None:
    """Largest spin and speed sideways of each run."""
    for run in runs:
        b = run.bodies
        spin = float(np.linalg.norm(b.angular_velocity[:, 0], axis=1).max())
        checks.below(f"{run.folder.name}: largest spin [rad/s]", spin, SPIN)
        sideways = float(np.abs(b.velocity[:, 0, :2]).max() / abs(b.velocity[-1, 0, 2]))
        checks.below(f"{run.folder.name}: speed sideways over that of the fall", sideways, SIDEWAYS)
