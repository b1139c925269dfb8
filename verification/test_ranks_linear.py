"""The linear solver gives the same bits on any number of processes.

`test_solvers multigrid` prints a line `solution NAME CELLS ITERATIONS CHECKSUM` for each system.
"""

import os
import subprocess
from functools import cache

import pytest

from run_cases import MPI_SETTINGS, ROOT

BUILD = ROOT / "build"


@cache
def solutions(*command: str) -> list[str]:
    """The lines of a run of the program."""
    done = subprocess.run(
        command,
        env={**os.environ, **MPI_SETTINGS},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    return [line for line in done.stdout.splitlines() if line.startswith("solution ")]


@pytest.mark.xdist_group("ranks")
@pytest.mark.parametrize("n", [1, 2, 4])
def test_same_solutions(n: int) -> None:
    """Compare the parallel build on n processes with the serial build."""
    serial = solutions(str(BUILD / "serial" / "test_solvers"), "multigrid")
    parallel = solutions(
        *["mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(n)],
        *[str(BUILD / "mpi" / "test_solvers"), "multigrid"],
    )
    assert len(serial) > 0
    assert parallel == serial
