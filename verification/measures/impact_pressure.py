"""Pressures of a dam break where the water strikes: arrival and plateau against an experiment.

Pressures are over rho g H and times over sqrt(H/g), H the height of the column of water. In the
corner under the sensors an ideal fluid rests, and feels the whole head of the stream that arrives:
of Ritter's wave, until the wall behind the column is felt.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from measures.checks import Checks
from micstools.reading.reader import Grid, Run

ARRIVAL_BAND, PLATEAU_BAND, HEAD_BAND = (0.04, 0.15, 0.05)

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Experiment:
    """A dam break with pressure sensors above one another on a surface that faces the water."""

    tables: str  # path of the tables, with {} for the name of a sensor
    height: float  # of the column of water [m]
    way: float  # of the front to the surface [m]
    sensors: dict[str, float]  # height above the floor [m], the lowest first
    level: float  # at which the water has arrived
    plateau: tuple[float, float]  # after the impact and before the wave comes back
    column: Callable[[Grid], int]  # number in x of the last cells before the surface, from 0
    counts_from: int  # cells to the height of the column of the coarsest run that counts
    density: float = 998.2  # [kg/m3]
    gravity: float = 9.81  # [m/s2]

    def table(self, sensor: str) -> tuple[Values, Values]:
        """Times and pressures measured."""
        lines = Path(self.tables.format(sensor)).read_text().splitlines()
        rows = np.array([line.split(",") for line in lines if line[0] not in "#t"], float)
        return rows[:, 0], rows[:, 1]

    def history(self, run: Run) -> tuple[Values, dict[str, Values]]:
        """Times of a run, and pressures at each sensor: of the cells before the surface in the
        middle of the tank, straight lines between their heights."""
        column, scale = self.column(run.grid), self.density * self.gravity * self.height
        found: dict[str, list[float]] = {name: [] for name in self.sensors}
        for t in run.field_times:
            pressure = run.fields_at(t).pressure[:, 0, column].astype(float) / scale
            heights = (np.arange(len(pressure)) + 0.5) * run.grid.spacing[2]
            for name, height in self.sensors.items():
                found[name].append(float(np.interp(height, heights, pressure)))
        time = np.array(run.field_times) * (self.gravity / self.height) ** 0.5
        return time, {name: np.array(values) for name, values in found.items()}

    def arrival(self, time: Values, pressure: Values) -> float:
        """First time at which the pressure passes the level."""
        i = int(np.flatnonzero(pressure > self.level)[0])
        return float(np.interp(self.level, pressure[i - 1 : i + 1], time[i - 1 : i + 1]))

    def mean(self, time: Values, pressure: Values) -> float:
        """Mean pressure of the plateau."""
        return float(np.interp(np.linspace(*self.plateau, 200), time, pressure).mean())

    def ideal_plateau(self) -> float:
        """Mean of the plateau at the lowest sensor in an ideal fluid (Ritter 1892)."""
        slope = self.way / self.height / np.linspace(*self.plateau, 200)
        velocity_head, depth = 2 / 9 * (1 + slope) ** 2, (2 - slope) ** 2 / 9
        return float((velocity_head + depth).mean()) - min(self.sensors.values()) / self.height

    def check(self, runs: list[Run], checks: Checks) -> None:
        """Every sensor of each run."""
        ours = {}
        measured = {name: self.table(name) for name in self.sensors}
        for run in runs:
            cells = round(self.height / run.grid.spacing[2])
            time, pressures = self.history(run)
            counts, lowest = cells >= self.counts_from, next(iter(pressures))
            for name, pressure in pressures.items():
                label = f"{run.folder.name}, {name}"
                for what, value, band in (
                    ("arrival", self.arrival, ARRIVAL_BAND),
                    ("plateau", self.mean, PLATEAU_BAND),
                ):
                    exact = value(*measured[name])
                    checks.close(
                        f"{label}: {what}", value(time, pressure), exact, band, counts=counts
                    )
                ours[f"{name}, {cells} cells"] = (time, pressure)
            checks.close(
                f"{run.folder.name}, {lowest}: plateau, ideal fluid",
                self.mean(time, pressures[lowest]),
                self.ideal_plateau(),
                HEAD_BAND,
                counts=counts,
            )
        checks.figure("pressure", "t sqrt(g/H)", "p/(rho g H)", ours, measured)
