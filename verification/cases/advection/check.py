"""Liquid carried by given velocities: error, order, volume and bounds.

The driver `advect_surface` moves the liquid with the transport of the program; no case file is run.
"""

import subprocess
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

ROOT = Path(__file__).resolve().parents[3]

COST = 360.0
"""Seconds on one core; `make verify` asks."""

ORDERS = {"zalesak": 0.9, "vortex": 1.5, "deformation": 1.5}  # least, coarsest to finest grid
PUBLISHED = {"zalesak": "zalesak_disk_2D", "vortex": "vortex_T8_2D", "deformation": "enright_3D"}
VOLUME_BAND = 1e-12
BOUNDS_BAND = 1e-12  # of a cell
TABLE = Path(__file__).with_name("B3_vof_advection_published_errors.csv")


def rows() -> list[list[str]]:
    """Build and run the driver; its rows."""
    program = "build/serial/advect_surface"
    subprocess.run(["make", "-s", program], cwd=ROOT, check=True, capture_output=True)
    done = subprocess.run(
        [str(ROOT / program)], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return [line.split(",") for line in done.stdout.splitlines()[1:]]


def check(runs: list[Run], checks: Checks) -> None:
    """Errors over resolution beside published ones, which are from memory: orders of magnitude."""
    del runs
    found = rows()
    lines = TABLE.read_text().splitlines()
    published = [line.split(",") for line in lines if line[0] != "#"][1:]
    for test, least in ORDERS.items():
        errors = {float(row[1]): float(row[2]) for row in found if row[0] == test}
        cells = sorted(errors)
        order = np.log(errors[cells[0]] / errors[cells[-1]]) / np.log(cells[-1] / cells[0])
        checks.within(f"{test}: order, {cells[0]:g} to {cells[-1]:g} cells", order, least, 9.0)
        for row in published:
            if row[0] == PUBLISHED[test] and float(row[1]) in errors and "PLIC" in row[2]:
                ours, theirs = errors[float(row[1])], float(row[3])
                label = f"{test}: error at {row[1]} cells, others' {theirs:g}"
                checks.within(label, ours, 0.0, 2.0 * theirs, counts=False)
        checks.study(f"{test}: error", errors, 0.0)
    change = max(abs(float(row[3])) for row in found)
    checks.below("largest change of the volume", change, VOLUME_BAND)
    past = max(float(row[4]) for row in found)
    checks.below("largest share past 0 and 1", past, BOUNDS_BAND)
