"""Collapse of a column of water: front and height against experiments.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.checks import Checks, main, sound  # noqa: E402
from micstools.reader import Run  # noqa: E402

BAND = 0.05  # of the position of the front
HEIGHT_BAND = 0.05  # of the initial height
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
    lines = Path(__file__).with_name(name).read_text().splitlines()
    rows = [line.split(",") for line in lines if line[0] not in "#T" and not line.startswith("a_m")]
    return np.array([[float(part) for part in row[-2:]] for row in rows])


def history(run: Run) -> tuple[Values, Values, Values]:
    """Times [s], front of the water on the floor [m], height at the wall [m]."""
    dx, dz = run.grid.spacing[0], run.grid.spacing[2]
    front, height = [], []
    for t in run.field_times:
        depth = run.fields(t).liquid[:, 0, :].astype(float).sum(axis=0) * dz
        wet = np.flatnonzero(depth >= 0.5 * dz)
        last = int(wet[-1])
        beyond = depth[last + 1] if last + 1 < len(depth) else 0.0
        part = (depth[last] - 0.5 * dz) / max(depth[last] - beyond, 1e-30)
        front.append((last + 0.5 + part) * dx)
        height.append(float(depth[0]))
    return np.array(run.field_times), np.array(front), np.array(height)


def worst(time: Values, value: Values, reference: Values, scale: Values, shift: float) -> float:
    """Largest difference at the times of the reference, over `scale`."""
    found = np.interp(reference[:, 0] + shift, time, value)
    return float(np.abs((found - reference[:, 1]) / scale).max())


def check(runs: list[Run]) -> Checks:
    """One shift for all times of a run makes up for the gate; it fits the front."""
    checks, ours, measured = Checks("dam break"), {}, {}
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
        checks.within(f"{name}: shift of the time", shift, -LARGEST_SHIFT, LARGEST_SHIFT)
        if name == "martin_moyce_1":
            drop = table("B1_martin_moyce_height.csv")
            drop = drop[drop[:, 0] <= time[-1] - LARGEST_SHIFT]
            error = worst(time, height / base, drop, np.ones(len(drop)), shift)
            checks.below(f"{name}: largest error of the height", error, HEIGHT_BAND)
        ours[name], measured[name] = (time - shift, front), (rows[:, 0], rows[:, 1])
        sound(run, checks)
    checks.figure("front", "T", "Z", ours, measured)
    return checks


if __name__ == "__main__":
    main(check)
