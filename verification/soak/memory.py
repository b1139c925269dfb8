"""Memory of a long run: what a small tank with blocks takes must not grow with its steps.

A run of 10,000 steps, with a row and a restart file after each, is compared with one of a twentieth
of them: it may have up to ALLOWANCE more at its peak, and no more. (Frames fill the cache of HDF5,
which is bounded: a run of 10,000 frames has 13 MB more than one of 500, one of 20,000 no more.)
"""

from collections.abc import Iterator
from pathlib import Path

from micstools.bench.timing import timed
from run_cases import Machine
from run_soak import Given

ALLOWANCE = 1.0e6  # bytes; before the first leak was mended 1,000 steps took 29 MB
DT = 1.0e-4

CASE = Path(__file__).with_suffix(".nml").read_text()


def peak(machine: Machine, steps: int, work: Path) -> int:
    """Most memory that a run of so many steps had at once [bytes]."""
    case = work / f"{steps}.nml"
    case.write_text(CASE.format(t_end=steps * DT, dt=DT))
    words = [*machine.command, "--output", work / f"run-{steps}", case]
    return int(timed(words, work)[2])


def growth(machine: Machine, steps: int, work: Path) -> tuple[str, list[str]]:
    """What was measured, and what does not hold."""
    few = steps // 20
    before, after = peak(machine, few, work), peak(machine, steps, work)
    said = f"{few} steps: {before / 1e6:.2f} MB, {steps} steps: {after / 1e6:.2f} MB at most"
    more = after - before
    return said, [f"{more / 1e6:.2f} MB more"] if more > ALLOWANCE else []


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """The one pair of runs."""
    yield growth(given.machine(), given.n or 10000, work)
