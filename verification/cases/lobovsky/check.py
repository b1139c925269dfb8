"""Pressure of a dam break on the far wall: arrival and plateau against an experiment.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.checks import Checks, main, sound  # noqa: E402
from micstools.reader import Run  # noqa: E402

ARRIVAL_BAND, PLATEAU_BAND = (0.04, 0.15)
COUNTS_FROM = 30  # cells to the height of the column
HEIGHT, DENSITY, GRAVITY = (0.3, 998.2, 9.81)
LEVEL = 0.1  # rho g H at which the water has arrived
PLATEAU = (4.0, 5.5)  # t sqrt(g/H), after the impact and before the wave comes back
SENSORS = {"p1": 0.003, "p3": 0.030, "p4": 0.080}  # height above the floor [m]

Values = NDArray[np.float64]


def table(name: str) -> Values:
    """Time and pressure of a sensor without units."""
    lines = Path(__file__).with_name(f"B6_lobovsky_{name}.csv").read_text().splitlines()
    return np.array([[float(v) for v in line.split(",")] for line in lines if line[0] not in "#t"])


def history(run: Run) -> tuple[Values, dict[str, Values]]:
    """Times and pressures at the sensors without units: of the cells at the wall, straight lines
    between their heights."""
    dz = run.grid.spacing[2]
    found: dict[str, list[float]] = {name: [] for name in SENSORS}
    for t in run.field_times:
        column = run.fields(t).pressure[:, 0, -1].astype(float) / (DENSITY * GRAVITY * HEIGHT)
        heights = (np.arange(len(column)) + 0.5) * dz
        for name, height in SENSORS.items():
            found[name].append(float(np.interp(height, heights, column)))
    time = np.array(run.field_times) * (GRAVITY / HEIGHT) ** 0.5
    return time, {name: np.array(values) for name, values in found.items()}


def arrival(time: Values, pressure: Values) -> float:
    """First time at which the pressure passes LEVEL."""
    i = int(np.flatnonzero(pressure > LEVEL)[0])
    return float(np.interp(LEVEL, pressure[i - 1 : i + 1], time[i - 1 : i + 1]))


def plateau(time: Values, pressure: Values) -> float:
    """Mean pressure in PLATEAU."""
    return float(np.interp(np.linspace(*PLATEAU, 200), time, pressure).mean())


def check(runs: list[Run]) -> Checks:
    """Three sensors of each run."""
    checks, ours = Checks("dam break against a wall"), {}
    for run in runs:
        cells = round(HEIGHT / run.grid.spacing[2])
        time, pressures = history(run)
        for name, pressure in pressures.items():
            rows = table(name)
            counts, label = cells >= COUNTS_FROM, f"{run.folder.name}, {name}"
            exact = arrival(rows[:, 0], rows[:, 1])
            checks.close(
                f"{label}: arrival", arrival(time, pressure), exact, ARRIVAL_BAND, counts=counts
            )
            exact = plateau(rows[:, 0], rows[:, 1])
            checks.close(
                f"{label}: plateau", plateau(time, pressure), exact, PLATEAU_BAND, counts=counts
            )
            ours[f"{name}, {cells} cells"] = (time, pressure)
        sound(run, checks)
    measured = {name: (table(name)[:, 0], table(name)[:, 1]) for name in SENSORS}
    checks.figure("pressure", "t sqrt(g/H)", "p/(rho g H)", ours, measured)
    return checks


if __name__ == "__main__":
    main(check)
