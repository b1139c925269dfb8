"""Restitution of a ball under water against that asked for, and how it depends on the step."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = ("contact restitution",)
QUICK = ("case", "step_1", "cells_12")
BAND = 0.05
MOVED = 1.27  # what the ball moves with over its mass
LATER = 3.0e-3  # s after the contact
DIAMETER, COARSE = 0.02, 8  # m; cells along it, of the runs with different steps


def restitution(run: Run) -> float:
    """Speed shortly after the touch over the speed before."""
    b = run.bodies
    speed = b.velocity[:, 0, 2]
    touching = np.flatnonzero(b.contacts[:, 0] > 0)
    after = float(np.interp(b.time[touching[-1]] + LATER, b.time, speed))
    return -after / float(speed[touching[0] - 1])


def check(runs: list[Run], checks: Checks) -> None:
    """Every step must give the restitution."""
    found = []
    for run in runs:
        wanted, value = run.value("contact", "restitution") ** (1 / MOVED**0.5), restitution(run)
        share = run.value("run", "dt") / run.value("contact", "contact_time")
        cells = round(DIAMETER / float(run.grid.spacing[0]))
        name = f"step {share:g} contact times, {cells} cells per diameter: restitution"
        checks.close(name, value, wanted, BAND)
        if cells == COARSE:
            found.append((share, value))
    if found:
        steps, values = zip(*sorted(found), strict=True)
        curves = {"ours": (steps, values)}, {"asked for": ([0.0, max(steps)], [wanted] * 2)}
        checks.figure("restitution under water", "step / contact time", "-", *curves, smooth=True)
