"""Runs that are killed or stopped at any moment: what they wrote goes on to the same bits.

`kills`: 200 times a short wet run, or one of its processes, is ended by kill -9 at any moment.
`signals`: 50 times mpirun, with two to four processes, gets SIGTERM, SIGINT, SIGHUP or SIGUSR1, or
one of its processes is killed. Then must hold: all processes are gone within 20 s; every result
file can be read to its last byte, with the complete rows and frames of an undisturbed run; a run
that had begun its steps, and was not killed, has a restart file of its last step and says how it
ended; each restart file goes on, in a copy and, the newest, in the same folder, to the same bits;
without one a second run takes the folder. Open MPI kills what is not gone a second after SIGTERM,
SIGINT or SIGHUP; every other time it is told to wait for 5. Words: kills, signals.
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
        times = []
        for path in folder.glob("restart-?.h5"):
            with h5py.File(path, "r") as h5:
                times.append(float(h5["clock/t"][0]))
        last = float(column(folder, "series/time")[-1])
        if last not in times:
            found.append(f"the last row is of {last} s, restart files of {times}")
        found += [] if exit_status(folder) is not None else ["no exit status"]
    return said, found or goes_on(shop, folder, spare)


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Kills and signals at random moments."""
    draw = random.Random(given.seed)
    for words in given.words or ("kills", "signals"):
        parallel, shops = words == "signals", dict[int, Shop]()
        for i in range(given.n or (50 if parallel else 200)):
            ranks = draw.choice((2, 2, 3, 4)) if parallel else given.ranks
            if ranks not in shops:
                machine = replace(given.machine(parallel), ranks=ranks)
                shops[ranks] = open_shop(machine, work / f"{words}-{ranks}")
            number, shop = KINDS[i % len(KINDS)] if parallel else signal.SIGKILL, shops[ranks]
            seconds = draw.uniform(0.0, shop.seconds)
            said, found = trial(shop, number, seconds, bool(parallel and i % 2), work)
            yield f"{ranks} ranks {signal.Signals(number).name:8} {seconds:6.3f} s {said}", found
