"""Drag of a sphere held in a stream, against a body-fitted solver in the same box."""

import csv
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
BAND = 0.03
APART = 0.03  # of the drag, moved less held, which in truth are one and the same flow
LATE = 2.0  # diameters of way at the end over which the drag is averaged


def reference() -> dict[int, float]:
    """Drag coefficient in the box by Reynolds number."""
    lines = (HERE / "reference.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {int(row["reynolds"]): float(row["drag"]) for row in rows if row["tank"] == "box"}


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag of the last two diameters of way; in the long box moved against held."""
    known = reference()
    curves: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    drags: dict[int, dict[float, float]] = {}
    long: dict[str, float] = {}
    for run in runs:
        b, diameter = run.bodies, float(run.value("shape", "size"))
        density = float(run.value("fluid", "liquid_density"))
        stream = float(run.value("fluid", "velocity")[2])
        speed = stream - float(b.velocity[-1, 0, 2])
        viscosity = float(run.value("fluid", "liquid_viscosity"))
        reynolds = round(density * speed * diameter / viscosity)
        way, step = b.time * speed / diameter, run.series.dt
        late = way > way[-1] - LATE
        factor = 1 / (0.5 * density * speed**2 * np.pi * diameter**2 / 4)
        force = b.fluid_force[:, 0] * factor
        mean = (force[late] * step[late, None]).sum(axis=0) / step[late].sum()
        cells = round(diameter / float(run.grid.spacing[2]), 1)
        if run.grid.z[-1] > 15 * diameter:
            courant = float(run.value("run", "cfl_max"))
            name = "held" if stream else f"moved, Courant number {courant:g}"
            long[name] = float(mean[2])
        else:
            name = f"Re {reynolds}, {cells:g} cells per diameter"
            drags.setdefault(reynolds, {})[cells] = float(mean[2])
            checks.close(
                f"{name}: drag coefficient", float(mean[2]), known[reynolds], BAND, cells > 11
            )
        checks.below(
            f"{name}: lift over drag", float(np.hypot(mean[0], mean[1]) / mean[2]), 0.01, cells > 11
        )
        curves[name] = (way, force[:, 2])
    for name, drag in long.items():
        if name != "held" and "held" in long:
            checks.close(f"in a long box, {name}: drag as held", drag, long["held"], APART)
    for reynolds, by_cells in sorted(drags.items()):
        checks.study(f"Re {reynolds}: drag", by_cells, known[reynolds], "cells per diameter")
    checks.figure("drag coefficient", "way / diameter", "-", curves)
