"""A box and a sphere on an incline slide, roll or stand."""

import numpy as np

from measures.checks import Checks
from measures.facts import acceleration, creep, table
from micstools.reading.reader import Run

BAND = 0.01
CREEP = 1e-6  # [m/s]
QUICK = ("deg*_mu???", "*_4ms")
VARIES = ("contact friction", "contact wall_friction", "contact sleep")
ROWS = table(__file__, "D5.csv").to_numpy()


def check(runs: list[Run], checks: Checks) -> None:
    """Acceleration, or creep, of each."""
    for run in runs:
        b, g, mu = run.bodies, run.gravity, run.value("contact", "wall_friction")
        theta = np.degrees(np.arctan2(g[0], -g[2]))
        _, _, block, sphere = next(r for r in ROWS if np.allclose(r[:2], (theta, mu)))
        name, (box_ours, sphere_ours) = f"{run.folder.name}:", acceleration(b)[:, 0]
        if block > 0.0:
            checks.close(f"{name} box [m/s2]", box_ours, block, BAND)
        else:
            checks.below(f"{name} creep of the box [m/s]", creep(b, 0), CREEP)
            moved = np.linalg.norm(b.position[-1, 0] - b.position[0, 0])
            checks.below(f"{name} way of the box in all [m]", moved, 1e-3)
        checks.close(f"{name} sphere [m/s2]", sphere_ours, sphere, BAND)
