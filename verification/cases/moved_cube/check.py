"""Noise of the force on an upright cube whose flat faces cross planes of the grid."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

BAND = 0.1  # of the weight of the cube
G = 9.81


def check(runs: list[Run], checks: Checks) -> None:
    """Largest deviation of the force from its mean over a cell of way, after one edge of way."""
    for run in runs:
        b, h = run.bodies, float(run.grid.spacing[2])
        cells, cube = run.value("shape", "size") / h, run.shapes["cube"]
        speed, weight = -b.velocity[0, 0, 2], cube.density * cube.volume * G
        force, way = b.fluid_force[:, 0, 2] / weight, b.time * speed / h
        level = np.array([force[abs(way - w) <= 0.5].mean() for w in way])
        late = (way >= cells) & (way < way[-1] - 0.5)
        name = f"{cells:.3g} cells per edge"
        noise = (force - level)[late]
        checks.below(f"{name}: largest noise of the force, in weights", abs(noise).max(), BAND)
        checks.below(f"{name}: its scatter", noise.std(), BAND, counts=False)
        checks.figure("force", "way / edge", "weights", {name: (way / cells, force)})
