"""A current with and without blocks: a steady surface, and blocks that come to rest."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

LEVEL_BAND = 1e-3  # of the depth


def empty(run: Run, checks: Checks) -> None:
    """Depth everywhere and at all times, and the discharge at the end."""
    level, dz = float(run.value("fluid", "water_level")), float(run.grid.spacing[2])
    times = run.field_times
    far = [float(np.abs(dz * run.fields_at(t).liquid.sum(axis=0) - level).max()) for t in times]
    checks.below("without blocks: largest change of depth / depth", max(far) / level, LEVEL_BAND)
    fields = run.fields_at(times[-1])
    flow = dz * (fields.velocity[..., 0] * fields.liquid).sum(axis=0).mean(axis=0)
    speed = run.value("boundary", "x_min_velocity")[0]
    checks.close(
        "without blocks: discharge at the outflow [m2/s]", float(flow[-1]), speed * level, 0.01
    )


def blocks(run: Run, checks: Checks) -> None:
    """All are released, rest within the tank, and lie downstream of where they were dropped."""
    bodies = run.bodies
    t_end = float(run.value("run", "t_end"))
    checks.true(
        "with blocks: settled before the end",
        bool(bodies.time[-1] < t_end),
        f"{bodies.time[-1]:.2f} s",
    )
    speed = float(np.linalg.norm(bodies.velocity[-1], axis=1).max())
    rest = float(run.value("run", "rest_speed"))
    checks.below("with blocks: largest speed at the end [m/s]", speed, rest)
    low, high = run.grid.low, run.grid.high
    inside = (bodies.position[-1] > low).all() and (bodies.position[-1] < high).all()
    checks.true("with blocks: all within the tank", bool(inside))
    drift = bodies.position[-1, :, 0] - bodies.position[0, :, 0]
    checks.true(
        "with blocks: carried downstream, on average",
        bool(drift.mean() > 0.0),
        f"{1000 * drift.mean():.0f} mm",
    )


def check(runs: list[Run], checks: Checks) -> None:
    """Both runs."""
    for run in runs:
        {"empty": empty, "blocks": blocks}[run.folder.name](run, checks)
