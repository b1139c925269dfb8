"""Waves and currents leave through an outflow: what comes back, and the level they leave behind."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

REFLECTED = {"long": 0.10, "medium": 0.20, "short": 0.35}  # of the incident height, see README
LEVEL, SPEED = 0.1213, 0.2


def depths(run: Run, t: float) -> Array:
    """Depth of the water over x [m]."""
    column: Array = run.grid.spacing[2] * run.fields_at(t).liquid.sum(axis=0)[0]
    return column


def waves(run: Run, reference: Run, checks: Checks) -> None:
    """Difference from the tank that goes on, over the height of the waves that reach the side."""
    n = run.grid.x.size - 1
    incident, worst = 0.0, 0.0
    for t in run.field_times:
        undisturbed = depths(reference, t)
        worst = max(worst, float(np.abs(depths(run, t) - undisturbed[:n]).max()))
        level = float(run.value("fluid", "water_level"))
        incident = max(incident, float(abs(undisturbed[n - 1] - level)))
    name = run.folder.name
    checks.below(f"{name} waves: part that comes back", worst / incident, REFLECTED[name])
    t = float(run.field_times[-1])
    x = run.grid.centres[0]
    checks.figure(
        f"{name} waves at {t:.2f} s",
        "x [m]",
        "depth [m]",
        {"outflow": (x, depths(run, t))},
        {"tank that goes on": (x, depths(reference, t)[:n])},
        smooth=True,
    )


def current(run: Run, checks: Checks) -> None:
    """Level and discharge at the end."""
    fields = run.fields_at(run.field_times[-1])
    depth = depths(run, float(run.field_times[-1]))
    flow = run.grid.spacing[2] * (fields.velocity[..., 0] * fields.liquid).sum(axis=0)[0]
    checks.close("current from rest: depth at the outflow [m]", float(depth[-1]), LEVEL, 0.005)
    checks.close("current from rest: mean depth [m]", float(depth.mean()), LEVEL, 0.005)
    checks.close(
        "current from rest: discharge at the outflow [m2/s]", float(flow[-1]), SPEED * LEVEL, 0.01
    )


def uniform(run: Run, checks: Checks) -> None:
    """Nothing changes."""
    worst = 0.0
    for t in run.field_times:
        fields = run.fields_at(t)
        worst = max(worst, float(np.abs(fields.velocity - [SPEED, 0.0, 0.0]).max()))
        change = float(np.abs(depths(run, t) - LEVEL).max())
        checks.below(f"uniform current: change of depth at {t:.1f} s [m]", change, 1e-8)
    checks.below("uniform current: change of velocity [m/s]", worst, 1e-6)


def check(runs: list[Run], checks: Checks) -> None:
    """Each kind of run."""
    named = {run.folder.name: run for run in runs}
    for name, run in named.items():
        if name in REFLECTED and f"{name}_reference" in named:
            waves(run, named[f"{name}_reference"], checks)
    if "current" in named:
        current(named["current"], checks)
    if "uniform" in named:
        uniform(named["uniform"], checks)
