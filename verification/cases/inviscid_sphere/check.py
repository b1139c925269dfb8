"""Drag of bodies in a liquid without viscosity, moved and held: none (d'Alembert)."""

import numpy as np

from measures.checks import Checks
from measures.facts import liquid, size
from micstools.reading.reader import Run

QUICK = ("straight_08_*_50", "oblique_08_*_100", "cylinder_10_*_50")
BAND = {"sphere": 0.04, "cylinder": 0.06}
"""A tenth of the drag of a sphere at Reynolds numbers of 1e3 to 1e5; a cylinder drags more."""
APART = 0.03  # moved less held, which in truth are one and the same flow
SETTLED = 0.5  # diameters of way after which the start is over


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag coefficient of each run along the stream, and its lift; moved less held."""
    drags: dict[tuple[str, str], float] = {}
    for run in runs:
        b, kind, diameter = run.bodies, run.value("shape", "kind"), size(run)
        area = np.pi * diameter**2 / 4
        if kind == "cylinder":
            area = np.prod(run.value("shape", "size"))
        stream = np.array(run.value("fluid", "velocity"), dtype=float)
        past = stream - b.velocity[-1, 0]
        speed = np.linalg.norm(past)
        along, way = past / speed, b.time * speed / diameter
        force, late = b.fluid_force[:, 0] / (0.5 * liquid(run)[0] * speed**2 * area), way > SETTLED
        mean = np.average(force[late], axis=0, weights=run.series.dt[late])
        drag = mean @ along
        cells = round(diameter / float(run.grid.spacing[0]))
        oblique = ", oblique" if np.count_nonzero(np.abs(along) > 1e-9) > 1 else ""
        flow = f"{kind} of {cells} cells{oblique}, Courant number {run.value('run', 'cfl_max'):g}"
        how = "held" if stream.any() else "moved"
        checks.below(f"{flow}, {how}: drag coefficient", drag, BAND[kind])
        lift = np.abs(mean - drag * along).max()
        checks.below(f"{flow}, {how}: lift coefficient", lift, BAND[kind], kind == "sphere")
        drags[flow, how] = drag
        curves = {f"{flow}, {how}": (way[late], force[late] @ along)}, {"exact": ([0.5, 3], [0, 0])}
        checks.figure("drag", "way / diameter", "coefficient", *curves)
    for flow in sorted({flow for flow, _ in drags}):
        if (flow, "moved") in drags and (flow, "held") in drags:
            apart = drags[flow, "moved"] - drags[flow, "held"]
            said = f"{flow}: drag coefficient, moved less held"
            checks.below(said, apart, APART, flow.startswith("sphere"))
