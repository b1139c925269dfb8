"""Added mass of a sphere let go in closed boxes against potential flow."""

import numpy as np
from potential import circle_in_square, sphere_in_cube

from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = ("numerics coupling",)
QUICK = ("tight_12", "wide_24", "wide_12_m*", "cylinder_tight_12", "cylinder_wide_24")


def along(run: Run) -> int:
    """Direction of gravity."""
    return int(np.abs(np.array(run.value("fluid", "gravity"))).argmax())


def added_mass(run: Run) -> float:
    """From the acceleration of the run's last row: a = g (1 - s)/(s + Ca)."""
    b = run.bodies
    ratio = run.shapes[b.shape[0]].density / float(run.value("fluid", "liquid_density"))
    acceleration = float(b.velocity[-1, 0, along(run)] / b.time[-1])
    return 9.81 * (1 - ratio) / acceleration - ratio


def check(runs: list[Run], checks: Checks) -> None:
    """Added mass of every run; errors over resolution for each box."""
    exact: dict[tuple[str, float], float] = {}
    studies: dict[tuple[str, float], dict[float, float]] = {}
    for run in runs:
        kind, edge = run.bodies.shape[0], round(float(run.grid.high[0]), 6)
        box = (kind, edge)
        if box not in exact:
            reference = sphere_in_cube if kind == "sphere" else circle_in_square
            exact[box], studies[box] = reference(0.06, edge), {}
        cells = round(0.06 / float(run.grid.spacing[0]), 1)
        coupling = run.value("numerics", "coupling")
        found = added_mass(run)
        name = f"{kind}, box {edge / 0.06:g} diameters wide, {cells:g} cells per diameter"
        band = 0.01 if cells > 20 else 0.02
        gated = coupling == "monolithic" and cells > 10
        name += "" if coupling == "monolithic" else f", coupling '{coupling}'"
        checks.close(f"{name}: added mass / displaced mass", found, exact[box], band, gated)
        velocity = np.abs(run.bodies.velocity[-1, 0])
        sideways = float(np.delete(velocity, along(run)).max() / velocity[along(run)])
        checks.below(f"{name}: sideways speed / speed", sideways, 1e-6, gated)
        if coupling == "monolithic" and cells == round(cells):
            studies[box][cells] = found
    for box, values in studies.items():
        title = f"added mass of a {box[0]}, box {box[1] / 0.06:g} diameters wide"
        checks.study(title, values, exact[box], "cells per diameter")
