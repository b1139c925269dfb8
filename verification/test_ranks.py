"""Any number of ranks and threads gives the same bits."""

from pathlib import Path

import pytest

from run_cases import CASES, ROOT, Machine, prepare, run
from same_bits import differences

SERIAL, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
MACHINES = {
    "two threads": Machine(SERIAL, threads=2),
    "one rank": Machine(PARALLEL, ranks=1),
    "two ranks": Machine(PARALLEL, ranks=2),
    "two ranks of two threads": Machine(PARALLEL, ranks=2, threads=2),
}


@pytest.fixture(scope="module", params=["coupled", "paper", "stream", "current", "dry"])
def reference(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of one thread of the serial program."""
    output = tmp_path_factory.mktemp("ranks") / request.param
    run(CASES / "ranks" / f"{request.param}.nml", output, Machine(SERIAL, threads=1))
    return output


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES.keys())
def test_same_bits(reference: Path, machine: Machine, tmp_path: Path) -> None:
    """Compare every dataset and attribute of every result file."""
    run(CASES / "ranks" / f"{reference.name}.nml", tmp_path / "run", machine)
    assert differences(reference, tmp_path / "run") == []


def test_same_bits_over_a_bed(tmp_path: Path) -> None:
    """Blocks in water on a rough bed; the map is found beside the case."""
    prepare("bed", tmp_path)
    case = tmp_path / "short.nml"
    text = (tmp_path / "drop.nml").read_text().replace("t_end = 0.4", "t_end = 0.05")
    case.write_text(text.replace("field_interval = 0.1", "field_interval = 0.02"))
    run(case, tmp_path / "alone", Machine(SERIAL, threads=1))
    run(case, tmp_path / "shared", Machine(PARALLEL, ranks=2, threads=2))
    assert differences(tmp_path / "alone", tmp_path / "shared") == []
