"""Liquid carried by given velocities: error, order, volume and bounds.

The driver `advect_surface` moves the liquid with the transport of the program; no case file is run.
"""

import io
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd

from measures.checks import Checks
from measures.facts import table
from micstools.reading.reader import Run

ROOT = Path(__file__).resolve().parents[3]

COST = 360.0
"""Seconds on one core; `make verify` asks."""

ORDERS = {"zalesak": 0.9, "vortex": 1.5, "deformation": 1.5}  # least, coarsest to finest grid
LARGEST = {"zalesak": 0.0146, "vortex": 0.00236, "deformation": 0.0032}  # a fifth above today's
PUBLISHED = {"zalesak": "zalesak_disk_2D", "vortex": "vortex_T8_2D", "deformation": "enright_3D"}
VOLUME_BAND = 1e-12
BOUNDS_BAND = 1e-12  # of a cell


def rows() -> pd.DataFrame:
    """Build and run the driver; its rows."""
    program = "build/serial/advect_surface"
    subprocess.run(["make", "-s", program], cwd=ROOT, check=True, capture_output=True)
    done = subprocess.run([str(ROOT / program)], cwd=ROOT, check=True, capture_output=True)
    names = ["test", "cells", "error", "change", "past"]
    return pd.read_csv(io.BytesIO(done.stdout), header=0, names=names)


def check(runs: list[Run], checks: Checks) -> None:
    """Errors over resolution beside published ones, which are from memory: orders of magnitude."""
    del runs
    found, published = rows(), table(__file__, "B3_vof_advection_published_errors.csv")
    for test, least in ORDERS.items():
        here = found[found.test == test]
        errors = dict(zip(here.cells.astype(float), here.error, strict=True))
        cells = sorted(errors)
        order = np.log(errors[cells[0]] / errors[cells[-1]]) / np.log(cells[-1] / cells[0])
        checks.within(f"{test}: order, {cells[0]:g} to {cells[-1]:g} cells", order, least, 9.0)
        finest = f"{test}: error at {cells[-1]:g} cells"
        checks.within(finest, errors[cells[-1]], 0.0, LARGEST[test])
        for name, n, method, theirs, *_ in published.itertuples(index=False):
            if name == PUBLISHED[test] and n in errors and "PLIC" in method:
                label = f"{test}: error at {n} cells, others' {theirs:g}"
                checks.within(label, errors[n], 0.0, 2.0 * theirs, counts=False)
        checks.study(f"{test}: error", errors, 0.0)
    checks.below("largest change of the volume", found.change.abs().to_numpy().max(), VOLUME_BAND)
    checks.below("largest share past 0 and 1", found.past.to_numpy().max(), BOUNDS_BAND)
