"""A small capillary wave against the exact solution."""

import numpy as np

from measures.checks import Checks
from measures.facts import liquid
from measures.waves import prosperetti_two_fluids, standing_amplitude
from micstools.reading.reader import Run

RMS_BAND = 0.02  # of the initial amplitude
COUNTS_FROM = 32  # cells per wavelength
QUICK = ()
WAVENUMBER, AMPLITUDE = 2 * np.pi, 0.01


def check(runs: list[Run], checks: Checks) -> None:
    """Root mean square of the difference in amplitude."""
    for run in runs:
        name, cells = run.folder.name, round(1.0 / run.grid.spacing[0])
        (rho, mu), gas = liquid(run), float(run.value("fluid", "gas_density"))
        omega = (run.value("fluid", "surface_tension") * WAVENUMBER**3 / (rho + gas)) ** 0.5
        time, amplitude = standing_amplitude(run)
        exact = prosperetti_two_fluids(time, WAVENUMBER, omega, mu / rho, (rho, gas))
        error = np.sqrt(np.mean((amplitude / AMPLITUDE - exact) ** 2))
        label = f"{name}: rms difference, {cells} cells per wavelength"
        checks.below(label, error, RMS_BAND, counts=cells >= COUNTS_FROM)
        if name.startswith("cells"):
            title = "rms difference in amplitude"
            checks.study(title, {cells: error}, 0.0, "cells per wavelength")
        curves = {name: (time, amplitude / AMPLITUDE)}, {name: (time, exact)}
        checks.figure("amplitude", "t [s]", "a/a0", *curves, smooth=True)
