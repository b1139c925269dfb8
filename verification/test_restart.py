"""A run that goes on from a restart file has the same bits as one that never stopped."""

from pathlib import Path

import pytest

from micstools.reading.reader import Run
from run_cases import CASES, ROOT, Machine, run
from same_bits import contents, differences
from shared_runs import SharedRun

RESULTS = ("run.h5", "fields.vtkhdf", "blocks.vtkhdf")

ALONE = Machine(ROOT / "mics", threads=1)
TWO_RANKS = Machine(ROOT / "mics_mpi", ranks=2)
RUNS = [("coupled", ALONE), ("paper", ALONE), ("current", ALONE)] + [
    pytest.param(name, TWO_RANKS, marks=pytest.mark.xdist_group("ranks"))
    for name in ("coupled", "current")
]


@pytest.mark.parametrize(
    ("name", "machine"), RUNS, ids=lambda value: getattr(value, "ranks", value)
)
def test_restart_equals_uninterrupted_run(
    name: str, machine: Machine, tmp_path: Path, shared_run: SharedRun
) -> None:
    """Go on from the first restart file of a finished run, in a copy, and compare."""
    whole, again = shared_run(name, machine), tmp_path / "again"
    first, last = Run(whole).restart_files
    run(CASES / "ranks" / f"{name}.nml", again, machine, "--restart", str(whole / first))
    found = differences(whole, again)
    assert [line for line in found if line.startswith(RESULTS)] == []
    end = Run(again).restart_files[-1]
    assert _state(whole / last) == _state(again / end)


def _state(path: Path) -> dict[str, bytes]:
    """Everything in a restart file but its attributes, which may tell of the machine."""
    return {name: a.tobytes() for name, a in contents(path).items() if "@" not in name}
