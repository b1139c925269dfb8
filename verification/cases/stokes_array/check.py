"""Drag of a simple cubic array of spheres in Stokes flow against the exact series."""

import numpy as np

from measures.balance import faces
from measures.checks import Checks
from measures.facts import liquid, size
from micstools.reading.reader import Run

DRAG_BAND, SCATTER_BAND, BALANCE_BAND = 0.015, 0.01, 1e-3
QUICK = ("cells_12_mid_cell", "cells_12_offset_1")


def drag_factor(share: float) -> float:
    """Drag over 6 pi mu a U of a sphere in a simple cubic array that fills a share of space, U
    the mean velocity over all space: series of Sangani and Acrivos (1982)."""
    k = share ** (1 / 3)
    inverse = 1 - 1.7601 * k + share - 1.5593 * share**2 + 3.9799 * k**8 - 3.0734 * k**10
    return 1 / inverse


def check(runs: list[Run], checks: Checks) -> None:
    """Drag from the mean flow that a given force drives, and from the force on the sphere."""
    same_grid = []
    for run in runs:
        edge, g, diameter = float(run.grid.high[0]), run.value("fluid", "gravity")[0], size(run)
        density, viscosity = liquid(run)
        cells, volume = diameter / float(run.grid.spacing[0]), run.shapes["sphere"].volume
        # Volume flux through every layer of faces across x over the area of the layer [m/s]
        state, periodic = run.restart(), (True, True, True)
        opened = faces(state, "flow/aperture", run.grid, periodic)[0]
        flow = (opened * faces(state, "flow/uf", run.grid, periodic)[0]).mean(axis=(0, 1))
        name = f"{run.folder.name}, {cells:.0f} cells per diameter"
        factor = density * g * edge**3 / (3 * np.pi * viscosity * diameter * flow.mean())
        exact = drag_factor(volume / edge**3)
        checks.close(f"{name}: drag / (6 pi mu a U)", factor, exact, DRAG_BAND, cells > 10)
        force, driven = run.bodies.fluid_force[-1, 0, 0], density * g * (edge**3 - volume)
        checks.close(f"{name}: force on the sphere [N]", force, driven, BALANCE_BAND)
        unequal = np.ptp(flow) / flow.mean()
        checks.below(f"{name}: difference of the flow through layers", unequal, 1e-5)
        if abs(cells - 12) < 0.1:
            same_grid.append(factor)
        if run.folder.name in ("case", f"cells_{cells:02.0f}"):
            found = {round(cells): factor}
            checks.study("drag / (6 pi mu a U)", found, exact, "cells per diameter")
    if len(same_grid) > 1:
        scatter = np.ptp(same_grid) / np.mean(same_grid)
        checks.below(f"scatter over {len(same_grid)} places at 12 cells", scatter, SCATTER_BAND)
