"""A small gravity wave on a viscous liquid against the exact solution."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from measures.waves import standing_amplitude
from micstools.reading.reader import Run

QUICK = ("cells_32",)
RMS_BAND = 0.02  # of the initial amplitude
COUNTS_FROM = 32  # cells per wavelength
AMPLITUDE = 0.01  # [m]
TABLE = table(__file__, "B2_prosperetti_single_fluid.csv").to_numpy()


def check(runs: list[Run], checks: Checks) -> None:
    """Root mean square of the difference in amplitude at the times of the table."""
    for run in runs:
        name, cells = run.folder.name, round(1.0 / run.grid.spacing[0])
        time, amplitude = standing_amplitude(run)
        exact = TABLE[TABLE[:, 0] <= time[-1]]
        found = np.interp(exact[:, 0], time, amplitude / AMPLITUDE)
        error = np.sqrt(np.mean((found - exact[:, 1]) ** 2))
        label = f"{name}: rms difference, {cells} cells per wavelength"
        checks.below(label, error, RMS_BAND, counts=cells >= COUNTS_FROM)
        checks.study("rms difference in amplitude", {cells: error}, 0.0, "cells per wavelength")
        ours = {name: (time, amplitude / AMPLITUDE)}
        checks.figure("amplitude", "t [s]", "a/a0", ours, {"exact": TABLE.T})
