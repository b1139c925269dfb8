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
    name, n, x = run.folder.name, run.grid.x.size - 1, run.grid.centres[0]
    found, undisturbed = (
        np.array([depths(r, t)[:n] for t in run.field_times]) for r in (run, reference)
    )
    incident = np.abs(undisturbed[:, n - 1] - run.value("fluid", "water_level")).max()
    worst = np.abs(found - undisturbed).max()
    checks.below(f"{name} waves: part that comes back", worst / incident, REFLECTED[name])
    title, exact = f"{name} waves at {run.field_times[-1]:.2f} s", (x, undisturbed[-1])
    curves = {"outflow": (x, found[-1])}, {"tank that goes on": exact}
    checks.figure(title, "x [m]", "depth [m]", *curves, smooth=True)


def current(run: Run, checks: Checks) -> None:
    """Level and discharge at the end."""
    fields = run.fields_at(run.field_times[-1])
    depth = depths(run, float(run.field_times[-1]))
    flow = run.grid.spacing[2] * (fields.velocity[..., 0] * fields.liquid).sum(axis=0)[0]
    for said, ours, wanted, band in (
        ("depth at the outflow [m]", depth[-1], LEVEL, 0.005),
        ("mean depth [m]", depth.mean(), LEVEL, 0.005),
        ("discharge at the outflow [m2/s]", flow[-1], SPEED * LEVEL, 0.01),
    ):
        checks.close(f"current from rest: {said}", ours, wanted, band)


def uniform(run: Run, checks: Checks) -> None:
    """Nothing changes."""
    worst = 0.0
    for t in run.field_times:
        fields = run.fields_at(t)
        worst = max(worst, np.abs(fields.velocity - [SPEED, 0.0, 0.0]).max())
        change = np.abs(depths(run, t) - LEVEL).max()
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
