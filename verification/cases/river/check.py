"""A current with and without blocks: a steady surface, and blocks that come to rest."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

LEVEL_BAND = 1e-3  # of the depth


def empty(run: Run, checks: Checks) -> None:
    """Depth everywhere and at all times, and the discharge at the end."""
    level, dz = run.value("fluid", "water_level"), run.grid.spacing[2]
    times = run.field_times
    far = max(np.abs(dz * run.fields_at(t).liquid.sum(axis=0) - level).max() for t in times)
    checks.below("without blocks: largest change of depth / depth", far / level, LEVEL_BAND)
    fields = run.fields_at(times[-1])
    flow = dz * (fields.velocity[..., 0] * fields.liquid).sum(axis=0).mean(axis=0)
    wanted = run.value("boundary", "x_min_velocity")[0] * level
    checks.close("without blocks: discharge at the outflow [m2/s]", flow[-1], wanted, 0.01)


def blocks(run: Run, checks: Checks) -> None:
    """All are released, rest within the tank, and lie downstream of where they were dropped."""
    b, end = run.bodies, run.bodies.time[-1]
    settled = end < run.value("run", "t_end")
    checks.true("with blocks: settled before the end", settled, f"{end:.2f} s")
    speed, rest = np.linalg.norm(b.velocity[-1], axis=1).max(), run.value("run", "rest_speed")
    checks.below("with blocks: largest speed at the end [m/s]", speed, rest)
    inside = ((b.position[-1] > run.grid.low) & (b.position[-1] < run.grid.high)).all()
    checks.true("with blocks: all within the tank", inside)
    drift = (b.position[-1, :, 0] - b.position[0, :, 0]).mean()
    said = "with blocks: carried downstream, on average"
    checks.true(said, drift > 0.0, f"{1000 * drift:.0f} mm")


def check(runs: list[Run], checks: Checks) -> None:
    """Both runs."""
    for run in runs:
        {"empty": empty, "blocks": blocks}[run.folder.name](run, checks)
