"""Fall of a block out of the air into deep water: free fall, energy, grid and coupling."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, size
from micstools.reading.reader import Run

G = 9.81
FREE_FALL_BAND, COUPLING_BAND, GRID_BAND = 0.005, 0.05, 0.05
WAYS = (0.05, 0.10, 0.15, 0.20)
"""Depths of the centre under the still water at which speeds are compared [m]."""
DEEP = 0.1
"""Depth from which the energy is judged: the hole behind the block has closed [m]."""
FACE_ON = 1.05
"""Drag coefficient of a cube that is held face on (Hoerner 1965)."""
VARIES = ("numerics coupling",)
"""The two couplings are compared."""


class Fall:
    """Speed over depth, and the energy that the fall has released and that is left."""

    def __init__(self, run: Run) -> None:
        """All arrays (T), one entry per row; depth of the centre under the still water [m]; `pull`
        is the weight under water over half the density and the front of an upright block [m2/s2].
        """
        b, block = run.bodies, run.shapes["block"]
        level, density = run.value("fluid", "water_level"), liquid(run)[0]
        z, self.speed = b.position[:, 0, 2], -b.velocity[:, 0, 2]
        self.time, self.way, self.depth = b.time, z[0] - z, level - z
        low = np.array([run.points(0, row)[:, 2].min() for row in range(b.time.size)])
        high = np.array([run.points(0, row)[:, 2].max() for row in range(b.time.size)])
        self.dry, self.under = low > level, high < level
        weight = float(b.mass[0]) * G
        lifted = density * G * block.volume
        raised = block.volume / float(np.prod((run.grid.high - run.grid.low)[:2]))
        released = weight * self.way - lifted * (self.depth + raised / 2)
        kinetic = run.series.kinetic_energy_fluid + run.series.kinetic_energy_bodies
        self.lost = 1 - kinetic / np.where(self.under, released, np.inf)
        squares = 5 if run.value("shape", "kind") == "hexapod" else 1
        self.pull = (weight - lifted) / (0.5 * density * squares * size(run) ** 2)

    def at(self, depth: float) -> float:
        """Speed at which the centre passes a depth [m/s]."""
        return float(np.interp(depth, self.depth, self.speed))


def check(runs: list[Run], checks: Checks) -> None:
    """Speeds in the air, at depths in the water, and what becomes of the energy."""
    falls: dict[str, dict[float, Fall]] = {}
    for run in runs:
        fall, kind, cells = Fall(run), run.value("shape", "kind"), cells_along(run, size(run))
        mics = run.value("numerics", "coupling") == "mics"
        name = f"{kind}, {cells:g} cells per edge" + (", coupling mics" if mics else "")
        last = int(np.flatnonzero(fall.dry)[-1])
        exact = np.sqrt(2 * G * fall.way[last])
        said = f"{name}: speed in the air [m/s]"
        checks.close(said, fall.speed[last], exact, FREE_FALL_BAND, not mics)
        lost = fall.lost[fall.depth > DEEP]
        checks.within(f"{name}: least share of energy lost", lost.min(), 0, 1)
        drag = np.mean([fall.pull / fall.at(depth) ** 2 for depth in WAYS])
        checks.close(f"{name}: weight under water over rho U^2 A/2", drag, FACE_ON, 0.2, False)
        falls.setdefault(kind + (", mics" if mics else ""), {})[cells] = fall
        title = "speed over depth of the centre under the still water"
        checks.figure(title, "m", "m/s", {name: (fall.depth, fall.speed)})
    for kind, of_kind in falls.items():
        fine = max(of_kind)
        for depth in WAYS:
            found = {cells: fall.at(depth) for cells, fall in of_kind.items()}
            title = f"{kind}: speed {1e3 * depth:.0f} mm under the surface [m/s]"
            checks.study(title, found, resolution="cells per edge")
            for cells in sorted(set(found) - {fine}):
                name = f"{title}, {cells:g} cells against {fine:g}"
                checks.close(name, found[cells], found[fine], GRID_BAND, cells > 5)
    whole, mics = (falls.get(kind, {}) for kind in ("hexapod", "hexapod, mics"))
    for cells in set(whole) & set(mics):
        for depth in WAYS:
            said = f"hexapod, {cells:g} cells: speed {1e3 * depth:.0f} mm under the surface, "
            said += "monolithic against mics [m/s]"
            ours, theirs = whole[cells].at(depth), mics[cells].at(depth)
            checks.close(said, ours, theirs, COUPLING_BAND, False)
