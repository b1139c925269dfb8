"""Numbers of a run that many checks need."""

from pathlib import Path

import numpy as np
import pandas as pd

from measures.checks import Checks
from micstools.reading.reader import Bodies, Run
from micstools.shapes.geometry import Array


def table(check: str, name: str) -> pd.DataFrame:
    """The CSV file of a name beside a check, whose lines with a # name the source."""
    return pd.read_csv(Path(check).with_name(name), comment="#")


def liquid(run: Run) -> tuple[float, float]:
    """Density [kg/m3] and viscosity [Pa s] of the liquid."""
    density, viscosity = (run.value("fluid", f"liquid_{name}") for name in ("density", "viscosity"))
    return float(density), float(viscosity)


def size(run: Run) -> float:
    """The first length of the size of the shape [m]."""
    return float(np.ravel(run.value("shape", "size"))[0])


def cells(run: Run, length: float) -> float:
    """Cells along a length [m]."""
    return round(length / float(run.grid.spacing[2]), 1)


def added_mass(run: Run, along: int = 2) -> float:
    """Of a body let go, over the displaced mass, from its acceleration at the last row, a =
    g (1 - s)/(s + Ca)."""
    b = run.bodies
    ratio = run.shapes[b.shape[0]].density / liquid(run)[0]
    return 9.81 * (1 - ratio) / float(b.velocity[-1, 0, along] / b.time[-1]) - ratio


def acceleration(b: Bodies) -> Array:
    """Mean acceleration from 0.3 to 0.6 s (N, 3) [m/s2]."""
    i, j = b.row(0.3), b.row(0.6)
    return np.asarray((b.velocity[j] - b.velocity[i]) / (b.time[j] - b.time[i]))


def creep(b: Bodies, k: int) -> float:
    """Mean speed of a body from 1 to 2 s [m/s]."""
    i, j = b.row(1.0), b.row(2.0)
    way = np.linalg.norm(b.position[j, k] - b.position[i, k])
    return float(way / (b.time[j] - b.time[i]))


def still_rows(run: Run, checks: Checks, limit: float) -> None:
    """Largest speed of the fluid at all written times and in the final state."""
    name = run.folder.name
    written = max(float(np.abs(run.fields_at(t).velocity).max()) for t in run.field_times)
    checks.below(f"{name}: largest speed at any time [m/s]", written, limit)
    final = float(np.abs(run.restart()["flow/u"]).max())
    checks.below(f"{name}: largest speed at the end [m/s]", final, limit)
