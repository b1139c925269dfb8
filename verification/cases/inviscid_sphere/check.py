"""Drag of a sphere in a liquid without viscosity, moved and held: none (d'Alembert)."""

import numpy as np

from micstools.checks import Checks, sound
from micstools.reader import Run

BAND = 0.04  # a tenth of the drag coefficient of a sphere at Reynolds numbers of 1e3 to 1e5
SETTLED = 0.5  # diameters of way after which the start is over


def check(runs: list[Run]) -> Checks:
    """Mean drag coefficient of each run along the stream, and its lift."""
    checks, curves = Checks("sphere without viscosity"), {}
    for run in runs:
        b = run.bodies
        diameter = float(run.value("shape", "size", 1.0))
        density = float(run.value("fluid", "liquid_density", 998.2))
        stream = float(run.value("fluid", "velocity", [0.0] * 3)[2])
        speed = stream - float(b.velocity[-1, 0, 2])
        unit = 0.5 * density * speed**2 * np.pi * diameter**2 / 4
        way = b.time * speed / diameter
        force, step = b.fluid_force[:, 0] / unit, run.series.dt
        late = way > SETTLED
        mean = (force[late] * step[late, None]).sum(axis=0) / step[late].sum()
        courant = float(run.value("run", "cfl_max", 0.5))
        name = f"{'held' if stream else 'moved'}, Courant number {courant:g}"
        checks.below(f"{name}: drag coefficient", float(mean[2]), BAND)
        checks.below(f"{name}: lift coefficient", float(np.abs(mean[:2]).max()), BAND)
        curves[name] = (way[late], force[late, 2])
        sound(run, checks)
    checks.figure("drag", "way / diameter", "coefficient", curves, {"exact": ([0.5, 3], [0, 0])})
    return checks
