"""A box and a sphere on an incline slide, roll or stand."""

from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Bodies, Run

BAND = 0.01
CREEP = 1e-6  # [m/s]
QUICK = ("deg*_mu???", "*_awake", "*_4ms")
VARIES = ("contact friction", "contact wall_friction", "contact sleep", "contact solver")
ROWS = np.loadtxt(Path(__file__).with_name("D5.csv"), delimiter=",", skiprows=2)


def acceleration(b: Bodies, k: int) -> float:
    """Mean acceleration along the slope from 0.3 to 0.6 s."""
    i, j = b.row(0.3), b.row(0.6)
    return float((b.velocity[j, k, 0] - b.velocity[i, k, 0]) / (b.time[j] - b.time[i]))


def check(runs: list[Run], checks: Checks) -> None:
    """Acceleration, or creep, of each."""
    for run in runs:
        b = run.bodies
        g = np.array(run.value("fluid", "gravity"))
        theta = float(np.degrees(np.arctan2(g[0], -g[2])))
        mu = float(run.value("contact", "wall_friction"))
        _, _, block, sphere = next(r for r in ROWS if np.allclose(r[:2], (theta, mu)))
        name = f"{run.folder.name}:"
        if block > 0.0:
            checks.close(f"{name} box [m/s2]", acceleration(b, 0), block, BAND)
        else:
            i, j = b.row(1.0), b.row(2.0)
            way = b.position[j, 0] - b.position[i, 0]
            creep = float(np.linalg.norm(way) / (b.time[j] - b.time[i]))
            checks.below(f"{name} creep of the box [m/s]", creep, CREEP)
            moved = float(np.linalg.norm(b.position[-1, 0] - b.position[0, 0]))
            checks.below(f"{name} way of the box in all [m]", moved, 1e-3)
        checks.close(f"{name} sphere [m/s2]", acceleration(b, 1), sphere, BAND)
