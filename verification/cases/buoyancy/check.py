"""Force and torque of still water on held bodies against the displaced weight.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.buoyancy import buoyancy_rows  # noqa: E402
from micstools.checks import Checks, main, sound  # noqa: E402
from micstools.reader import Run  # noqa: E402


def check(runs: list[Run]) -> Checks:
    """Every body of every run at its last row."""
    checks = Checks("buoyancy")
    for run in runs:
        buoyancy_rows(run, checks)
        sound(run, checks)
    return checks


if __name__ == "__main__":
    main(check)
