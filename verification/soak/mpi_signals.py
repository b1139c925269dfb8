"""Signals to mpirun: the run ends in good order, and goes on to the same bits.

50 times mpirun, with two to four processes of a short wet run, gets SIGTERM, SIGINT, SIGHUP or
SIGUSR1 at a moment between its start and its end, or one of its processes is killed. Then must
hold: all processes are gone within 20 s; result files can be read and have the rows of an
undisturbed run; a run that had begun its steps, and was not killed, has a restart file of its last
step and says how it ended; every restart file goes on to the same bits. Open MPI kills what is not
gone a second after SIGTERM, SIGINT or SIGHUP; every other time it is told to wait for 5. (It then
always does so, twice, however soon the processes are done.)
"""

import os
import random
import shutil
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import h5py

from run_soak import Given
from soak.shop import (
    Shop,
    begins_again,
    column,
    exit_status,
    goes_on,
    open_shop,
    processes_of,
    wrong_files,
)

KINDS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1, signal.SIGKILL)
SECONDS = 20.0  # to end in
PATIENT = ("env", "OMPI_MCA_odls_base_sigkill_timeout=5")


def last_step_is_saved(folder: Path) -> list[str]:
    """Does a restart file hold the last row, and do the results say how the run ended?"""
    times = []
    for path in folder.glob("restart-?.h5"):
        with h5py.File(path, "r") as h5:
            times.append(float(h5["clock/t"][0]))
    last = float(column(folder, "series/time")[-1])
    found = [] if last in times else [f"the last row is of {last} s, restart files of {times}"]
    return found + ([] if exit_status(folder) is not None else ["no exit status"])


def trial(
    shop: Shop, number: int, seconds: float, patient: bool, work: Path
) -> tuple[str, list[str]]:
    """One signal after so many seconds: how it ended, and all that does not hold."""
    folder, spare = work / "run", work / "spare"
    shutil.rmtree(folder, ignore_errors=True)
    run = shop.start("--output", folder, before=PATIENT if patient else ())
    time.sleep(seconds)
    begun = len(column(folder, "series/wall_time")) > 1
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
    found += wrong_files(shop, folder, extra=int(number != signal.SIGKILL))
    if not found and number != signal.SIGKILL:
        found += last_step_is_saved(folder)
    return said, found or goes_on(shop, folder, spare)


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Signals at random moments."""
    shop = open_shop(replace(given.machine(parallel=True), ranks=2), work)
    draw, whole = random.Random(given.seed), dict[int, float]()
    for i in range(given.n or 50):
        ranks = draw.choice((2, 2, 3, 4))
        here = replace(shop, machine=replace(shop.machine, ranks=ranks))
        if ranks not in whole:
            began = time.monotonic()
            here.run("--output", work / f"timed-{ranks}")
            whole[ranks] = time.monotonic() - began
        number, seconds = KINDS[i % len(KINDS)], draw.uniform(0.0, whole[ranks])
        said, found = trial(here, number, seconds, bool(i % 2), work)
        yield f"{ranks} ranks {signal.Signals(number).name:8} {seconds:6.3f} s {said}", found
