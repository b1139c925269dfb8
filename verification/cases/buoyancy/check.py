"""Force and torque of still water on held bodies against the displaced weight.

usage: python check.py RUN [RUN ...]
"""

from measures.buoyancy import buoyancy_rows
from measures.checks import Checks, main, sound
from micstools.reading.reader import Run


def check(runs: list[Run]) -> Checks:
    """Every body of every run at its last row."""
    checks = Checks("buoyancy")
    for run in runs:
        buoyancy_rows(run, checks)
        sound(run, checks)
    return checks


if __name__ == "__main__":
    main(check)
