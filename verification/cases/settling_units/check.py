"""Speed at which concrete units fall through water: coarse grids against fine ones."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid
from micstools.reading.reader import Run

QUICK = ()  # its figures compare with finer cells
BANDS = {12.0: 0.15, 24.0: 0.10}  # of the speed with half the cells, by the finer grid
MASKELL = 2.5  # rise of the dynamic pressure over C_d S/C
EXPECTED = {  # drag coefficient on the sphere of the same volume, see README.md
    "tetrapod": (0.85, 1.1),
    "dolos": (1.21, 2.38),
    "hexapod": (1.18, 2.76),
    "reef_cube": (2.06, 6.2),
    "cube": (1.30, 1.43),
}
QUARTERS = 4  # of the second half of a run, whose means tell the scatter
G = 9.81


def check(runs: list[Run], checks: Checks) -> None:
    """Mean speed over the second half of each run, and the drag coefficient that belongs to it."""
    speeds: dict[str, dict[float, float]] = {}
    for run in runs:
        b, unit, width = run.bodies, run.shapes["unit"], run.grid.high - run.grid.low
        kind, height = run.value("shape", "kind"), float(width[0]) / 4
        speed = run.value("boundary", "z_min_velocity")[2] - b.velocity[:, 0, 2]
        part = np.floor((b.time / b.time[-1] - 0.5) * 2 * QUARTERS).clip(-1, QUARTERS - 1)
        means = [
            np.average(speed[part == k], weights=run.series.dt[part == k]) for k in range(QUARTERS)
        ]
        mean, cells = np.mean(means), cells_along(run, height)
        length = f"{height:.2g} m" if height > 1 else f"{1000 * height:.2g} mm"
        flow = f"{kind.replace('_', ' ')} of {length}"
        name = f"{flow}, {cells:g} cells"
        speeds.setdefault(flow, {})[cells] = mean
        diameter = (6 * unit.volume / np.pi) ** (1 / 3)
        drag = 4 / 3 * (unit.density / liquid(run)[0] - 1) * G * diameter / mean**2
        blocked = 2 * MASKELL * np.pi / 4 * diameter**2 / (width[0] * width[1])
        wide = (np.sqrt(1 + 2 * blocked * drag) - 1) / blocked
        checks.within(f"{name}: drag in a wide tank", wide, *EXPECTED[kind], counts=False)
        checks.below(f"{name}: scatter of partial means", np.std(means) / mean, 0.05, counts=False)
        curves = {name: (b.time * mean / height, speed / mean)}
        checks.figure("speed over its mean", "way / height", "-", curves)
    for flow, found in speeds.items():
        for cells in found:
            if 2 * cells in found:
                name = f"{flow}: speed [m/s], {cells:g} cells against {2 * cells:g}"
                checks.close(name, found[cells], found[2 * cells], BANDS[2 * cells])
        checks.study(f"{flow}: speed [m/s]", found, resolution="cells along the unit")
