"""Force on a wedge that enters water at constant speed against the similarity solution."""

import csv
import re
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
BAND = 0.2


def similarity() -> dict[int, float]:
    """F/(rho V^3 t) of the whole wedge, per length, by deadrise angle in degrees."""
    lines = (HERE / "similarity.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {round(float(row["deadrise_deg"])): float(row["F_over_rhoV3t"]) for row in rows}


def check(runs: list[Run], checks: Checks) -> None:
    """Mean force coefficient over the second half of the entry."""
    exact = similarity()
    studies: dict[int, dict[float, float]] = {}
    curves, wanted = {}, {}
    for run in runs:
        b = run.bodies
        angle = int(re.findall(r"\d+", str(run.value("shape", "file")))[-1])
        tip = b.position[:, 0, 2] + float(run.shapes["wedge"].points[:, 2].min())
        depth = float(run.value("fluid", "water_level")) - tip
        speed = -float(b.velocity[-1, 0, 2])
        length = float(run.grid.high[1])
        density = float(run.value("fluid", "liquid_density"))
        force = 2 * b.fluid_force[:, 0, 2] / length  # of the whole wedge
        unit = density * speed**2 * depth
        late = depth > 0.5 * depth[-1]
        steps = run.series.dt[late]
        found = float((force[late] * steps).sum() / (unit[late] * steps).sum())
        cells = round(float(depth[-1] / run.grid.spacing[2]))
        name = f"deadrise {angle} deg, {cells} cells per final depth"
        checks.close(f"{name}: F/(rho V^3 t)", found, exact[angle], BAND, cells > 10)
        swing = float(np.std(force[late] / unit[late]) / found)
        checks.below(f"{name}: standard deviation of the force / force", swing, BAND, False)
        studies.setdefault(angle, {})[cells] = found
        wet = depth > 0.1 * depth[-1]
        curves[name] = (1e3 * depth[wet], force[wet] / unit[wet])
        wanted[f"similarity, {angle} deg"] = (1e3 * depth[[0, -1]].clip(0), [exact[angle]] * 2)
    for angle, values in studies.items():
        title = f"deadrise {angle} deg: F/(rho V^3 t)"
        checks.study(title, values, exact[angle], "cells per final depth")
    checks.figure("force", "depth of the tip [mm]", "F/(rho V^3 t)", curves, wanted, smooth=True)
