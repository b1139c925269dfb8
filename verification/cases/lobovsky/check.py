"""Pressure of a dam break on the far wall: arrival and plateau against an experiment.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

import numpy as np  # noqa: E402

from micstools.checks import Checks, main  # noqa: E402
from micstools.impact_pressure import Experiment  # noqa: E402
from micstools.reader import Run  # noqa: E402

HEAD_BAND = 0.05
WAY = 1.61 - 0.6  # of the front to the wall [m]

WALL = Experiment(
    title="dam break against a wall",
    tables=str(Path(__file__).with_name("B6_lobovsky_{}.csv")),
    height=0.3,
    sensors={"p1": 0.003, "p3": 0.030, "p4": 0.080},
    level=0.1,
    plateau=(4.0, 5.5),
    column=lambda grid: -1,
    counts_from=30,
)


def ritter_head() -> float:
    """Velocity head and depth, over H, of the stream that arrives at the wall, mean of the plateau
    (Ritter 1892): the pressure in the corner, where an ideal fluid rests."""
    slope = WAY / WALL.height / np.linspace(*WALL.plateau, 200)  # x/(t sqrt(g H))
    return float((2 / 9 * (1 + slope) ** 2 + (2 - slope) ** 2 / 9).mean())


def check(runs: list[Run]) -> Checks:
    """The sensors, and the lowest against the head of the stream."""
    checks = WALL.check(runs)
    for run in runs:
        time, pressures = WALL.history(run)
        checks.close(
            f"{run.folder.name}, p1: plateau, ideal fluid",
            WALL.mean(time, pressures["p1"]),
            ritter_head() - WALL.sensors["p1"] / WALL.height,
            HEAD_BAND,
            counts=WALL.height / run.grid.spacing[2] > WALL.counts_from - 0.5,
        )
    return checks


if __name__ == "__main__":
    main(check)
