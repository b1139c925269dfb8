"""Speed at which concrete units fall through water: coarse grids against fine ones."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

QUICK = ("dolos_lab_06",)
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
    curves = {}
    speeds: dict[str, dict[float, float]] = {}
    for run in runs:
        b, unit, width = run.bodies, run.shapes["unit"], run.grid.high - run.grid.low
        kind = run.value("shape", "kind")
        height = float(width[0]) / 4
        stream = float(run.value("boundary", "z_min_velocity")[2])
        speed, step = stream - b.velocity[:, 0, 2], run.series.dt
        part = np.floor((b.time / b.time[-1] - 0.5) * 2 * QUARTERS).clip(-1, QUARTERS - 1)
        means = [
            float((speed[part == k] * step[part == k]).sum() / step[part == k].sum())
            for k in range(QUARTERS)
        ]
        mean = float(np.mean(means))
        cells = round(height / float(run.grid.spacing[2]), 1)
        size = f"{height:.2g} m" if height > 1 else f"{1000 * height:.2g} mm"
        flow = f"{kind.replace('_', ' ')} of {size}"
        name = f"{flow}, {cells:g} cells"
        speeds.setdefault(flow, {})[cells] = mean
        diameter = (6 * unit.volume / np.pi) ** (1 / 3)
        density = float(run.value("fluid", "liquid_density"))
        drag = 4 / 3 * (unit.density / density - 1) * G * diameter / mean**2
        blocked = 2 * MASKELL * np.pi / 4 * diameter**2 / float(width[0] * width[1])
        wide = float((np.sqrt(1 + 2 * blocked * drag) - 1) / blocked)
        checks.within(f"{name}: drag in a wide tank", wide, *EXPECTED[kind], counts=False)
        scatter = float(np.std(means)) / mean
        checks.below(f"{name}: scatter of partial means", scatter, 0.05, counts=False)
        curves[name] = (b.time * mean / height, speed / mean)
    for flow, found in speeds.items():
        for cells in found:
            if 2 * cells in found:
                name = f"{flow}: speed [m/s], {cells:g} cells against {2 * cells:g}"
                checks.close(name, found[cells], found[2 * cells], BANDS[2 * cells])
        if len(found) > 1:
            checks.study(f"{flow}: speed [m/s]", found, resolution="cells along the unit")
    checks.figure("speed over its mean", "way / height", "-", curves)
