"""Drag of bodies in a liquid without viscosity, moved and held: none (d'Alembert)."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

QUICK = ("straight_08_*_50", "oblique_08_*_100", "cylinder_10_*_50")
BAND = {"sphere": 0.04, "cylinder": 0.06}
"""A tenth of the drag of a sphere at Reynolds numbers of 1e3 to 1e5; a cylinder drags more."""
APART = 0.03  # moved less held, which in truth are one and the same flow
SETTLED = 0.5  # diameters of way after which the start is over


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag coefficient of each run along the stream, and its lift; moved less held."""
    curves = {}
    drags: dict[tuple[str, str], float] = {}
    for run in runs:
        b = run.bodies
        kind = str(run.value("shape", "kind"))
        size = np.atleast_1d(run.value("shape", "size")).astype(float)
        diameter = float(size[0])
        area = diameter * float(size[1]) if kind == "cylinder" else np.pi * diameter**2 / 4
        density = float(run.value("fluid", "liquid_density"))
        stream = np.array(run.value("fluid", "velocity"), dtype=float)
        past = stream - b.velocity[-1, 0]
        speed = float(np.linalg.norm(past))
        along = past / speed
        way = b.time * speed / diameter
        force, step = b.fluid_force[:, 0] / (0.5 * density * speed**2 * area), run.series.dt
        late = way > SETTLED
        mean = (force[late] * step[late, None]).sum(axis=0) / step[late].sum()
        drag = float(mean @ along)
        courant = float(run.value("run", "cfl_max"))
        cells = round(diameter / float(run.grid.spacing[0]))
        oblique = ", oblique" if np.count_nonzero(np.abs(along) > 1e-9) > 1 else ""
        flow = f"{kind} of {cells} cells{oblique}, Courant number {courant:g}"
        how = "held" if stream.any() else "moved"
        checks.below(f"{flow}, {how}: drag coefficient", drag, BAND[kind])
        lift = float(np.abs(mean - drag * along).max())
        checks.below(f"{flow}, {how}: lift coefficient", lift, BAND[kind], counts=kind == "sphere")
        drags[flow, how] = drag
        curves[f"{flow}, {how}"] = (way[late], force[late] @ along)
    for flow in sorted({flow for flow, _ in drags}):
        if (flow, "moved") in drags and (flow, "held") in drags:
            checks.below(
                f"{flow}: drag coefficient, moved less held",
                drags[flow, "moved"] - drags[flow, "held"],
                APART,
                counts=flow.startswith("sphere"),
            )
    checks.figure("drag", "way / diameter", "coefficient", curves, {"exact": ([0.5, 3], [0, 0])})
