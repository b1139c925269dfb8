"""Force and torque of still water on held bodies against the displaced weight."""

from measures.buoyancy import buoyancy_rows
from measures.checks import Checks
from micstools.reading.reader import Run


def check(runs: list[Run], checks: Checks) -> None:
    """Every body of every run at its last row."""
    for run in runs:
        buoyancy_rows(run, checks)
