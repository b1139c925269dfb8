"""Flow between plates and in ducts, driven by a body force along a periodic direction."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from micstools.reading.profiles import cubic, with_ends
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

BAND, BAND_CELLS = 0.01, 20  # of the largest velocity of the profile
QUICK = ("case", "duct_*")
THIN = 3.0  # cells: a thinner layer at the wall is shown for information
TIMES = {"t0p02": 0.02, "t0p05": 0.05, "t0p1": 0.1, "steady": 1.0}


def exact(y: Array, t: float) -> Array:
    """u nu/(G h^2) at heights y/h after nu t/h^2 = t: parabola less what the start still lacks."""
    odd = np.arange(1, 400, 2)[:, None]
    lack = 4.0 / (odd * np.pi) ** 3 * np.sin(odd * np.pi * y) * np.exp(-((odd * np.pi) ** 2) * t)
    profile: Array = 0.5 * y * (1.0 - y) - lack.sum(axis=0)
    return profile


def plane(run: Run, checks: Checks) -> None:
    """Profiles of the start and the steady one at the cell centres."""
    z, worst = run.grid.centres[2], 0.0
    cells = z.size
    for t in TIMES.values():
        fields = run.fields_at(t)
        wanted, found = exact(z, fields.time), fields.velocity[:, 0, 0, 0]
        worst = np.abs(found - wanted).max() / wanted.max()
        if cells >= BAND_CELLS:
            thin = np.sqrt(t) * cells < THIN
            label = f"plane, {cells} cells, nu t/h2 = {t:g}: largest error"
            checks.below(label, worst, BAND, counts=not thin)
        if cells == BAND_CELLS:
            curves = {f"t = {t:g}": (z, found)}, {f"exact, t = {t:g}": (z, wanted)}
            checks.figure("start between plates", "z/h", "u nu/(G h2)", *curves)
    checks.study("plane: error of the steady profile", {cells: worst}, 0.0)


def duct(run: Run, checks: Checks) -> None:
    """Centre and mean velocity of the steady flow."""
    u = run.fields_at(run.field_times[-1]).velocity[:, :, 0, 0]
    y, z = run.grid.centres[1:]
    width = float(run.grid.y[-1])
    across = with_ends(0.0, cubic(np.array([0.5]), z, u.T)[:, 0], 0.0)
    centre = cubic(np.array([0.5 * width]), with_ends(0.0, y, width), across)[0]
    for row in table(__file__, "duct.csv").itertuples():
        if abs(row.aspect - width) < 1e-9:
            checks.close(f"duct {width:g}: centre velocity", centre, row.centre, BAND)
            checks.close(f"duct {width:g}: mean velocity", u.mean(), row.mean, BAND)


def check(runs: list[Run], checks: Checks) -> None:
    """Plane runs and ducts."""
    # The series must be that of the table
    rows = table(__file__, "plane.csv")
    for name, t in TIMES.items():
        late = 10.0 if name == "steady" else t
        far = np.abs(exact(rows.y_over_h.to_numpy(), late) - rows[name]).max()
        checks.below(f"series against the table, {name}", far, 1e-7)
    for run in runs:
        (duct if run.folder.name.startswith("duct") else plane)(run, checks)
