"""Lid-driven cavity at Re = 100 and 1000 against an independent solution."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from micstools.reading.profiles import Array, cubic, with_ends
from micstools.reading.reader import Run

BANDS = {100: 0.01 * 64, 1000: 0.03 * 128}  # lid speeds, times the cells along a side
MIDDLE = np.array([0.5])


def reference(reynolds: int) -> dict[str, Array]:
    """Coordinate and velocity (n, 2) along the two middle lines."""
    lines = table(__file__, f"re{reynolds}.csv").groupby("line", sort=False)
    return {name: points[["coordinate", "own"]].to_numpy() for name, points in lines}


def middle_lines(run: Run) -> dict[str, tuple[Array, Array]]:
    """u over height on x = 0.5 and w over x on z = 0.5 at the end, walls included."""
    fields = run.fields_at(run.field_times[-1])
    x, _, z = run.grid.centres
    u, w = fields.velocity[:, 0, :, 0], fields.velocity[:, 0, :, 2]
    return {
        "u_at_x0p5": (with_ends(0, z, 1), with_ends(0, cubic(MIDDLE, x, u)[:, 0], 1)),
        "v_at_y0p5": (with_ends(0, x, 1), with_ends(0, cubic(MIDDLE, z, w.T)[:, 0], 0)),
    }


def compare(run: Run, reynolds: int, checks: Checks) -> None:
    """Profiles against the reference, and rest of the flow."""
    cells, worst = run.grid.x.size - 1, 0.0
    for name, points in reference(reynolds).items():
        places, values = middle_lines(run)[name]
        error = np.abs(cubic(points[:, 0], places, values) - points[:, 1]).max()
        worst = max(worst, error)
        label = f"Re {reynolds}, {cells} cells, {name}: largest error [lid speeds]"
        checks.below(label, error, BANDS[reynolds] / cells)
    energy, time = run.series.kinetic_energy_fluid, run.series.time / run.series.time[-1]
    before, last = energy[(time > 0.8) & (time <= 0.9)].mean(), energy[time > 0.9].mean()
    label = f"Re {reynolds}, {cells} cells: energy of the last tenth against that before"
    checks.below(label, last / before - 1.0, 1e-3)
    checks.study(f"Re {reynolds}: largest error [lid speeds]", {cells: worst}, 0.0)


def check(runs: list[Run], checks: Checks) -> None:
    """Profiles along the middle lines at steady state, for each grid."""
    for reynolds in BANDS:
        mine = [r for r in runs if round(1 / r.value("fluid", "liquid_viscosity")) == reynolds]
        for run in mine:
            compare(run, reynolds, checks)
        for finest in sorted(mine, key=lambda run: run.grid.x.size)[-1:]:
            ours, label = middle_lines(finest), f"{finest.grid.x.size - 1} cells"
            for name, symbol in {"u_at_x0p5": "u over z", "v_at_y0p5": "w over x"}.items():
                title, wanted = f"Re = {reynolds}: {symbol}", reference(reynolds)[name]
                axes = "coordinate / side", "velocity / lid speed"
                checks.figure(title, *axes, {label: ours[name]}, {"reference": wanted.T})
