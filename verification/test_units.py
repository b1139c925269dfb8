"""Runs every unit test: optimised, with all run-time checks, and some on several processes.

The tests of a folder are one program, which runs that of its argument: `test_blocks sleep`. A test
that holds the comment line `! ranks: 2 4` is also run by mpirun on 2 and on 4 processes.
"""

import re
from pathlib import Path

import pytest

from shared_runs import call

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "verification" / "unit").glob("*/test_*.f90"))
THREADS = {"OMP_NUM_THREADS": "2", "OMP_WAIT_POLICY": "passive"}
"""Two threads, so that the loops of the modules are tested as they run."""


def ranks(source: Path) -> list[int]:
    """Process counts that the source asks for."""
    found = re.search(r"^! ranks:([ \d]+)$", source.read_text(), re.MULTILINE)
    return [int(word) for word in found[1].split()] if found else []


def run(source: Path, build: str, folder: Path, launcher: tuple[str, ...] = ()) -> None:
    """Run a unit test; its output is shown when it fails."""
    program = ROOT / "build" / build / f"test_{source.parent.name}"
    name = source.stem.removeprefix("test_")
    done = call(*launcher, program, name, cwd=folder, more=THREADS)
    assert done.returncode == 0, f"\n{done.stdout}\n{done.stderr}"
    assert re.search(r"^[1-9]\d* passed, 0 failed$", done.stdout, re.MULTILINE), done.stdout


@pytest.mark.cost(5)
@pytest.mark.parametrize("build", ["serial-debug", "serial"])
@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_unit(source: Path, build: str, tmp_path: Path) -> None:
    run(source, build, tmp_path)


@pytest.mark.xdist_group("ranks")
@pytest.mark.parametrize(
    ("source", "n"),
    [pytest.param(source, n, id=f"{source.stem}-{n}") for source in SOURCES for n in ranks(source)],
)
def test_unit_on_ranks(source: Path, n: int, tmp_path: Path) -> None:
    run(source, "mpi", tmp_path, ("mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(n)))
