"""Films of water under and beside resting blocks, and in the pores of a bed, come to rest."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

FILM = 0.5, 1 - 1e-6  # solid share of a cell: mostly solid, not sealed
REST = 1e-3  # speed of a block at rest [m/s]


def check(runs: list[Run], checks: Checks) -> None:
    """Fastest water in cells that are mostly solid over the fastest in cells without solid."""
    for run in runs:
        name, state = run.folder.name, run.restart()
        alpha, speed = state["flow/alpha"][0], np.linalg.norm(state["flow/u"], axis=0)
        wet = state["flow/c"][0] > 0.5
        film = speed[wet & (alpha > FILM[0]) & (alpha < FILM[1])].max()
        around = speed[wet & (alpha <= 0.0)].max()
        checks.below(f"{name}: films over the water around", film / around, 1.0)
        blocks = np.abs(run.bodies.velocity[-1]).max()
        checks.below(f"{name}: blocks at the end [m/s]", blocks, REST)
        checks.true(f"{name}: water moves", around > 10 * REST, f"{around:.3g} m/s")
