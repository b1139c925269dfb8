"""Acceleration of a sphere let go in still water against potential theory for the box.

usage: python check.py RUN [RUN ...]; runs that differ in dt only are compared with one another
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.checks import Checks, main, sound  # noqa: E402
from micstools.reader import Run  # noqa: E402

VARIES = ("numerics momentum", "numerics solid_fraction", "numerics pressure_solver")  # of one run
THEORY_BAND, STEP_BAND = 0.02, 0.01


def image_sum(reach: int) -> float:
    """Sum over the mirror images of an upright dipole in a box of unit edge: (3 z^2 - r^2)/r^5.

    The images stand on a lattice; mirrors above and below turn the dipole round. Two successive
    reaches lie on either side of the limit, so their mean is taken.
    """

    def up_to(n: int) -> float:
        k = np.arange(-n, n + 1)
        x, y, z = np.meshgrid(k, k, k, indexing="ij")
        r2 = x * x + y * y + z * z
        r2[n, n, n] = 1
        term = np.where(z % 2 == 0, 1, -1) * (3 * z * z - r2) / r2**2.5
        term[n, n, n] = 0.0
        return float(term.sum())

    return (up_to(reach) + up_to(reach + 1)) / 2


def added_mass(diameter: float, box: float) -> float:
    """Added mass of a sphere in the middle of a cubic box over the mass of fluid it displaces."""
    stream = image_sum(40) * (diameter / 2 / box) ** 3 / 2
    return 1.5 / (1 + stream) - 1


def acceleration(run: Run) -> float:
    """Mean vertical acceleration over the run [m/s2]."""
    b = run.bodies
    return float((b.velocity[-1, 0, 2] - b.velocity[0, 0, 2]) / (b.time[-1] - b.time[0]))


def check(runs: list[Run]) -> Checks:
    """Each run against theory, and the heavy ones against the one with the shortest step."""
    checks = Checks("released sphere")
    box = float((runs[0].grid.high - runs[0].grid.low)[2])
    by_ratio: dict[float, list[Run]] = {}
    for run in runs:
        shape = run.shapes[run.bodies.shape[0]]
        fluid = float(run.value("fluid", "liquid_density", 998.2))
        g = float(run.value("fluid", "gravity", [0.0, 0.0, -9.81])[2])
        ratio = shape.density / fluid
        diameter = 2 * (3 * shape.volume / (4 * np.pi)) ** (1 / 3)
        theory = (ratio - 1) / (ratio + added_mass(diameter, box))
        name = f"{run.folder.name}: s = {ratio:.3g}, dt = {run.value('run', 'dt', 1e-2):.2g} s"
        checks.close(f"{name}, a/g", acceleration(run) / g, theory, THEORY_BAND)
        sideways = float(np.abs(run.bodies.velocity[-1, 0, :2]).max())
        along = abs(float(run.bodies.velocity[-1, 0, 2]))
        checks.below(f"{name}, sideways speed / speed", sideways / along, 1e-6)
        sound(run, checks)
        by_ratio.setdefault(round(ratio, 6), []).append(run)
    for same in by_ratio.values():
        finest = min(same, key=lambda run: float(run.value("run", "dt", 1e-2)))
        for run in same:
            if run is not finest:
                name = f"{run.folder.name}: a against {finest.folder.name} [m/s2]"
                checks.close(name, acceleration(run), acceleration(finest), STEP_BAND)
    return checks


if __name__ == "__main__":
    main(check)
