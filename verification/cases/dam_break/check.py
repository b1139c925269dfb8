"""Collapse of a column of water: front and height against experiments and another program, and
what must hold whatever an experiment does: the exact force at the start, and energy."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from measures import facts
from measures.checks import Checks
from micstools.reading.reader import Run

BAND = 0.05  # of the position of the front
HEIGHT_BAND = 0.05  # of the initial height
PROGRAM_BAND = 0.04  # of the front by interFoam on the same grid
FORCE_BAND = 0.01  # of the impulse of the first rows of fields over the exact force
ENERGY_GAIN, ENERGY_LOSS = (0.01, 0.05)  # of the potential energy of the start
GRAVITY, DENSITY = (9.81, 998.2)
LARGEST_SHIFT = 0.15  # of the time, in units of T: the gate of the experiment
SIZES = {  # base [m], height over base
    "martin_moyce_1": (0.05715, 1.0),
    "martin_moyce_2": (0.05715, 2.0),
    "koshizuka_oka": (0.146, 2.0),
}
FRONTS = {
    "martin_moyce_1": "B1_martin_moyce_front_n2_1.csv",
    "martin_moyce_2": "B1_martin_moyce_front_n2_2.csv",
    "koshizuka_oka": "B1_koshizuka_oka_front.csv",
}
LAST_TIME = {"martin_moyce_1": 3.25}  # the last two rows of that table lie too close in time

Values = NDArray[np.float64]


def table(name: str) -> Values:
    """The rows of a reference file; time and value are its last two columns."""
    return facts.table(__file__, name).iloc[:, -2:].to_numpy(float)


def history(run: Run) -> tuple[Values, Values, Values]:
    """Times [s], front of the water on the floor [m], height at the wall [m]."""
    dx, dz = run.grid.spacing[0], run.grid.spacing[2]
    front, height = [], []
    for t in run.field_times:
        depth = run.fields_at(t).liquid[:, 0, :].astype(float).sum(axis=0) * dz
        wet = np.flatnonzero(depth >= 0.5 * dz)
        last = int(wet[-1])
        beyond = depth[last + 1] if last + 1 < len(depth) else 0.0
        part = (depth[last] - 0.5 * dz) / max(depth[last] - beyond, 1e-30)
        front.append((last + 0.5 + part) * dx)
        height.append(float(depth[0]))
    return np.array(run.field_times), np.array(front), np.array(height)


def starting_force(base: float, height: float) -> float:
    """Force of the wall on the column at the start over its density and width [m3/s2].

    Exact for a liquid at rest without gas: the pressure is harmonic, zero on top and on the free
    side: rho g (H - z) less a series in cos(k z) cosh(k x).
    """
    n = np.arange(100)
    k = (n + 0.5) * np.pi / height
    taken = 2.0 / (height * k**3) * (-1.0) ** n / np.cosh(k * base)
    return float(GRAVITY * (0.5 * height**2 - taken.sum()))


def impulse_over_force(run: Run, base: float, height: float) -> float:
    """Momentum of the water along x at the first row of fields, over exact force and time."""
    dx, dz = run.grid.spacing[0], run.grid.spacing[2]
    time = run.field_times[1]
    fields = run.fields_at(time)
    momentum = fields.liquid[:, 0, :].astype(float) * fields.velocity[:, 0, :, 0].astype(float)
    return float(momentum.sum() * dx * dz / (starting_force(base, height) * time))


def energy(run: Run) -> tuple[Values, Values]:
    """Times [s], and kinetic and potential energy over that of the start."""
    h, potential, kinetic = run.grid.spacing, [], []
    for t in run.field_times:
        share = run.fields_at(t).liquid[:, 0, :].astype(float)
        rows, columns = share.shape
        below = np.vstack([np.ones((1, columns)), share[:-1]])
        above = np.vstack([share[1:], np.zeros((1, columns))])
        middle = (np.arange(rows) + 0.5)[:, None] - 0.5 * (1.0 - share) * np.sign(below - above)
        weight = DENSITY * GRAVITY * float(np.prod(h))
        potential.append(weight * h[2] * float((share * middle).sum()))
        kinetic.append(float(np.interp(t, run.series.time, run.series.kinetic_energy_fluid)))
    return np.array(run.field_times), (np.array(potential) + np.array(kinetic)) / potential[0]


def worst(time: Values, value: Values, reference: Values, scale: Values, shift: float) -> float:
    """Largest difference at the times of the reference, over `scale`."""
    found = np.interp(reference[:, 0] + shift, time, value)
    return float(np.abs((found - reference[:, 1]) / scale).max())


def check(runs: list[Run], checks: Checks) -> None:
    """One shift for all times of a run makes up for the gate; it fits the front."""
    for run in runs:
        name = run.folder.name
        base, ratio = SIZES[name]
        seconds, front, height = history(run)
        time, front = seconds * (ratio * 9.81 / base) ** 0.5, front / base
        rows = table(FRONTS[name])
        length = run.grid.high[0] / base
        inside = rows[:, 0] <= min(time[-1], LAST_TIME.get(name, 99.0)) - LARGEST_SHIFT
        rows = rows[inside & (rows[:, 1] < length - 0.5)]
        shifts = np.linspace(-LARGEST_SHIFT, LARGEST_SHIFT, 61)
        errors = [worst(time, front, rows, rows[:, 1], shift) for shift in shifts]
        shift = float(shifts[int(np.argmin(errors))])
        checks.below(f"{name}: largest error of the front ({len(rows)} points)", min(errors), BAND)
        other = Path(__file__).with_name(f"interfoam_{name}.csv")
        if other.exists():
            rows_other = table(other.name)
            rows_other = rows_other[rows_other[:, 0] <= time[-1]]
            error = worst(time, front, rows_other, rows_other[:, 1], 0.0)
            checks.below(f"{name}: largest difference from interFoam", error, PROGRAM_BAND)
        ratio_force = impulse_over_force(run, base, ratio * base)
        checks.close(f"{name}: impulse over exact force at the start", ratio_force, 1.0, FORCE_BAND)
        instants, total = energy(run)
        free = total[instants <= seconds[front < length - 0.5].max()]
        farthest, bounds = free[np.argmax(np.abs(free - 1.0))], (1 - ENERGY_LOSS, 1 + ENERGY_GAIN)
        checks.within(f"{name}: energy over that of the start", farthest, *bounds)
        if name == "martin_moyce_1":
            drop = table("B1_martin_moyce_height.csv")
            drop = drop[drop[:, 0] <= time[-1] - LARGEST_SHIFT]
            error = worst(time, height / base, drop, np.ones(len(drop)), shift)
            checks.below(f"{name}: largest error of the height", error, HEIGHT_BAND)
        checks.figure("front", "T", "Z", {name: (time - shift, front)}, {name: rows.T})
