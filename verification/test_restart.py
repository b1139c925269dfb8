"""A run that goes on from a restart file has the same bits as one that never stopped."""

from pathlib import Path

import pytest

from micstools.reader import Run
from run_cases import CASES, ROOT, Machine, run
from same_bits import contents, differences

RESULTS = ("run.h5", "fields.vtkhdf", "blocks.vtkhdf")


RUNS = [("coupled", 1), ("coupled", 2), ("paper", 1), ("current", 1), ("current", 2)]


@pytest.mark.parametrize(("name", "ranks"), RUNS)
def test_restart_equals_uninterrupted_run(name: str, ranks: int, tmp_path: Path) -> None:
    """Go on from the first restart file of a finished run, in a copy, and compare."""
    case = CASES / "ranks" / f"{name}.nml"
    machine = Machine(ROOT / "mics") if ranks == 1 else Machine(ROOT / "mics_mpi", ranks)
    whole, again = tmp_path / "whole", tmp_path / "again"
    run(case, whole, machine)
    first, last = Run(whole).restart_files
    run(case, again, machine, "--restart", str(whole / first))
    found = differences(whole, again)
    assert [line for line in found if line.startswith(RESULTS)] == []
    end = Run(again).restart_files[-1]
    assert _state(whole / last) == _state(again / end)


def _state(path: Path) -> dict[str, bytes]:
    """Everything in a restart file but its attributes, which may tell of the machine."""
    return {name: a.tobytes() for name, a in contents(path).items() if "@" not in name}
