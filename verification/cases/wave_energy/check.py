"""A wave without viscosity keeps its height, wherever its level lies in a cell."""

import numpy as np

from measures.checks import Checks
from measures.waves import period, standing_amplitude
from micstools.reading.reader import Run

BAND = 0.05  # of the height, in nine periods
GRAVITY, WAVENUMBER, SPACING = (9.81, 4.0 * np.pi / 0.3, 0.3 / 32.0)
HEIGHT, ROWS = (1e-5, 21)
LIQUID, GAS = (1000.0, 1.2)


def exact_period(depth: float) -> float:
    """Linear theory of two layers between floor and lid [s]."""
    below = LIQUID / np.tanh(WAVENUMBER * depth)
    above = GAS / np.tanh(WAVENUMBER * (ROWS * SPACING - depth))
    squared = GRAVITY * WAVENUMBER * (LIQUID - GAS) / (below + above)
    return float(2.0 * np.pi / squared**0.5)


def check(runs: list[Run], checks: Checks) -> None:
    """Largest height in the last half second over that of the start."""
    for run in runs:
        name = run.folder.name
        time, amplitude = standing_amplitude(run, mode=4)
        left = np.abs(amplitude[time > time[-1] - 0.5]).max() / HEIGHT
        checks.close(f"{name}: height after nine periods", left, 1.0, BAND)
        exact = exact_period((16.0 + int(name[-2:]) / 100.0) * SPACING)
        checks.close(f"{name}: period [s]", period(time, amplitude), exact, 0.05, counts=False)
        checks.figure("height", "t [s]", "a/a0", {name: (time, amplitude / HEIGHT)})
