"""Speed of a sphere that settles with a wake against spectral-element results."""

import csv
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
BANDS = {8: 0.05, 12: 0.03, 15: 0.02}  # of the speed, by least cells per diameter


def band(cells: float) -> float:
    """The band of a grid."""
    return min(
        [band for least, band in BANDS.items() if cells >= least], default=max(BANDS.values())
    )


def reference() -> dict[str, float]:
    """Vertical speed over sqrt((s - 1) g D) by run of the source."""
    lines = (HERE / "reference.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {row["run"]: float(row["u_vertical_over_uref"]) for row in rows}


def check(runs: list[Run], checks: Checks) -> None:
    """Speed against the inflow at the end of each run."""
    known, speeds = reference(), {}
    exact, curves = known["in_the_box"], {}
    for run in runs:
        b, sphere = run.bodies, run.shapes["sphere"]
        diameter = float(run.value("shape", "size"))
        density = float(run.value("fluid", "liquid_density"))
        viscosity = float(run.value("fluid", "liquid_viscosity")) / density
        unit = float(np.sqrt((sphere.density / density - 1) * 9.81 * diameter))
        stream = float(run.value("boundary", "z_min_velocity")[2])
        speed = (stream - b.velocity[:, 0, 2]) / unit
        cells = round(diameter / float(run.grid.spacing[2]), 1)
        name = f"{cells:g} cells per diameter"
        checks.close(f"{name}: Galileo number", unit * diameter / viscosity, 144.0, 1e-3)
        late = b.time > 0.9 * b.time[-1]
        before = (b.time > 0.8 * b.time[-1]) & ~late
        speeds[cells] = float(speed[late].mean())
        checks.close(f"{name}: speed / sqrt((s - 1) g D)", speeds[cells], exact, band(cells))
        drift = float(speed[before].mean()) / speeds[cells] - 1
        checks.below(f"{name}: change of speed over the last two tenths", drift, 0.005)
        ripple = float(np.ptp(speed[late])) / speeds[cells]
        checks.below(f"{name}: ripple of the speed in the last tenth", ripple, 0.01)
        tilted = float(np.abs(b.velocity[late, 0, :2]).max() / unit)
        checks.below(f"{name}: sideways speed", tilted, 0.01)
        curves[name] = (b.time * unit / diameter, speed)
    checks.study("speed / sqrt((s - 1) g D)", speeds, exact, "cells per diameter")
    ends = [0.0, max((float(t[-1]) for t, _ in curves.values()), default=1.0)]
    wanted = {"spectral elements, in this box": (ends, [exact] * 2)}
    checks.figure("speed", "t sqrt((s - 1) g/D)", "-", curves, wanted, smooth=True)
