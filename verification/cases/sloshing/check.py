"""Period and damping of a small free wave in a tank against linear theory."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from measures.waves import period, standing_amplitude
from micstools.reading.reader import Run

PERIOD_BAND = 0.01
COUNTS_FROM = 32  # cells per wavelength
MODES = table(__file__, "B2_sloshing_linear.csv")
EXACT = float(MODES.query("L_m == 0.3 and h_m == 0.15 and mode_n == 1").T2_s.iloc[0])


def check(runs: list[Run], checks: Checks) -> None:
    """Mean period of five; amplitude left after them, for information."""
    for run in runs:
        name, cells = run.folder.name, round(0.6 / run.grid.spacing[0])
        time, amplitude = standing_amplitude(run)
        found = period(time, amplitude)
        label = f"{name}: period, {cells} cells per wavelength [s]"
        checks.close(label, found, EXACT, PERIOD_BAND, counts=cells >= COUNTS_FROM)
        late = np.abs(amplitude[time > 4.5 * EXACT]).max() / 0.0015
        checks.within(f"{name}: a/a0 after five periods", late, 0.95, 1.0, counts=False)
        checks.study("period [s]", {cells: found}, EXACT, "cells per wavelength")
        checks.figure("amplitude", "t [s]", "a/a0", {name: (time, amplitude / 0.0015)})
