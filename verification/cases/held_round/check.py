"""Drag of round bodies at high Reynolds numbers, held in a stream and moved through the grid."""

from dataclasses import dataclass

import numpy as np

from measures.checks import Checks
from measures.facts import liquid
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

QUICK = ("sphere_06", "moved_06")
DRAG = {"sphere": 0.40, "finite cylinder": 0.68, "cylinder": 1.15}  # in a wide stream
DRAG_AT_1E3 = 0.45  # of the sphere
BAND = 0.15
BAND_AT_1E3 = 0.10  # at 8 cells
SPREAD = 0.10  # of the sphere over 6, 8 and 12 cells
APART = 0.08  # of the drag, moved less held
MASKELL = 2.5  # rise of the dynamic pressure over C_d S/C
QUARTERS = 4  # of the second half of a run, whose means tell the scatter


@dataclass(frozen=True)
class Flow:
    """One run in units of its diameter, speed and dynamic pressure."""

    body: str  # a key of DRAG
    reynolds: float
    cells: float  # per diameter
    moved: bool  # through the grid
    half: bool  # steps of half a cell
    share: float  # of the section of the stream that the body fills
    way: Array  # at the end of each step (T) [diameters]
    step: Array  # (T) [s]
    force: Array  # coefficients along x, the stream and z (T, 3), as found in the box

    @property
    def name(self) -> str:
        """Everything but the cells."""
        exponent = round(np.log10(self.reynolds))
        ending = (", moved" if self.moved else "") + (", half steps" if self.half else "")
        return f"{self.body}, Re 1e{exponent}{ending}"

    def drag(self, begin: float, end: float) -> float:
        """Mean drag coefficient in a wide stream from one way to another."""
        now = (self.way > begin) & (self.way <= end)
        found = float(np.average(self.force[now, 1], weights=self.step[now]))
        if self.body == "cylinder":  # Allen and Vincenti
            return found * (1 - found * self.share / 2 - 2.5 * self.share**2)
        blocked = 2 * MASKELL * self.share
        return float((np.sqrt(1 + 2 * blocked * found) - 1) / blocked)

    @property
    def scatter(self) -> float:
        """Standard deviation of the means of the quarters of the second half."""
        ends = np.linspace(0.5, 1.0, QUARTERS + 1) * self.way[-1]
        return float(np.std([self.drag(a, b) for a, b in zip(ends, ends[1:], strict=False)]))


def flow_of(run: Run) -> Flow:
    """What the check needs of a run."""
    b, width = run.bodies, run.grid.high - run.grid.low
    size = np.atleast_1d(np.asarray(run.value("shape", "size"), float))
    body, area = "sphere", np.pi / 4 * size[0] ** 2
    if len(size) > 1 and size[1] > 0:
        body = "cylinder" if size[1] >= width[2] else "finite cylinder"
        area = size[0] * size[1]
    stream = float(run.value("boundary", "y_min_velocity")[1])
    speed = stream - float(b.velocity[-1, 0, 1])
    density, viscosity = liquid(run)
    return Flow(
        body=body,
        reynolds=density * speed * size[0] / viscosity,
        cells=round(float(size[0] / run.grid.spacing[0]), 1),
        moved=stream == 0,
        half=float(run.value("run", "cfl_max")) < 1,
        share=float(area / (width[0] * width[2])),
        way=b.time * speed / size[0],
        step=run.series.dt,
        force=b.fluid_force[:, 0] / (0.5 * density * speed**2 * area),
    )


def check(runs: list[Run], checks: Checks) -> None:
    """Mean drag of the second half of each run, in a wide stream; lift of the long cylinder."""
    flows, drags = [flow_of(run) for run in runs], {}
    for flow in flows:
        name = f"{flow.name}, {flow.cells:g} cells"
        drag = flow.drag(flow.way[-1] / 2, flow.way[-1])
        drags.setdefault(flow.name, {})[flow.cells] = drag
        checks.study(f"{flow.name}: drag", {flow.cells: drag}, resolution="cells per diameter")
        checks.figure("drag", "way / D", "-", {name: (flow.way, flow.force[:, 1])})
        if flow.moved:
            window = flow.way[-1] / 2, flow.way[-1]  # the same way of the held one
            for held in flows:
                same = (held.body, held.reynolds, held.cells, held.half)
                if not held.moved and same == (flow.body, flow.reynolds, flow.cells, flow.half):
                    checks.close(f"{name}: drag as held", drag, held.drag(*window), APART)
        elif flow.reynolds < 5e3:
            checks.close(f"{name}: drag", drag, DRAG_AT_1E3, BAND_AT_1E3, flow.cells == 8)
        else:
            counts = flow.body != "cylinder" or flow.cells > 11
            checks.close(f"{name}: drag", drag, DRAG[flow.body], BAND, counts)
        checks.below(f"{name}: scatter of partial means", flow.scatter / drag, 0.05, False)
        if flow.body == "cylinder":
            lift = flow.force[flow.way > flow.way[-1] / 2, 0]
            turns = int((lift[1:] * lift[:-1] < 0).sum())
            checks.true(f"{name}: lift changes sign", turns > 2, f"{turns} times", flow.cells > 11)
            curve = {name: (flow.way, flow.force[:, 0])}
            checks.figure("lift of the long cylinder", "way / D", "-", curve)
    spheres = drags.get("sphere, Re 1e4", {})
    if {6, 8, 12} <= set(spheres):
        spread = np.ptp([*spheres.values()]) / np.mean([*spheres.values()])
        checks.below("sphere, Re 1e4: spread over 6, 8 and 12 cells", spread, SPREAD)
