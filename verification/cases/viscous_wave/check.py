"""A small gravity wave on a viscous liquid against the exact solution."""

from pathlib import Path

import numpy as np

from measures.checks import Checks
from measures.waves import standing_amplitude
from micstools.reading.reader import Run

QUICK = ("cells_32",)
RMS_BAND = 0.02  # of the initial amplitude
COUNTS_FROM = 32  # cells per wavelength
AMPLITUDE = 0.01  # [m]
TABLE = Path(__file__).with_name("B2_prosperetti_single_fluid.csv")


def check(runs: list[Run], checks: Checks) -> None:
    """Root mean square of the difference in amplitude at the times of the table."""
    errors, ours = {}, {}
    rows = [line for line in TABLE.read_text().splitlines() if line[0] not in "#t"]
    table = np.array([[float(part) for part in row.split(",")] for row in rows])
    for run in runs:
        name, cells = run.folder.name, round(1.0 / run.grid.spacing[0])
        time, amplitude = standing_amplitude(run)
        exact = table[table[:, 0] <= time[-1]]
        found = np.interp(exact[:, 0], time, amplitude / AMPLITUDE)
        errors[cells] = float(np.sqrt(np.mean((found - exact[:, 1]) ** 2)))
        label = f"{name}: rms difference, {cells} cells per wavelength"
        checks.below(label, errors[cells], RMS_BAND, counts=cells >= COUNTS_FROM)
        ours[name] = (time, amplitude / AMPLITUDE)
    checks.study("rms difference in amplitude", errors, 0.0, "cells per wavelength")
    checks.figure("amplitude", "t [s]", "a/a0", ours, {"exact": (table[:, 0], table[:, 1])})
