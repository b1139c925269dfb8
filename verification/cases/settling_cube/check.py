"""Terminal speed of cubes and hexapods against the correlation of Haider and Levenspiel (1989)."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

QUICK = ("Re30_04",)
BAND = 0.1
CUBE = (np.pi / 6) ** (1 / 3)  # sphericity
HEXAPOD = 0.589877


def drag_coefficient(reynolds: float, f: float) -> float:
    """Of a block with sphericity f, on the sphere of the same volume."""
    a = np.exp(2.3288 - 6.4581 * f + 2.4486 * f**2)
    b = 0.0964 + 0.5565 * f
    c = np.exp(4.905 - 13.8944 * f + 18.4222 * f**2 - 10.2599 * f**3)
    d = np.exp(1.4681 + 12.2584 * f - 20.7322 * f**2 + 15.8855 * f**3)
    return float(24 / reynolds * (1 + a * reynolds**b) + c / (1 + d / reynolds))


def check(runs: list[Run], checks: Checks) -> None:
    """Drag coefficient at the mean speed of the second half of each run."""
    curves = {}
    coefficients: dict[str, dict[float, float]] = {}
    for run in runs:
        b, block = run.bodies, run.shapes["block"]
        case = run.folder.name.rpartition("_")[0] or "Re100"
        edge = float(run.value("shape", "size"))
        diameter = (6 * block.volume / np.pi) ** (1 / 3)
        density = float(run.value("fluid", "liquid_density"))
        viscosity = float(run.value("fluid", "liquid_viscosity")) / density
        stream = float(run.value("boundary", "z_min_velocity")[2])
        speed = stream - b.velocity[:, 0, 2]
        late = b.time > 0.5 * b.time[-1]
        mean = float((speed[late] * run.series.dt[late]).sum() / run.series.dt[late].sum())
        cells = round(edge / float(run.grid.spacing[2]), 1)
        cd = 4 / 3 * (block.density / density - 1) * 9.81 * diameter / mean**2
        reynolds = mean * diameter / viscosity
        cube = run.value("shape", "kind") == "cube"
        exact = drag_coefficient(reynolds, CUBE if cube else HEXAPOD)
        name = f"{case.replace('_', ' ')}, {cells:g} cells per edge, Re = {reynolds:.4g}"
        counts = reynolds < 500 and cells > 7
        checks.close(f"{name}: drag coefficient", cd, exact, BAND, counts)
        coefficients.setdefault(case, {})[cells] = cd
        curves[f"{case.replace('_', ' ')}, {cells:g} cells"] = (
            b.time * mean / diameter,
            speed / mean,
        )
    for case, values in coefficients.items():
        title = f"{case.replace('_', ' ')}: drag coefficient"
        checks.study(title, values, resolution="cells per edge")
    checks.figure("speed over its mean", "t U/de", "-", curves)
