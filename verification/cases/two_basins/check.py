"""Each of two parted basins keeps its own liquid while a block falls into one."""

from measures.balance import liquid_between
from measures.checks import DRIFT_BAND, Checks
from micstools.reading.reader import Run


def check(runs: list[Run], checks: Checks) -> None:
    """Liquid of each basin in every restart file against the volume of the start."""
    for run in runs:
        level = run.value("fluid", "water_level")
        width = run.grid.high[1] - run.grid.low[1]
        wall = run.points(0, 0)[:, 0]
        block = run.points(1, 0)[:, 2]
        checks.true("the block starts above the water", block.min() > level)
        start, end, middle = run.grid.low[0], run.grid.high[0], (wall.min() + wall.max()) / 2
        for name in run.restart_files:
            state = run.restart(name)
            for basin, length, low, high in (
                ("left", wall.min() - start, start, middle),
                ("right", end - wall.max(), middle, end),
            ):
                found = liquid_between(run, state, 0, low, high)
                drift = found / (length * width * level) - 1
                checks.below(f"drift of the {basin} basin in {name}", drift, DRIFT_BAND)
        lowest = run.bodies.position[-1, 1, 2]
        checks.true("the block is under water in the end", lowest < 0.5 * level, f"{lowest:.4f} m")
