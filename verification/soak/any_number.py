"""Whole jobs on any number of processes and threads: the same bits, a stop and a restart included.

Each case (words; by default the main job and the river) runs whole with ./mics on one thread, then
with ./mics_mpi on 1 to 4 processes of 1 and 2 threads. Twice it is stopped on one number while a
free block touches another one, the floor or the bed, and goes on on another number. All datasets
must have the same bits, except those that name the machine or the clock.
"""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from micstools.reading.reader import Run
from run_cases import ROOT, Machine
from run_soak import Given
from soak.shop import Shop, column, restart_files, start

NUMBERS = [f"{ranks}x{threads}" for ranks in (1, 2, 3, 4) for threads in (1, 2)]
ROUNDED = 5.1e-5  # s, of a time that is told with four digits
MOVING = 1.0e-2  # m/s of a block that touches something: in the middle of a contact
SMALL = Path(__file__).with_suffix(".nml").read_text()


def machine(text: str) -> Machine:
    """RxT: so many processes of so many threads."""
    ranks, threads = map(int, text.split("x"))
    return Machine(ROOT / "mics_mpi", ranks, threads)


def stopped(
    shop: Shop, on: Machine, then: Machine, until: float, folder: Path
) -> tuple[float, str]:
    """Stop a run at about `until` and go on: where it stopped, and what went wrong."""
    run, at = start(on, "--output", folder, shop.case), -1.0
    while at < until and run.poll() is None:
        time.sleep(0.01)
        at = max([-1.0, *column(folder, "series/time")[-1:]])
    if run.poll() is None:
        run.send_signal(signal.SIGUSR1)  # mpirun hands it on and kills nobody
    run.communicate()
    if run.returncode == 0:
        return np.nan, "it was done before it was stopped"
    at = float(column(folder, "series/time")[-1])
    again = start(then, "--restart", restart_files(folder)[-1], shop.case)
    said = again.communicate()[1]
    return at, said if again.returncode else ""


def try_case(
    case: Path, numbers: list[str], stops: int, work: Path
) -> Iterator[tuple[str, list[str]]]:
    """The case on each number, then stopped and gone on with."""
    shop = Shop(Machine(ROOT / "mics", threads=1), case, work / "whole")
    shop.run("--output", shop.whole)
    for text in numbers:
        start(machine(text), "--output", work / text, case).communicate()
        yield f"{case.name} {text}", shop.unlike(work / text)
    # Rows in which a free block touches something and moves
    b = Run(shop.whole).bodies
    moving = np.linalg.norm(b.velocity, axis=2) > MOVING
    times = b.time[((b.contacts > 0) & moving & ~b.fixed).any(axis=1)]
    for i in range(stops):
        on, then = numbers[-1 - i % len(numbers)], numbers[i % len(numbers)]
        until, folder = float(times[(i + 1) * len(times) // (stops + 1)]), work / f"stop-{i}"
        at, wrong = stopped(shop, machine(on), machine(then), until, folder)
        touch = " in a contact" if (np.abs(times - at) < ROUNDED).any() else ""
        found = [wrong] if wrong else shop.unlike(folder)
        yield f"{case.name} {on}, stopped at {at:.4f} s{touch}, then {then}", found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Every case."""
    usual = [ROOT / "input" / "blocks.nml", ROOT / "input" / "river.nml"]
    for i, case in enumerate(map(Path, given.words) if given.words else usual):
        yield from try_case(case.resolve(), NUMBERS, given.n or 2, work / str(i))
