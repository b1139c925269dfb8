"""Drag of a cube held in a stream at Reynolds number 2e4 against Hoerner (1965)."""

import numpy as np

from measures.checks import Checks
from measures.facts import liquid, size
from micstools.reading.reader import Run

HOERNER = {"face on": 1.05, "edge on": 0.80}  # on the projected area
BLOCKAGE = 2.5  # Maskell (1963): the dynamic pressure rises by 2.5 C_d S/C
BAND = 0.1
SETTLED = 15.0  # edges of way after which the mean is taken


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag and scatter of drag and lift of each run."""
    for run in runs:
        b, edge, speed = run.bodies, size(run), run.value("boundary", "z_min_velocity")[2]
        pose = "edge on" if run.folder.name.startswith("edge_on") else "face on"
        area = edge**2 * (2**0.5 if pose == "edge on" else 1.0)
        width = run.grid.high - run.grid.low
        cells = edge / float(run.grid.spacing[0])
        force = b.fluid_force[:, 0] / (0.5 * liquid(run)[0] * speed**2 * area)
        way = b.time * speed / edge
        late = way > SETTLED
        drag = np.average(force[late, 2], weights=run.series.dt[late])
        flow = pose + (", faces between planes" if abs(cells - round(cells)) > 0.01 else "")
        name = f"{flow}, {cells:.2g} cells per edge"
        # where the body fills a share of the section of the stream
        wanted = HOERNER[pose] * (1 + BLOCKAGE * HOERNER[pose] * area / (width[0] * width[1]))
        checks.close(f"{name}: drag coefficient", drag, wanted, BAND)
        scatter = np.hypot(*force[late, :2].std(axis=0))
        checks.below(f"{name}: scatter of the lift coefficient", scatter, 0.3, counts=False)
        checks.study(f"drag coefficient {flow}", {cells: drag}, resolution="cells per edge")
        checks.figure("drag", "way / edge", "coefficient", {name: (way, force[:, 2])})
