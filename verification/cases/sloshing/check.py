"""Period and damping of a small free wave in a tank against linear theory."""

from pathlib import Path

import numpy as np

from measures.checks import Checks
from measures.waves import period, standing_amplitude
from micstools.reading.reader import Run

PERIOD_BAND = 0.01
COUNTS_FROM = 32  # cells per wavelength
TABLE = Path(__file__).with_name("B2_sloshing_linear.csv")


def check(runs: list[Run], checks: Checks) -> None:
    """Mean period of five; amplitude left after them, for information."""
    periods, ours = {}, {}
    rows = [line.split(",") for line in TABLE.read_text().splitlines() if line[0] not in "#L"]
    exact = next(float(row[6]) for row in rows if row[:3] == ["0.3", "0.15", "1"])
    for run in runs:
        name, cells = run.folder.name, round(0.6 / run.grid.spacing[0])
        time, amplitude = standing_amplitude(run)
        periods[cells] = period(time, amplitude)
        counts = cells >= COUNTS_FROM
        label = f"{name}: period, {cells} cells per wavelength [s]"
        checks.close(label, periods[cells], exact, PERIOD_BAND, counts=counts)
        late = np.abs(amplitude[time > 4.5 * exact]).max() / 0.0015
        checks.within(f"{name}: a/a0 after five periods", float(late), 0.95, 1.0, counts=False)
        ours[name] = (time, amplitude / 0.0015)
    checks.study("period [s]", periods, exact, "cells per wavelength")
    checks.figure("amplitude", "t [s]", "a/a0", ours)
