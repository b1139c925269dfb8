"""Whole jobs on any number of processes and threads: the same bits, a stop and a restart included.

usage: python verification/soak/any_number.py [CASE ...] [--on RxT ...] [--stops N]

Each case (the main job and the river) runs whole with ./mics on one thread, then with ./mics_mpi
on R processes of T threads (1 to 4 of 1 and 2). N times it is stopped on one number while a free
block touches another one, the floor or the bed, and goes on on another number. All datasets must
have the same bits, except those that name the machine or the clock.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "verification"))

from run_cases import MPI_SETTINGS, Machine  # noqa: E402
from same_bits import differences  # noqa: E402

ALONE = Machine(ROOT / "mics", threads=1)
DEFAULT = [f"{ranks}x{threads}" for ranks in (1, 2, 3, 4) for threads in (1, 2)]
ROUNDED = 5.1e-5  # s, of a time that is told with four digits
MOVING = 1.0e-2  # m/s of a block that touches something: in the middle of a contact
SMALL = """! A block is thrown onto the floor of a shallow tank; a second.
&run t_end = 0.1  dt = 2.0e-3  field_interval = 0.02  restart_interval = 0.03 /
&grid cells = 20, 10, 16  length = 0.1, 0.05, 0.08 /
&fluid water_level = 0.03 /
&shape name = 'cube'  kind = 'cube'  size = 0.02 /
&body shape = 'cube'  position = 0.03, 0.025, 0.02  axis = 0, 1, 0  angle_deg = 20
  velocity = 0.2, 0.0, -0.3 /
"""


def machine(text: str) -> Machine:
    """RxT: so many processes of so many threads."""
    ranks, threads = map(int, text.split("x"))
    return Machine(ROOT / "mics_mpi", ranks, threads)


def start(on: Machine, *words: str) -> subprocess.Popen[str]:
    """Begin a run."""
    return subprocess.Popen(
        [*on.command, *words],
        env={**os.environ, **MPI_SETTINGS, **on.patience},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def contact_times(folder: Path) -> np.ndarray:
    """Times of rows in which a free block touches something and moves."""
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        bodies = h5["bodies"]
        free = ~np.asarray(bodies["fixed"][:], bool)
        speed = np.linalg.norm(bodies["velocity"][:], axis=2)
        touching = (bodies["contacts"][:] > 0) & (speed > MOVING) & free
        return np.asarray(bodies["time"][:][touching.any(axis=1)])


def last_time(folder: Path) -> float:
    """Time of the last row of a growing file."""
    try:
        with h5py.File(folder / "run.h5", "r", locking=False) as h5:
            return float(h5["series/time"][-1])
    except (OSError, KeyError, RuntimeError, IndexError):
        return -1.0


def stopped(case: Path, on: Machine, then: Machine, until: float, folder: Path) -> str:
    """Stop a run at about `until` and go on; where it stopped, or what went wrong."""
    run = start(on, "--output", str(folder), str(case))
    while last_time(folder) < until and run.poll() is None:
        time.sleep(0.01)
    if run.poll() is None:
        run.send_signal(signal.SIGUSR1)  # mpirun hands it on and kills nobody
    said = run.communicate()[1]
    if run.returncode == 0:
        return "it was done before it was stopped"
    at = last_time(folder)
    newest = max(folder.glob("restart-?.h5"), key=lambda path: path.stat().st_mtime_ns)
    again = start(then, "--restart", str(newest), str(case))
    said = again.communicate()[1]
    return f"stopped at {at:.4f} s" if again.returncode == 0 else said


def compare(whole: Path, folder: Path) -> list[str]:
    """What differs, restart files of other times apart."""
    return [line for line in differences(whole, folder) if not line.startswith("restart-")]


def tell(name: str, what: str, found: list[str], began: float) -> int:
    """Print a line; 1 if something was found."""
    verdict = "FAILS" if found else "holds"
    print(f"{name} {what}: {verdict}, {time.monotonic() - began:.0f} s", flush=True)
    print("".join(f"    {line}\n" for line in found), end="", flush=True)
    return int(bool(found))


def try_case(case: Path, numbers: list[str], stops: int, work: Path) -> int:
    """How much of a case does not hold."""
    whole, failed, began = work / "whole", 0, time.monotonic()
    said = start(ALONE, "--output", str(whole), str(case)).communicate()[1]
    print(f"{case.name} alone: {time.monotonic() - began:.0f} s {said}", flush=True)
    for text in numbers:
        began, folder = time.monotonic(), work / text
        start(machine(text), "--output", str(folder), str(case)).communicate()
        failed += tell(case.name, text, compare(whole, folder), began)
    times = contact_times(whole)
    for i in range(stops):
        began, folder = time.monotonic(), work / f"stop-{i}"
        on, then = numbers[-1 - i % len(numbers)], numbers[i % len(numbers)]
        until = float(times[(i + 1) * len(times) // (stops + 1)])
        said = stopped(case, machine(on), machine(then), until, folder)
        near = np.abs(times - last_stop(said)) < ROUNDED
        touch = " in a contact" if near.any() else ""
        failed += tell(
            case.name, f"{on}, {said}{touch}, then {then}", compare(whole, folder), began
        )
    return failed


def last_stop(said: str) -> float:
    """The time that `stopped` told; none if it told something else."""
    words = said.split()
    return float(words[2]) if words[:2] == ["stopped", "at"] else float("nan")


def main() -> int:
    """Command line; 1 if anything differed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    inputs = [ROOT / "input" / "blocks.nml", ROOT / "input" / "river.nml"]
    parser.add_argument("cases", type=Path, nargs="*", default=inputs, metavar="CASE")
    parser.add_argument("--on", nargs="+", default=DEFAULT, metavar="RxT")
    parser.add_argument("--stops", type=int, default=2)
    chosen = parser.parse_args()
    failed = 0
    for case in chosen.cases:
        with tempfile.TemporaryDirectory() as folder:
            failed += try_case(case, chosen.on, chosen.stops, Path(folder))
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
