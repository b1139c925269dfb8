"""A water ball in a uniform stream keeps the velocity of the stream."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

BAND = 1e-10  # of the speed of the stream


def check(runs: list[Run], checks: Checks) -> None:
    """Velocity of cells and faces in the final state against that of the start."""
    for run in runs:
        stream = np.array(run.value("fluid", "velocity"), float)
        speed = float(np.linalg.norm(stream))
        state = run.restart()
        nx, ny, nz = (len(f) - 1 for f in run.grid.faces)
        for name in ("flow/u", "flow/uf"):
            found = np.asarray(state[name])[:, :nz, :ny, :nx]
            worst = np.abs(found - stream[:, None, None, None]).max() / speed
            checks.below(f"change of {name} / speed", worst, BAND)
        liquid = run.fields_at(run.field_times[-1]).liquid
        there = liquid.max() > 0.99 and liquid.min() < 0.01
        checks.true("water and air are still there", there)
