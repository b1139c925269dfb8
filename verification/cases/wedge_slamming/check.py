"""Force on a wedge that enters water at constant speed against the similarity solution."""

import re

import numpy as np

from measures.checks import Checks
from measures.facts import liquid, table
from micstools.reading.reader import Run

BAND = 0.2
QUICK = ()  # its figures count from 11 cells on


def check(runs: list[Run], checks: Checks) -> None:
    """Mean force coefficient of the whole wedge over the second half of the entry."""
    known = table(__file__, "similarity.csv").set_index("deadrise_deg").F_over_rhoV3t
    for run in runs:
        b, said = run.bodies, "F/(rho V^3 t)"
        angle = int(re.findall(r"\d+", run.value("shape", "file"))[-1])
        tip = b.position[:, 0, 2] + run.shapes["wedge"].points[:, 2].min()
        depth = run.value("fluid", "water_level") - tip
        force = 2 * b.fluid_force[:, 0, 2] / run.grid.high[1]  # per length
        unit = liquid(run)[0] * b.velocity[-1, 0, 2] ** 2 * depth
        late, exact = depth > 0.5 * depth[-1], known[angle]
        steps = run.series.dt[late]
        found = (force[late] * steps).sum() / (unit[late] * steps).sum()
        cells = round(float(depth[-1] / run.grid.spacing[2]))
        name = f"deadrise {angle} deg, {cells} cells per final depth"
        checks.close(f"{name}: {said}", found, exact, BAND, cells > 10)
        swing = np.std(force[late] / unit[late]) / found
        checks.below(f"{name}: standard deviation of the force / force", swing, BAND, False)
        title = f"deadrise {angle} deg: {said}"
        checks.study(title, {cells: found}, exact, "cells per final depth")
        wet, ends = depth > 0.1 * depth[-1], 1e3 * depth[[0, -1]].clip(0)
        ours = {name: (1e3 * depth[wet], force[wet] / unit[wet])}
        wanted = {f"similarity, {angle} deg": (ends, [exact] * 2)}
        checks.figure("force", "depth of the tip [mm]", said, ours, wanted, smooth=True)
