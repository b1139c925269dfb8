"""What processes cost: messages that do not grow with the blocks, a share of the memory each."""

import re
import sys
from pathlib import Path

import h5py
import pytest

from micstools.bench.timing import alone
from run_cases import CASES, ROOT, Machine, run
from shared_runs import call

SERIAL, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
pytestmark = pytest.mark.xdist_group("ranks")


@pytest.mark.parametrize("coupling", ["monolithic", "mics"])
def test_reductions_of_many_blocks(coupling: str, tmp_path: Path) -> None:
    """What is summed for each of many blocks passes in one message: 30 take no more than 2."""
    most = []
    for n in (2, 30):
        text = (CASES / "ranks" / "coupled.nml").read_text().split("&body")[0]
        text = re.sub(r"t_end = [\d.]+", "t_end = 0.01", text)
        text += f"&numerics coupling = '{coupling}'  max_pressure_passes = 50 /\n"
        for b in range(n):
            x, y, z = 0.02 + 0.0221 * (b % 6), 0.02 + 0.06 * (b // 6 % 2), 0.03 + 0.05 * (b // 12)
            text += f"&body shape = 'ball'  position = {x}, {y}, {z}  fixed = {b > 1} /\n"
        case = tmp_path / f"{n}.nml"
        case.write_text(text)
        run(case, tmp_path / str(n), Machine(SERIAL, threads=1))
        with h5py.File(tmp_path / str(n) / "run.h5", "r") as h5:
            calls = dict(zip(h5["timers/name"].asstr()[:], h5["timers/calls"][:], strict=True))
            solves = h5["series/solver_iterations"][:]
        most.append(calls["sums over processes"] / (len(solves) + solves.sum()))
    assert most[1] < 1.5 * most[0], most


MEMORY_CASE = """&run t_end = 1.0e-3  dt = 1.0e-3  field_interval = 0 /
&grid cells = 72, 64, 64  length = 0.18, 0.16, 0.16 /
&fluid water_level = 0.06 /
&shape name = 'unit'  kind = 'hexapod'  size = 0.02 /
&body shape = 'unit'  position = 0.06, 0.08, 0.06 /
"""


def peaks(case: Path, ranks: int) -> list[float]:
    """Most memory that each process held at a time [kB]."""
    own = case.with_suffix(f".memory-{ranks}")
    start = ["mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(ranks)]
    program = [str(PARALLEL), "--quiet", "--output", f"{own}-run", str(case)]
    call(*start, *alone(own, *program), check=True)
    return [float(Path(f"{own}{rank}").read_text().split()[1]) for rank in range(ranks)]


@pytest.mark.skipif(sys.platform != "linux", reason="other units of the peak")
def test_memory_of_a_process(tmp_path: Path) -> None:
    """Each of four processes holds less than 0.33 of what one alone holds, both beyond what the
    program itself takes, which a grid of some cells shows."""
    few, case = tmp_path / "few.nml", tmp_path / "case.nml"
    few.write_text(MEMORY_CASE.replace("72, 64, 64", "18, 16, 16"))
    case.write_text(MEMORY_CASE)
    (itself,), (alone,), shared = peaks(few, 1), peaks(case, 1), peaks(case, 4)
    assert max(shared) - itself < 0.33 * (alone - itself), (itself, alone, shared)
