"""Pressure of a dam break on a box: arrival and plateau against an experiment."""

from pathlib import Path

import numpy as np

from measures.checks import Checks
from measures.impact_pressure import Experiment
from micstools.reading.reader import Run

FRONT = 2.3955  # of the box [m]

BOX = Experiment(
    tables=str(Path(__file__).with_name("B7_kleefsman_{}.csv")),
    height=0.55,
    way=FRONT - 1.228,
    sensors={"p1": 0.021, "p3": 0.101},
    level=0.4,  # the table has no points between 0.03 and 0.45
    plateau=(3.0, 5.0),
    column=lambda grid: round(FRONT / grid.spacing[0]) - 1,
    counts_from=22,
)


def passes(run: Run, x: float, level: float) -> float:
    """First time at which the water at a gauge is higher than a level [s]."""
    column = int(x / run.grid.spacing[0])
    heights = np.array([run.fields_at(t).liquid[:, 0, column].sum() for t in run.field_times])
    heights *= run.grid.spacing[2]
    i = int(np.flatnonzero(heights > level)[0])
    return float(np.interp(level, heights[i - 1 : i + 1], run.field_times[i - 1 : i + 1]))


def check(runs: list[Run], checks: Checks) -> None:
    """The sensors, and for information when the water passed the gauges before the box."""
    BOX.check(runs, checks)
    gauges = np.loadtxt(Path(__file__).with_name("B7_kleefsman_gauges.csv"), delimiter=",")
    for run in runs:
        for x, level, time in gauges:
            label = f"{run.folder.name}: {1000 * level:g} mm of water at {x:g} m [s]"
            checks.close(label, passes(run, x, level), float(time), 0.04, counts=False)
