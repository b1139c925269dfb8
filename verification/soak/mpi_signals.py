"""Signals to mpirun: the run ends in good order, and goes on to the same bits.

usage: python verification/soak/mpi_signals.py [N] [--program ./mics_mpi] [--seed S]

N times mpirun, with two to four processes of a short wet run, gets SIGTERM, SIGINT, SIGHUP or
SIGUSR1 at a moment between its start and its end, or one of its processes is killed. Then must
hold: all processes are gone within 20 s; result files can be read and have the rows of an
undisturbed run; a run that had begun its steps, and was not killed, has a restart file of its last
step and says how it ended; every restart file goes on to the same bits. Open MPI kills what is not
gone a second after SIGTERM, SIGINT or SIGHUP; every other time it is told to wait for 5. (It then
always does so, twice, however soon the processes are done.)
"""

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "verification"))

from run_cases import Machine  # noqa: E402
from soak.full_disk import Workshop, exit_status, goes_on, open_shop  # noqa: E402
from soak.kills import begins_again, processes_of, start, wrong_files  # noqa: E402

KINDS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1, signal.SIGKILL)
SECONDS = 20.0  # to end in
PATIENT = ("env", "OMPI_MCA_odls_base_sigkill_timeout=5")


def rows(folder: Path) -> int:
    """Rows that run.h5 shows by now; it may be caught while it is written."""
    try:
        with h5py.File(folder / "run.h5", "r", locking=False) as h5:
            return len(h5["series/wall_time"])
    except (OSError, KeyError, RuntimeError):
        return 0


def last_step_is_saved(folder: Path) -> list[str]:
    """Does a restart file hold the last row, and do the results say how the run ended?"""
    times = []
    for path in folder.glob("restart-?.h5"):
        with h5py.File(path, "r") as h5:
            times.append(float(h5["clock/t"][0]))
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        last = float(h5["series/time"][-1])
    found = [] if last in times else [f"the last row is of {last} s, restart files of {times}"]
    return found + ([] if exit_status(folder) is not None else ["no exit status"])


def trial(
    shop: Workshop, number: int, seconds: float, patient: bool, work: Path
) -> tuple[str, list[str]]:
    """One signal after so many seconds: how it ended, and all that does not hold."""
    folder, spare = work / "run", work / "spare"
    shutil.rmtree(folder, ignore_errors=True)
    run = start(shop, folder, *(PATIENT if patient else ()))
    time.sleep(seconds)
    begun = rows(folder) > 1
    inner = processes_of(shop, run.pid)
    if number == signal.SIGKILL and inner:
        os.kill(random.Random(seconds).choice(inner), number)
    elif number != signal.SIGKILL:
        run.send_signal(number)
    began = time.monotonic()
    run.communicate(timeout=120)
    while (left := processes_of(shop, run.pid)) and time.monotonic() - began < SECONDS:
        time.sleep(0.01)
    took = time.monotonic() - began
    found = [f"{len(left)} processes are left"] if left else []
    found += [f"took {took:.1f} s"] if took > SECONDS else []
    said = f"code {run.returncode} after {took:.2f} s"
    if not folder.exists():
        return said + ", nothing was written yet", found
    if not list(folder.glob("restart-?.h5")) and not (begun and number != signal.SIGKILL):
        return said + ", left no restart file", found + begins_again(shop, folder)
    found += wrong_files(folder, shop.whole, int(number != signal.SIGKILL))
    if not found and number != signal.SIGKILL:
        found += last_step_is_saved(folder)
    return said, found or goes_on(shop, folder, spare)


def soak(n: int, shop: Workshop, seed: int, work: Path) -> int:
    """Number of trials in which something does not hold."""
    draw, failed = random.Random(seed), 0
    for i in range(n):
        ranks = draw.choice((2, 2, 3, 4))
        here = replace(shop, machine=replace(shop.machine, ranks=ranks))
        number, patient = KINDS[i % len(KINDS)], bool(i % 2)
        seconds = draw.uniform(0.0, whole_time(here, work))
        said, found = trial(here, number, seconds, patient, work)
        name = signal.Signals(number).name
        verdict = "FAILS" if found else "holds"
        print(f"{i:4d} {ranks} ranks {name:8} {seconds:6.3f} s {verdict}  {said}", flush=True)
        print("".join(f"    {line}\n" for line in found), end="", flush=True)
        failed += bool(found)
    print(f"{failed} of {n} signals fail")
    return failed


def whole_time(shop: Workshop, work: Path, known: dict[int, float] = {}) -> float:  # noqa: B006
    """Seconds that an undisturbed run takes on so many processes."""
    ranks = shop.machine.ranks
    if ranks not in known:
        began = time.monotonic()
        start(shop, work / f"timed-{ranks}").communicate()
        known[ranks] = time.monotonic() - began
    return known[ranks]


def main() -> None:
    """Print a line per signal; the exit code says whether any failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", type=int, nargs="?", default=50, help="signals")
    parser.add_argument("--program", type=Path, default=ROOT / "mics_mpi")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    machine = Machine(options.program.resolve(), 2, 1)
    with tempfile.TemporaryDirectory() as folder:
        shop = open_shop(machine, Path(folder))
        raise SystemExit(int(soak(options.n, shop, options.seed, Path(folder)) > 0))


if __name__ == "__main__":
    main()
