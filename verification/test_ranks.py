"""Any number of ranks and threads gives the same bits."""

import os
import subprocess
from pathlib import Path

import pytest

from run_cases import CASES, ROOT, Machine, prepare, run
from same_bits import differences
from shared_runs import SharedRun

SERIAL, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
ALONE = Machine(SERIAL, threads=1)
several_processes = pytest.mark.xdist_group("ranks")
MACHINES = [
    pytest.param(Machine(SERIAL, threads=2), id="two threads"),
    pytest.param(Machine(PARALLEL, ranks=1), id="one rank"),
    pytest.param(Machine(PARALLEL, ranks=2), id="two ranks", marks=several_processes),
    pytest.param(
        Machine(PARALLEL, ranks=2, threads=2),
        id="two ranks of two threads",
        marks=several_processes,
    ),
]


@pytest.mark.parametrize("name", ["coupled", "paper", "stream", "current", "dry"])
@pytest.mark.parametrize("machine", MACHINES)
def test_same_bits(name: str, machine: Machine, shared_run: SharedRun) -> None:
    """Compare every dataset and attribute of every result file."""
    assert differences(shared_run(name, ALONE), shared_run(name, machine)) == []


@several_processes
def test_same_bits_over_a_bed(tmp_path: Path) -> None:
    """Blocks in water on a rough bed; the map is found beside the case."""
    prepare("bed", tmp_path)
    case = tmp_path / "short.nml"
    text = (tmp_path / "drop.nml").read_text().replace("t_end = 0.4", "t_end = 0.05")
    case.write_text(text.replace("field_interval = 0.1", "field_interval = 0.02"))
    run(case, tmp_path / "alone", ALONE)
    run(case, tmp_path / "shared", Machine(PARALLEL, ranks=2, threads=2))
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
