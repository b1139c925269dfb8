"""A hexapod on one, two and three legs stands as high as its shape says."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, rotation_matrix

EDGE = 20.0  # of a cube [mm]
HEIGHTS = (1.5 * EDGE, np.sqrt(2.0) * EDGE, 2.5 / np.sqrt(3.0) * EDGE)
LEGS = ((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 1.0))
"""What points up or down, in body axes, on one, two and three legs (signs do not matter)."""
BAND = 0.1  # [mm]
TILT = 0.2  # [degrees]
REST = 1e-4  # [m/s]
VARIES = ("contact model", "contact solver", "shape spheres")


def tilt(q: Array, legs: tuple[float, float, float]) -> float:
    """Angle between the vertical and the nearest direction (+-1, ..) of that kind [degrees]."""
    up = rotation_matrix(q)[2]  # in body axes
    ours, ideal = np.sort(np.abs(up)), np.sort(np.array(legs)) / np.linalg.norm(legs)
    return float(np.degrees(2.0 * np.arcsin(min(1.0, np.linalg.norm(ours - ideal) / 2.0))))


def check(runs: list[Run], checks: Checks) -> None:
    """Height, tilt and speed at the end."""
    for run in runs:
        b, name = run.bodies, run.folder.name
        counts = run.value("contact", "model") == "surface"
        for k, (height, legs) in enumerate(zip(HEIGHTS, LEGS, strict=True)):
            on = f"{name}, {k + 1} leg{'s' if k else ''}:"
            ours = 1e3 * b.position[-1, k, 2]
            checks.within(f"{on} height [mm]", ours, height - BAND, height + BAND, counts)
            checks.below(f"{on} tilt [deg]", tilt(b.quaternion[-1, k], legs), TILT, counts)
            speed = np.linalg.norm(b.velocity[-1, k])
            checks.below(f"{on} speed at the end [m/s]", speed, REST, counts)
