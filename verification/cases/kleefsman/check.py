"""Pressure of a dam break on a box: arrival and plateau against an experiment.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.checks import main  # noqa: E402
from micstools.impact_pressure import Experiment  # noqa: E402

FRONT = 2.42  # of the box [m]

BOX = Experiment(
    title="dam break against a box",
    tables=str(Path(__file__).with_name("B7_kleefsman_{}.csv")),
    height=0.55,
    sensors={"p1": 0.021, "p3": 0.101},
    level=0.4,  # the table has no points between 0.03 and 0.45
    plateau=(3.0, 5.0),
    column=lambda grid: round(FRONT / grid.spacing[0]) - 1,
    counts_from=16,
)

if __name__ == "__main__":
    main(BOX.check)
