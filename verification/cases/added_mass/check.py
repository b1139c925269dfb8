"""Added mass of a sphere let go in closed boxes against potential flow."""

from functools import cache

import numpy as np

from measures.checks import Checks
from measures.facts import added_mass
from measures.potential import circle_in_square, sphere_in_cube
from micstools.reading.reader import Run

VARIES = ("numerics coupling",)
QUICK = ("tight_12", "wide_24", "wide_12_m*", "cylinder_tight_12", "cylinder_wide_24")
EXACT = {"sphere": cache(sphere_in_cube), "cylinder": cache(circle_in_square)}


def check(runs: list[Run], checks: Checks) -> None:
    """Added mass of every run; errors over resolution for each box."""
    for run in runs:
        kind, edge = run.bodies.shape[0], round(float(run.grid.high[0]), 6)
        along = int(np.abs(run.gravity).argmax())
        exact, found = EXACT[kind](0.06, edge), added_mass(run, along)
        cells = round(0.06 / float(run.grid.spacing[0]), 1)
        coupling = run.value("numerics", "coupling")
        monolithic = coupling == "monolithic"
        name = f"{kind}, box {edge / 0.06:g} diameters wide, {cells:g} cells per diameter"
        name += "" if monolithic else f", coupling '{coupling}'"
        gated = monolithic and cells > 10
        band = 0.01 if cells > 20 else 0.02
        checks.close(f"{name}: added mass / displaced mass", found, exact, band, gated)
        velocity = np.abs(run.bodies.velocity[-1, 0])
        sideways = np.delete(velocity, along).max() / velocity[along]
        checks.below(f"{name}: sideways speed / speed", sideways, 1e-6, gated)
        if monolithic and cells == round(cells):
            title = f"added mass of a {kind}, box {edge / 0.06:g} diameters wide"
            checks.study(title, {cells: found}, exact, "cells per diameter")
