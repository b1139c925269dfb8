"""Drag of a sphere held in a stream, against a body-fitted solver in the same box."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, size, table
from micstools.reading.reader import Run

DRAG = table(__file__, "reference.csv").query("tank == 'box'").set_index("reynolds").drag
"""Drag coefficient in the box by Reynolds number."""
BAND = 0.03
APART = 0.03  # of the drag, moved less held, which in truth are one and the same flow
LATE = 2.0  # diameters of way at the end over which the drag is averaged


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag of the last two diameters of way; in the long box moved against held."""
    long: dict[str, float] = {}
    for run in runs:
        b, diameter, (density, viscosity) = run.bodies, size(run), liquid(run)
        stream = run.value("fluid", "velocity")[2]
        speed = stream - b.velocity[-1, 0, 2]
        reynolds = round(density * speed * diameter / viscosity)
        way = b.time * speed / diameter
        late = way > way[-1] - LATE
        force = b.fluid_force[:, 0] / (0.5 * density * speed**2 * np.pi * diameter**2 / 4)
        mean = np.average(force[late], axis=0, weights=run.series.dt[late])
        cells = cells_along(run, diameter)
        if run.grid.z[-1] > 15 * diameter:
            courant = run.value("run", "cfl_max")
            name = "held" if stream else f"moved, Courant number {courant:g}"
            long[name] = mean[2]
        else:
            name, exact = f"Re {reynolds}, {cells:g} cells per diameter", DRAG[reynolds]
            checks.study(f"Re {reynolds}: drag", {cells: mean[2]}, exact, "cells per diameter")
            checks.close(f"{name}: drag coefficient", mean[2], exact, BAND, cells > 11)
        lift = np.hypot(mean[0], mean[1]) / mean[2]
        checks.below(f"{name}: lift over drag", lift, 0.01, cells > 11)
        checks.figure("drag coefficient", "way / diameter", "-", {name: (way, force[:, 2])})
    for name, drag in long.items():
        if name != "held" and "held" in long:
            checks.close(f"in a long box, {name}: drag as held", drag, long["held"], APART)
