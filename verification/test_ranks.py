"""Any number of ranks and threads gives the same bits."""

import os
import subprocess
from pathlib import Path

import pytest

from run_cases import CASES, ROOT, Machine, changed, prepare, run
from same_bits import differences
from shared_runs import SharedRun

SERIAL, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
ALONE = Machine(SERIAL, threads=1)
several_processes = pytest.mark.xdist_group("ranks")
MACHINES = {
    "two threads": Machine(SERIAL, threads=2),
    "one rank": Machine(PARALLEL, ranks=1),
    "two ranks": Machine(PARALLEL, ranks=2),
    "two ranks of two threads": Machine(PARALLEL, ranks=2, threads=2),
}
CASES_ON = {
    "coupled": ["two threads", "one rank", "two ranks", "two ranks of two threads"],
    "paper": ["two threads", "two ranks of two threads"],
    "stream": ["two ranks of two threads"],
    "current": ["two ranks", "two ranks of two threads"],
    "dry": ["two threads", "two ranks"],
}
"""All for one case; the others as far as they reach other code (test_restart has some, too)."""


@several_processes
@pytest.mark.parametrize(
    ("name", "machine"), [(name, on) for name, machines in CASES_ON.items() for on in machines]
)
def test_same_bits(name: str, machine: str, shared_run: SharedRun) -> None:
    """Compare every dataset and attribute of every result file."""
    assert differences(shared_run(name, ALONE), shared_run(name, MACHINES[machine])) == []


@several_processes
def test_same_bits_over_a_bed(tmp_path: Path) -> None:
    """Blocks in water on a rough bed; the map is found beside the case."""
    prepare("bed", tmp_path)
    case = tmp_path / "short.nml"
    short = {"run": {"t_end": 0.15, "field_interval": 0.05}}
    case.write_text(changed((tmp_path / "drop.nml").read_text(), short))
    run(case, tmp_path / "alone", ALONE)
    run(case, tmp_path / "shared", Machine(PARALLEL, ranks=2))
    assert differences(tmp_path / "alone", tmp_path / "shared") == []


@several_processes
def test_waiting_gives_the_core_away(tmp_path: Path, shared_run: SharedRun) -> None:
    """More processes than cores, and an MPI that was told otherwise and so would wait busily."""
    case, n = CASES / "ranks" / "coupled.nml", (os.cpu_count() or 1) + 2
    plain = {name: os.environ[name] for name in os.environ if not name.startswith("OMPI_MCA_")}
    crowd = ["mpirun", "--timeout", "60", "--bind-to", "none"]  # s; one process alone takes one
    crowd += ["-host", f"localhost:{4 * n}", "-n", str(n)]
    subprocess.run(
        [*crowd, PARALLEL, "--quiet", "--output", tmp_path / "crowd", case],
        env={**plain, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.DEVNULL,
        check=True,
    )
    assert differences(shared_run("coupled", ALONE), tmp_path / "crowd") == []
