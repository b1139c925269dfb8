"""Terminal speed of cubes and hexapods against the correlation of Haider and Levenspiel (1989)."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, size
from micstools.reading.reader import Run

QUICK = ()  # its figures compare with finer cells
BAND = 0.1
SPHERICITY = {"cube": (np.pi / 6) ** (1 / 3), "hexapod": 0.589877}


def drag_coefficient(reynolds: float, f: float) -> float:
    """Of a block with sphericity f, on the sphere of the same volume."""
    a = np.exp(2.3288 - 6.4581 * f + 2.4486 * f**2)
    b = 0.0964 + 0.5565 * f
    c = np.exp(4.905 - 13.8944 * f + 18.4222 * f**2 - 10.2599 * f**3)
    d = np.exp(1.4681 + 12.2584 * f - 20.7322 * f**2 + 15.8855 * f**3)
    return float(24 / reynolds * (1 + a * reynolds**b) + c / (1 + d / reynolds))


def check(runs: list[Run], checks: Checks) -> None:
    """Drag coefficient at the mean speed of the second half of each run."""
    for run in runs:
        b, block, (density, viscosity) = run.bodies, run.shapes["block"], liquid(run)
        case = (run.folder.name.rpartition("_")[0] or "Re100").replace("_", " ")
        diameter = (6 * block.volume / np.pi) ** (1 / 3)
        speed = run.value("boundary", "z_min_velocity")[2] - b.velocity[:, 0, 2]
        late = b.time > 0.5 * b.time[-1]
        mean = np.average(speed[late], weights=run.series.dt[late])
        cells = cells_along(run, size(run))
        cd = 4 / 3 * (block.density / density - 1) * 9.81 * diameter / mean**2
        reynolds = mean * diameter * density / viscosity
        exact = drag_coefficient(reynolds, SPHERICITY[run.value("shape", "kind")])
        name = f"{case}, {cells:g} cells per edge, Re = {reynolds:.4g}: drag coefficient"
        checks.close(name, cd, exact, BAND, reynolds < 500 and cells > 7)
        checks.study(f"{case}: drag coefficient", {cells: cd}, resolution="cells per edge")
        curves = {f"{case}, {cells:g} cells": (b.time * mean / diameter, speed / mean)}
        checks.figure("speed over its mean", "t U/de", "-", curves)
