"""Speed of a sphere that settles slowly on the axis of a tube against the exact wall factor."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, table
from micstools.reading.reader import Run

DRAG_BAND, SCATTER_BAND = 0.015, 0.01


def check(runs: list[Run], checks: Checks) -> None:
    """Drag factor from the last speed, weight under water over 3 pi mu D U, over Stokes' drag: the
    factor for sphere over tube of Haberman, Sayre (1958)."""
    known = table(__file__, "wall_factor.csv").set_index("lambda").K_cyl_haberman_sayre
    same: dict[float, list[float]] = {}
    for run in runs:
        b, sphere, tube = run.bodies, run.shapes["sphere"], run.shapes["tube"]
        diameter = 2 * (3 * sphere.volume / (4 * np.pi)) ** (1 / 3)
        density, viscosity = liquid(run)
        radius = np.linalg.norm(tube.points[:, :2], axis=1).min()
        ratio, cells = round(float(diameter / 2 / radius), 2), cells_along(run, diameter)
        weight = (sphere.density - density) * sphere.volume * 9.81
        stokes = weight / (3 * np.pi * viscosity * diameter)
        speed, late, exact = -b.velocity[:, 1, 2], b.time > 0.8 * b.time[-1], known[ratio]
        factor, said = stokes / speed[late].mean(), f"sphere/tube {ratio:g}, {cells:g} cells"
        name = f"{run.folder.name}, {said}"
        checks.close(f"{name}: drag / (3 pi mu D U)", factor, exact, DRAG_BAND, cells > 10)
        uneven = np.ptp(speed[late]) / speed[-1]
        checks.below(f"{name}: change of speed in the last fifth", uneven, SCATTER_BAND)
        drift = np.abs(b.velocity[late, 1, :2]).max() / speed[-1]
        checks.below(f"{name}: sideways speed / speed", drift, 1e-3)
        if "aside" not in run.folder.name:
            title = f"sphere/tube {ratio:g}: drag / (3 pi mu D U)"
            checks.study(title, {cells: factor}, exact, "cells per diameter")
        if abs(cells - 12) < 0.1:
            same.setdefault(ratio, []).append(factor)
        curves = {said: (b.time * viscosity / density / radius**2, speed * exact / stokes)}
        checks.figure("speed over the exact one", "t nu/R^2", "-", curves)
    for ratio, found in same.items():
        if len(found) > 1:
            scatter = np.ptp(found) / np.mean(found)
            checks.below(f"sphere/tube {ratio:g}: scatter over places", scatter, SCATTER_BAND)
