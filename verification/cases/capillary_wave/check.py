"""A small capillary wave against the exact solution."""

import numpy as np

from measures.checks import Checks
from measures.waves import prosperetti_two_fluids, standing_amplitude
from micstools.reading.reader import Run

RMS_BAND = 0.02  # of the initial amplitude
COUNTS_FROM = 32  # cells per wavelength
WAVENUMBER, AMPLITUDE = 2 * np.pi, 0.01


def check(runs: list[Run], checks: Checks) -> None:
    """Root mean square of the difference in amplitude."""
    errors, ours, exact = {}, {}, {}
    for run in runs:
        name, cells = run.folder.name, round(1.0 / run.grid.spacing[0])
        rho = tuple(float(run.value("fluid", f"{of}_density")) for of in ("liquid", "gas"))
        mu = float(run.value("fluid", "liquid_viscosity"))
        sigma = float(run.value("fluid", "surface_tension"))
        omega = (sigma * WAVENUMBER**3 / sum(rho)) ** 0.5
        time, amplitude = standing_amplitude(run)
        reference = prosperetti_two_fluids(time, WAVENUMBER, omega, mu / rho[0], (rho[0], rho[1]))
        error = float(np.sqrt(np.mean((amplitude / AMPLITUDE - reference) ** 2)))
        label = f"{name}: rms difference, {cells} cells per wavelength"
        checks.below(label, error, RMS_BAND, counts=cells >= COUNTS_FROM)
        if name.startswith("cells"):
            errors[cells] = error
        ours[name], exact[name] = (time, amplitude / AMPLITUDE), (time, reference)
    checks.study("rms difference in amplitude", errors, 0.0, "cells per wavelength")
    checks.figure("amplitude", "t [s]", "a/a0", ours, exact, smooth=True)
