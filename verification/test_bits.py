"""The same bits on any number of processes and threads, however the domain is cut, and after a
restart; and no fused multiply-add, which would make them hang on what the compiler fused."""

import os
import re
import shutil
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from micstools.reading.reader import Run
from run_cases import CASES, ROOT, Machine, changed, prepare, run
from same_bits import contents, differences
from shared_runs import SharedRun, call

SERIAL, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
ALONE, THREADS = Machine(SERIAL, threads=1), Machine(SERIAL, threads=2)
RESULTS = ("run.h5", "fields.vtkhdf", "blocks.vtkhdf")
several_processes = pytest.mark.xdist_group("ranks")


def ranks(n: int, threads: int = 0) -> Machine:
    return Machine(PARALLEL, n, threads)


@dataclass(frozen=True)
class Row:
    """A case of `cases/ranks`, and what must not change its bits."""

    case: str
    on: Machine
    goes_on: bool = False  # from its first restart file, on the same machine
    change: dict[str, Any] = field(default_factory=dict)


def cut(case: str, cells: tuple[int, ...], pieces: tuple[int, int, int], **numerics: str) -> Row:
    """The case on other cells, which are cut into pieces."""
    change = {"run": {"t_end": 0.03}, "grid": {"cells": list(cells)}, "numerics": numerics}
    return Row(case, ranks(int(np.prod(pieces))), change=change)


MATRIX = [  # all machines for one case; the others as far as they reach other code
    *(Row("coupled", on) for on in (THREADS, ranks(1), ranks(2), ranks(2, 2))),
    *(Row("paper", on) for on in (THREADS, ranks(2, 2))),
    Row("stream", ranks(2, 2)),
    *(Row("current", on) for on in (ranks(2), ranks(2, 2))),
    *(Row("dry", on) for on in (THREADS, ranks(2))),
    *(Row(name, ALONE, goes_on=True) for name in ("coupled", "paper", "current")),
    *(Row(name, ranks(2), goes_on=True) for name in ("coupled", "current")),
    cut("coupled", (24, 16, 32), (1, 1, 2)),
    cut("coupled", (30, 14, 10), (3, 1, 1)),
    cut("coupled", (16, 12, 30), (1, 1, 4)),
    cut("coupled", (16, 12, 30), (1, 1, 3), momentum="c_ismac"),
    cut("coupled", (24, 12, 12), (2, 1, 2), coupling="mics"),
    cut("paper", (23, 14, 11), (2, 2, 1)),
    cut("coupled", (21, 8, 15), (5, 1, 1)),
    cut("coupled", (23, 13, 10), (2, 3, 1)),
    cut("stream", (8, 29, 11), (1, 7, 1)),
    cut("current", (12, 14, 15), (2, 2, 2)),
]


@several_processes
@pytest.mark.parametrize("row", MATRIX, ids=lambda r: f"{r.case}-{r.on.ranks}-{r.on.threads}")
def test_same_bits(row: Row, tmp_path: Path, shared_run: SharedRun) -> None:
    """Compare every dataset and attribute of every result file."""
    case, again = CASES / "ranks" / f"{row.case}.nml", tmp_path / "again"
    if row.goes_on:
        whole = shared_run(row.case, row.on)
        first, last = Run(whole).restart_files
        run(case, again, row.on, "--restart", str(whole / first))
        assert [d for d in differences(whole, again) if d.startswith(RESULTS)] == []
        assert _state(whole / last) == _state(again / Run(again).restart_files[-1])
    elif row.change:
        (tmp_path / "case.nml").write_text(changed(case.read_text(), row.change))
        run(tmp_path / "case.nml", tmp_path / "alone", ALONE)
        run(tmp_path / "case.nml", again, row.on)
        assert differences(tmp_path / "alone", again) == []
    else:
        assert differences(shared_run(row.case, ALONE), shared_run(row.case, row.on)) == []


def _state(path: Path) -> dict[str, bytes]:
    """Everything in a restart file but its attributes, which may tell of the machine."""
    return {name: a.tobytes() for name, a in contents(path).items() if "@" not in name}


@several_processes
def test_same_bits_over_a_bed(tmp_path: Path) -> None:
    """Blocks in water on a rough bed; the map is found beside the case."""
    prepare("bed", tmp_path)
    short = {"run": {"t_end": 0.15, "field_interval": 0.05}}
    case = tmp_path / "short.nml"
    case.write_text(changed((CASES / "bed" / "drop.nml").read_text(), short))
    run(case, tmp_path / "alone", ALONE)
    run(case, tmp_path / "shared", ranks(2))
    assert differences(tmp_path / "alone", tmp_path / "shared") == []


@several_processes
def test_waiting_gives_the_core_away(tmp_path: Path, shared_run: SharedRun) -> None:
    """More processes than cores, and an MPI that was told otherwise and so would wait busily."""
    case, n = CASES / "ranks" / "coupled.nml", (os.cpu_count() or 1) + 2
    plain = {name: os.environ[name] for name in os.environ if not name.startswith("OMPI_MCA_")}
    crowd = ["mpirun", "--timeout", "60", "--bind-to", "none"]  # s; one process alone takes one
    crowd += ["-host", f"localhost:{4 * n}", "-n", str(n)]
    call(*crowd, PARALLEL, "--quiet", "--output", tmp_path / "crowd", case,
         env={**plain, "OMP_NUM_THREADS": "1"}, check=True)  # fmt: skip
    assert differences(shared_run("coupled", ALONE), tmp_path / "crowd") == []


@cache
def solutions(*command: str) -> list[str]:
    """The lines `solution NAME CELLS ITERATIONS CHECKSUM` of the test of multigrid."""
    said = call(*command, "multigrid", check=True).stdout
    return [line for line in said.splitlines() if line.startswith("solution ")]


@several_processes
@pytest.mark.parametrize("n", [1, 2, 4])
def test_same_solutions(n: int) -> None:
    """The linear solver of the parallel build on n processes, and of the serial build."""
    serial, parallel = (str(ROOT / "build" / b / "test_solvers") for b in ("serial", "mpi"))
    alone, start = solutions(serial), ["mpirun", "--bind-to", "none", "--oversubscribe"]
    assert len(alone) > 0
    assert solutions(*start, "-n", str(n), parallel) == alone


FUSED = re.compile(r"\bv?f(n?m(add|sub)|m(addsub|subadd)|(n?m(la|ls)))\w*\s")
OBJDUMP = shutil.which("objdump")


@pytest.mark.skipif(OBJDUMP is None, reason="no objdump")
@pytest.mark.parametrize("program", ["mics", "mics_mpi"])
def test_no_fused_multiply_add(program: str) -> None:
    binary = ROOT / program
    if not binary.exists():
        pytest.skip(f"./{program} is not built")
    code = call(OBJDUMP, "-d", "--no-show-raw-insn", binary, check=True).stdout
    assert "mulpd" in code or "mulsd" in code or "fmul" in code
    assert FUSED.findall(code) == []
