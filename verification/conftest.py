"""How the tests of the program run beside each other.

`verification/run_tests` runs as many tests at once as there are cores. So each runs on one thread
unless it is about threads, those that need several processes take turns (the group `ranks`), and
the long ones start first.
"""

import os

import pytest

from run_cases import MPI_SETTINGS
from shared_runs import shared_run  # noqa: F401

os.environ.update(MPI_SETTINGS)
os.environ["OMP_NUM_THREADS"] = "1"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long tests first; `@pytest.mark.cost(SECONDS)` tells how long on one core."""

    def cost(item: pytest.Item) -> float:
        mark = item.get_closest_marker("cost")
        return float(mark.args[0]) if mark else 0.0

    items.sort(key=cost, reverse=True)
