"""Added mass of a sphere let go in closed boxes against potential flow."""

import numpy as np
from potential import sphere_in_cube

from micstools.checks import Checks, sound
from micstools.reader import Run

VARIES = ("numerics coupling",)


def added_mass(run: Run) -> float:
    """From the acceleration of the run's last row: a = g (1 - s)/(s + Ca)."""
    b = run.bodies
    ratio = run.shapes[b.shape[0]].density / float(run.value("fluid", "liquid_density", 998.2))
    acceleration = float(b.velocity[-1, 0, 2] / b.time[-1])
    return 9.81 * (1 - ratio) / acceleration - ratio


def check(runs: list[Run]) -> Checks:
    """Added mass of every run; errors over resolution for each box."""
    checks = Checks("added mass")
    edges = {round(float(run.grid.high[2]), 6) for run in runs}
    exact = {edge: sphere_in_cube(0.06, edge) for edge in edges}
    studies: dict[float, dict[float, float]] = {edge: {} for edge in exact}
    for run in runs:
        edge = round(float(run.grid.high[2]), 6)
        cells = round(0.06 / float(run.grid.spacing[0]), 1)
        coupling = str(run.value("numerics", "coupling", "monolithic")).strip()
        found = added_mass(run)
        name = f"box {edge / 0.06:g} diameters wide, {cells:g} cells per diameter"
        band = 0.01 if cells > 20 else 0.02
        gated = coupling == "monolithic" and cells > 10
        name += "" if coupling == "monolithic" else f", coupling '{coupling}'"
        checks.close(f"{name}: added mass / displaced mass", found, exact[edge], band, gated)
        sideways = float(np.abs(run.bodies.velocity[-1, 0, :2]).max())
        along = abs(float(run.bodies.velocity[-1, 0, 2]))
        checks.below(f"{name}: sideways speed / speed", sideways / along, 1e-6, gated)
        if coupling == "monolithic" and cells == round(cells):
            studies[edge][cells] = found
        sound(run, checks)
    for edge, values in studies.items():
        title = f"added mass, box {edge / 0.06:g} diameters wide"
        checks.study(title, values, exact[edge], "cells per diameter")
    return checks
