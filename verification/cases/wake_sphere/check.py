"""Speed of a sphere that settles with a wake against spectral-element results."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, size, table
from micstools.reading.reader import Run

BANDS = {8: 0.05, 12: 0.03, 15: 0.02}  # of the speed, by least cells per diameter


def check(runs: list[Run], checks: Checks) -> None:
    """Vertical speed over sqrt((s - 1) g D) against the inflow at the end of each run."""
    exact = table(__file__, "reference.csv").set_index("run").u_vertical_over_uref["in_the_box"]
    for run in runs:
        b, diameter, (density, viscosity) = run.bodies, size(run), liquid(run)
        unit = np.sqrt((run.shapes["sphere"].density / density - 1) * 9.81 * diameter)
        speed = (run.value("boundary", "z_min_velocity")[2] - b.velocity[:, 0, 2]) / unit
        cells = cells_along(run, diameter)
        name, band = f"{cells:g} cells per diameter", [BANDS[n] for n in BANDS if cells >= n]
        galileo = unit * diameter * density / viscosity
        checks.close(f"{name}: Galileo number", galileo, 144.0, 1e-3)
        late = b.time > 0.9 * b.time[-1]
        before, found = (b.time > 0.8 * b.time[-1]) & ~late, speed[late].mean()
        said = "speed / sqrt((s - 1) g D)"
        checks.close(f"{name}: {said}", found, exact, min(band, default=max(BANDS.values())))
        checks.study(said, {cells: found}, exact, "cells per diameter")
        drift = speed[before].mean() / found - 1
        checks.below(f"{name}: change of speed over the last two tenths", drift, 0.005)
        ripple = np.ptp(speed[late]) / found
        checks.below(f"{name}: ripple of the speed in the last tenth", ripple, 0.01)
        tilted = np.abs(b.velocity[late, 0, :2]).max() / unit
        checks.below(f"{name}: sideways speed", tilted, 0.01)
        time = b.time * unit / diameter
        wanted = {"spectral elements, in this box": ([0.0, time[-1]], [exact] * 2)}
        curves = {name: (time, speed)}, wanted
        checks.figure("speed", "t sqrt((s - 1) g/D)", "-", *curves, smooth=True)
