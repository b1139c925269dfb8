"""Rock from a split hopper in a current: the books of momentum and volume, and where it lies."""

import numpy as np

from measures.checks import Checks
from micstools.reading.health import EXCESS_LIMIT
from micstools.reading.reader import Run

VARIES = ("contact contact_time", "contact wall_friction")
BOOK_BAND = 1e-10  # of the largest force, weight included
LAYERS = 2.0  # height of two rocks on one another [m]


def momentum(run: Run, checks: Checks) -> None:
    """M dU/dt = fluid force + contact force + weight, for each rock in each step."""
    b, free = run.bodies, ~run.bodies.fixed
    mass = b.mass[free][None, :, None]
    step = np.diff(b.time)[:, None, None]
    force = b.fluid_force[1:, free] + b.contact_force[1:, free]
    weight = mass * np.array([0.0, 0.0, -9.81])
    error = mass * np.diff(b.velocity[:, free], axis=0) / step - force - weight
    worst = np.abs(error).max() / np.abs(force).max()
    checks.below("M dU/dt less its forces / largest force", worst, BOOK_BAND)


def load(run: Run, checks: Checks) -> None:
    """The load leaves the hopper, goes downstream and comes to rest on the ground."""
    b, free = run.bodies, ~run.bodies.fixed
    start, end = b.position[0, free], b.position[-1, free]
    checks.true("settled before the end", b.time[-1] < run.value("run", "t_end"))
    checks.below("highest rock at the end [m]", end[:, 2].max(), LAYERS)
    checks.true("all within the tank", ((end > run.grid.low) & (end < run.grid.high)).all())
    drift = (end - start)[:, 0].mean()
    checks.true("downstream, on average", drift > 0.0, f"{drift:.2f} m")


def check(runs: list[Run], checks: Checks) -> None:
    """One run."""
    for run in runs:
        momentum(run, checks)
        load(run, checks)
        excess = run.series.volume_excess_max.max()
        checks.below("largest excess of a cell [V]", excess, EXCESS_LIMIT)
