"""Tetrapods of 2 m that fall on a slope in the sea: fall, rest and place at that scale."""

import numpy as np

from measures.checks import Checks
from micstools.reading.energy import made_by_contact
from micstools.reading.health import EXCESS_LIMIT
from micstools.reading.reader import Run

VARIES = ("contact contact_time", "contact wall_friction")
HEIGHT = 2.0  # of a tetrapod [m]
TOE, SLOPE = 4.0, 0.5  # m; rise over run
FASTEST = 5.4
"""Weight in water = drag with a coefficient of 1 on the sphere of the same volume [m/s]."""
OVERLAP = 0.01, 0.03  # of the height, at the end and at any time
MADE = 3e-3  # of weight times height


def blocks(run: Run, checks: Checks) -> None:
    """All are let go, fall, and come to rest on the slope or on one another."""
    bodies, end = run.bodies, run.bodies.time[-1]
    checks.true("settled before the end", end < run.value("run", "t_end"), f"{end:.1f} s")
    checks.true("all let go", np.isfinite(bodies.release_time).all())
    at, start = bodies.position[-1], bodies.position[0]
    above = (at[:, 2] - SLOPE * np.maximum(0.0, at[:, 0] - TOE)).min()
    checks.within("lowest centre over the bed / height", above / HEIGHT, 0.3, 0.6)
    checks.true("all within the tank", ((at > run.grid.low) & (at < run.grid.high)).all())
    drift = (at - start)[:, 0].mean()
    checks.true("down the slope, on average", drift < 0.0, f"{drift:.2f} m")
    fastest = -bodies.velocity[..., 2].min(axis=0).max()
    checks.below("fastest fall [m/s]", fastest, FASTEST)


def computation(run: Run, checks: Checks) -> None:
    """Overlap, energy of contact and excess of fluid."""
    overlap = run.series.max_overlap / HEIGHT
    checks.below("largest overlap at the end / height", overlap[-1], OVERLAP[0])
    checks.below("largest overlap at any time / height", overlap.max(), OVERLAP[1])
    made = made_by_contact(run).max() / (run.bodies.mass.min() * 9.81 * HEIGHT)
    what = "energy made by contact in a step / weight x height"
    checks.below(what, made, MADE, counts=False)
    checks.below("largest excess of a cell [V]", run.series.volume_excess_max.max(), EXCESS_LIMIT)


def check(runs: list[Run], checks: Checks) -> None:
    """One run."""
    for run in runs:
        blocks(run, checks)
        computation(run, checks)
