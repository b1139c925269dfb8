"""Added mass of blocks that touch a wall, along its normal."""

from measures.checks import Checks
from micstools.reading.reader import Run

QUICK = ("cells_08", "hexapod_*")
TOUCHING = 0.803  # of the displaced mass: a sphere, Lamb, Hydrodynamics, art. 98
"""As `src/coupling/added_mass.f90` takes it for every shape."""


def added_mass(run: Run) -> float:
    """From the acceleration of the run's last row: a = g (1 - s)/(s + Ca)."""
    b = run.bodies
    ratio = run.shapes[b.shape[0]].density / float(run.value("fluid", "liquid_density"))
    return 9.81 * (1 - ratio) / float(b.velocity[-1, 0, 2] / b.time[-1]) - ratio


def check(runs: list[Run], checks: Checks) -> None:
    """The sphere against potential flow; of the others how far they are from a sphere."""
    spheres: dict[float, float] = {}
    for run in runs:
        shape, found = run.bodies.shape[0], added_mass(run)
        sphere = shape == "sphere"
        if sphere:
            spheres[round(0.06 / float(run.grid.spacing[0]), 1)] = found
        cells = f"{0.06 / float(run.grid.spacing[0]):g} cells per 60 mm"
        band = 0.02 if sphere else 0.25
        checks.close(
            f"{shape}, {cells}: added mass / displaced mass", found, TOUCHING, band, sphere
        )
    checks.study("added mass of a sphere at a wall", spheres, TOUCHING, "cells per diameter")
