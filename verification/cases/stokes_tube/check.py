"""Speed of a sphere that settles slowly on the axis of a tube against the exact wall factor."""

import csv
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
DRAG_BAND, SCATTER_BAND = 0.015, 0.01


def wall_factor(ratio: float) -> float:
    """Drag over Stokes' drag for sphere over tube = `ratio`: Haberman, Sayre (1958)."""
    lines = (HERE / "wall_factor.csv").read_text().splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        if abs(float(row["lambda"]) - ratio) < 1e-6:
            return float(row["K_cyl_haberman_sayre"])
    raise ValueError(f"no factor for {ratio}")


def check(runs: list[Run], checks: Checks) -> None:
    """Drag factor from the last speed: weight under water over 3 pi mu D U."""
    studies: dict[float, dict[float, float]] = {}
    same: dict[float, list[float]] = {}
    curves = {}
    for run in runs:
        b, sphere, tube = run.bodies, run.shapes["sphere"], run.shapes["tube"]
        diameter = 2 * (3 * sphere.volume / (4 * np.pi)) ** (1 / 3)
        radius = float(np.linalg.norm(tube.points[:, :2], axis=1).min())
        ratio = round(diameter / 2 / radius, 2)
        cells = round(diameter / float(run.grid.spacing[2]), 1)
        density = float(run.value("fluid", "liquid_density"))
        viscosity = float(run.value("fluid", "liquid_viscosity"))
        weight = (sphere.density - density) * sphere.volume * 9.81
        speed = -b.velocity[:, 1, 2]
        late = b.time > 0.8 * b.time[-1]
        factor = weight / (3 * np.pi * viscosity * diameter * float(speed[late].mean()))
        exact, name = (
            wall_factor(ratio),
            f"{run.folder.name}, sphere/tube {ratio:g}, {cells:g} cells",
        )
        checks.close(f"{name}: drag / (3 pi mu D U)", factor, exact, DRAG_BAND, cells > 10)
        uneven = float(np.ptp(speed[late]) / speed[-1])
        checks.below(f"{name}: change of speed in the last fifth", uneven, SCATTER_BAND)
        drift = float(np.abs(b.velocity[late, 1, :2]).max() / speed[-1])
        checks.below(f"{name}: sideways speed / speed", drift, 1e-3)
        if "aside" not in run.folder.name:
            studies.setdefault(ratio, {})[cells] = factor
        if abs(cells - 12) < 0.1:
            same.setdefault(ratio, []).append(factor)
        stokes = weight / (3 * np.pi * viscosity * diameter)
        curves[f"sphere/tube {ratio:g}, {cells:g} cells"] = (
            b.time * viscosity / density / radius**2,
            speed * exact / stokes,
        )
    for ratio, found in same.items():
        if len(found) > 1:
            scatter = (max(found) - min(found)) / float(np.mean(found))
            checks.below(f"sphere/tube {ratio:g}: scatter over places", scatter, SCATTER_BAND)
    for ratio, values in studies.items():
        title = f"sphere/tube {ratio:g}: drag / (3 pi mu D U)"
        checks.study(title, values, wall_factor(ratio), "cells per diameter")
    checks.figure("speed over the exact one", "t nu/R^2", "-", curves)
