"""Each of two parted basins keeps its own liquid while a block falls into one."""

import numpy as np

from measures.balance import liquid_between
from measures.checks import DRIFT_BAND, Checks
from micstools.reading.reader import Run


def check(runs: list[Run], checks: Checks) -> None:
    """Liquid of each basin in every restart file against the volume of the start."""
    for run in runs:
        level = float(run.value("fluid", "water_level"))
        width = run.grid.high[1] - run.grid.low[1]
        wall = run.points(0, 0)[:, 0]
        block = run.points(1, 0)[:, 2]
        checks.true("the block starts above the water", bool(block.min() > level))
        ends = np.array([run.grid.low[0], wall.min(), wall.max(), run.grid.high[0]])
        middle = (wall.min() + wall.max()) / 2
        for name in run.restart_files:
            state = run.restart(name)
            for basin, (a, b, low, high) in {
                "left": (ends[0], ends[1], ends[0], middle),
                "right": (ends[2], ends[3], middle, ends[3]),
            }.items():
                expected = (b - a) * width * level
                found = liquid_between(run, state, 0, low, high)
                drift = found / expected - 1
                checks.below(f"drift of the {basin} basin in {name}", drift, DRIFT_BAND)
        lowest = float(run.bodies.position[-1, 1, 2])
        checks.true("the block is under water in the end", lowest < 0.5 * level, f"{lowest:.4f} m")
