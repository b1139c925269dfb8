"""Pressure of a dam break on the far wall: arrival and plateau against an experiment."""

from pathlib import Path

from measures.impact_pressure import Experiment

WALL = Experiment(
    tables=str(Path(__file__).with_name("B6_lobovsky_{}.csv")),
    height=0.3,
    way=1.61 - 0.6,
    sensors={"p1": 0.003, "p3": 0.030, "p4": 0.080},
    level=0.1,
    plateau=(4.0, 5.5),
    column=lambda grid: -1,
    counts_from=30,
)

QUICK = ()  # its figures count from 30 cells on
check = WALL.check
