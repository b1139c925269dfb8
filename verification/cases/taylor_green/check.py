"""Decay of Taylor-Green vortices: order of accuracy, amplitude and kinetic energy."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from micstools.reading.reader import Run

VARIES = ("numerics momentum",)
QUICK = ("cells_16", "cells_32", "ismac_16", "ismac_32", "long_*")
AMPLITUDE_BAND, BAND_CELLS = 0.01, 32
LEAST_ORDER = {"cells": 1.9, "courant": 1.9, "ismac": 1.9, "long": 0.9}
LABEL = {
    "cells": "dt as h^2",
    "courant": "longest step",
    "ismac": "C-ISMAC, dt as h^2",
    "long": "C-ISMAC, Courant number 2",
}
BANDS = ("cells", "ismac")  # kinds whose amplitude at BAND_CELLS counts


def reference(run: Run) -> tuple[float, float]:
    """Amplitude and mean kinetic energy at the end of a run, a row of the table."""
    row = table(__file__, "reference.csv").set_index("t").loc[round(float(run.series.time[-1]), 9)]
    return float(row.amp_nu0p05), float(row.ke_nu0p05)


def compare(run: Run) -> tuple[float, float, float]:
    """Error in the root mean square, amplitude, and mean kinetic energy at the end."""
    fields = run.fields_at(run.field_times[-1])
    x, z = run.grid.centres[0][None, :], run.grid.centres[2][:, None]
    u, w = fields.velocity[:, 0, :, 0], fields.velocity[:, 0, :, 2]
    shape_u, shape_w = np.cos(x) * np.sin(z), -np.sin(x) * np.cos(z)
    true = reference(run)[0]
    error = np.sqrt(((u - true * shape_u) ** 2 + (w - true * shape_w) ** 2).mean())
    amplitude = 2.0 * (u * shape_u + w * shape_w).mean()
    return float(error), float(amplitude), float(0.5 * (u**2 + w**2).mean())


def check(runs: list[Run], checks: Checks) -> None:
    """Errors over the grids, and bands on one of them."""
    errors: dict[str, dict[float, float]] = {kind: {} for kind in LABEL}
    for run in runs:
        kind, cells = run.folder.name.split("_")[0], run.grid.x.size - 1
        errors[kind][cells], amplitude, energy = compare(run)
        (size, power), label, counts = reference(run), LABEL[kind], kind in BANDS
        if cells == BAND_CELLS:
            said = f"{cells} cells, {label}"
            checks.close(f"amplitude, {said}", amplitude, size, AMPLITUDE_BAND, counts)
            checks.close(f"kinetic energy, {said}", energy, power, 2 * AMPLITUDE_BAND, counts)
    for kind, found in errors.items():
        if len(found) > 1:
            cells, label, least = sorted(found), LABEL[kind], LEAST_ORDER[kind]
            slope = -np.polyfit(np.log(cells), np.log([found[n] for n in cells]), 1)[0]
            said = f"order of accuracy, {label}, {cells[0]} to {cells[-1]} cells, at least {least}"
            checks.true(said, slope >= least, f"{slope:.2f}", counts=kind != "courant")
            checks.study(f"error of the velocity, {label}", found, 0.0)
