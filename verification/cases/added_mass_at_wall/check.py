"""Added mass of blocks that touch a wall, along its normal."""

from measures.checks import Checks
from measures.facts import added_mass
from micstools.reading.reader import Run

QUICK = ("cells_08", "hexapod_*")
TOUCHING = 0.803  # of the displaced mass: a sphere, Lamb, Hydrodynamics, art. 98
"""As `src/coupling/added_mass.f90` takes it for every shape."""


def check(runs: list[Run], checks: Checks) -> None:
    """The sphere against potential flow; of the others how far they are from a sphere."""
    for run in runs:
        shape, found, cells = run.bodies.shape[0], added_mass(run), 0.06 / run.grid.spacing[0]
        sphere = shape == "sphere"
        name = f"{shape}, {cells:g} cells per 60 mm: added mass / displaced mass"
        checks.close(name, found, TOUCHING, 0.02 if sphere else 0.25, sphere)
        if sphere:
            title = "added mass of a sphere at a wall"
            checks.study(title, {round(float(cells), 1): found}, TOUCHING, "cells per diameter")
