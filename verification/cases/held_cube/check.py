"""Drag of a cube held in a stream at Reynolds number 2e4 against Hoerner (1965)."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HOERNER = {"face on": 1.05, "edge on": 0.80}  # on the projected area
BLOCKAGE = 2.5  # Maskell (1963): the dynamic pressure rises by 2.5 C_d S/C
BAND = 0.1
SETTLED = 15.0  # edges of way after which the mean is taken


def in_the_box(drag: float, share: float) -> float:
    """Drag coefficient where the body fills a share of the section of the stream."""
    return drag * (1 + BLOCKAGE * drag * share)


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag and scatter of drag and lift of each run."""
    curves = {}
    drags: dict[str, dict[float, float]] = {}
    for run in runs:
        b, step = run.bodies, run.series.dt
        edge = float(run.value("shape", "size"))
        speed = float(run.value("boundary", "z_min_velocity")[2])
        density = float(run.value("fluid", "liquid_density"))
        pose = "edge on" if run.folder.name.startswith("edge_on") else "face on"
        area = edge**2 * (2**0.5 if pose == "edge on" else 1.0)
        width = run.grid.high - run.grid.low
        section = float(width[0] * width[1])
        cells = edge / float(run.grid.spacing[0])
        force = b.fluid_force[:, 0] / (0.5 * density * speed**2 * area)
        way = b.time * speed / edge
        late = way > SETTLED
        mean = (force[late] * step[late, None]).sum(axis=0) / step[late].sum()
        flow = pose + (", faces between planes" if abs(cells - round(cells)) > 0.01 else "")
        name = f"{flow}, {cells:.2g} cells per edge"
        wanted = in_the_box(HOERNER[pose], area / section)
        checks.close(f"{name}: drag coefficient", float(mean[2]), wanted, BAND)
        checks.below(
            f"{name}: scatter of the lift coefficient",
            float(np.hypot(*force[late, :2].std(axis=0))),
            0.3,
            counts=False,
        )
        drags.setdefault(flow, {})[cells] = float(mean[2])
        curves[name] = (way, force[:, 2])
    for flow, values in drags.items():
        if len(values) > 1:
            checks.study(f"drag coefficient {flow}", values, resolution="cells per edge")
    checks.figure("drag", "way / edge", "coefficient", curves)
