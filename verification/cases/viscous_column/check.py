"""Columns that collapse and bodies that drop in: no energy from nothing, whatever the step."""

from dataclasses import dataclass

import numpy as np

from measures.checks import Checks
from measures.facts import liquid
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

VARIES = ("numerics momentum", "numerics coupling")
"""In rows that do not count."""

QUICK = (
    "honey_no_slip_tenth",
    "honey_*slip*_whole",
    "equal_thin_whole",
    "oil_thick_gas_whole",
    "cube_honey_whole",
)

GRAVITY = 9.81
FREE_FALL = 1.01  # of what a body has lost: steps of its free fall and rounding
STEP_BAND = 0.15  # of the largest energy with a tenth of the step
LATE_LIMIT = 0.01  # of the largest energy, at the end of the long run
LATE = 1.0  # s, from where on a run is long
SHOWN = 0.4  # s of the curves
OF_THE_FIGURE = ("oil_slip", "honey_no_slip", "honey_space", "equal_thick", "oil_thick_gas")


@dataclass(frozen=True)
class Collapse:
    """Kinetic energy of liquid, gas and body, and the potential energy set free until then."""

    name: str
    step: str
    time: Array
    kinetic: Array  # [J]
    free: Array  # [J]
    bound: float  # of kinetic over free

    @property
    def largest(self) -> float:
        """Largest kinetic energy [J]."""
        return float(self.kinetic.max())

    @property
    def gain(self) -> float:
        """Largest kinetic energy over what is free at the time."""
        return float((self.kinetic[1:] / self.free[1:]).max())


def collapse(run: Run) -> Collapse:
    """From the rows of a run: for a column all that it can lose, for a body what it has lost."""
    name, step = run.folder.name.rsplit("_", 1)
    s = run.series
    if run.bodies.n:
        free = s.potential_energy_bodies[0] - s.potential_energy_bodies
        kinetic = s.kinetic_energy_fluid + s.kinetic_energy_bodies
        return Collapse(name, step, s.time, kinetic, free, FREE_FALL)
    low, high = (np.array(run.value("water", corner), float) for corner in ("min", "max"))
    edge = high - low
    weight = GRAVITY * liquid(run)[0] * float(np.prod(edge))
    level = float(np.prod(edge) / np.prod((run.grid.high - run.grid.low)[:2]))
    free = np.full(s.time.size, 0.5 * weight * (low[2] + high[2] - level))
    return Collapse(name, step, s.time, s.kinetic_energy_fluid, free, 1.0)


def check(runs: list[Run], checks: Checks) -> None:
    """Each run against its bound, and each pair of runs against each other."""
    pairs = {}
    for run in runs:
        found = collapse(run)
        counts = not any(found.name.endswith(word) for word in ("c_ismac", "mics"))
        said = f"{found.name}, {found.step} step"
        checks.below(f"{said}: kinetic energy over that set free", found.gain, found.bound, counts)
        if found.time[-1] > LATE:
            left = found.kinetic[-1] / found.largest
            checks.below(f"{said}: left of it after {found.time[-1]:g} s", left, LATE_LIMIT, counts)
        pairs.setdefault(found.name, {})[found.step] = found
    for name, pair in pairs.items():
        if len(pair) == 2:
            whole, tenth = pair["whole"].largest, pair["tenth"].largest
            checks.close(f"{name}: largest kinetic energy [J]", whole, tenth, STEP_BAND)
        for step, found in pair.items() if name in OF_THE_FIGURE else ():
            early = found.time <= SHOWN
            curve = {name: (found.time[early], (found.kinetic / found.free.max())[early])}
            curves = (curve, {}) if step == "whole" else ({}, curve)
            title = "kinetic energy over all that is set free"
            checks.figure(title, "t [s]", "-", *curves, smooth=True)
