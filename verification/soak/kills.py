"""Runs that are killed at any moment: what they wrote can be read, and goes on to the same bits.

200 times a short wet run is ended by kill -9 at a moment between its start and its end; of several
processes one is killed. Then must hold: every result file can be read to its last byte, and its
complete rows and frames are those of an undisturbed run; each restart file goes on, in a copy and,
the newest, in the same folder, to the same bits. Before the first restart file there is nothing to
go on from, and a file may have been in the making: then a second run must take the folder.
"""

import os
import random
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from run_soak import Given
from soak.shop import Shop, begins_again, goes_on, open_shop, processes_of, wrong_files


def trial(shop: Shop, seconds: float, draw: random.Random, work: Path) -> tuple[str, list[str]]:
    """Kill a run after about so many seconds: what was left, and all that does not hold."""
    folder, spare = work / "run", work / "spare"
    shutil.rmtree(folder, ignore_errors=True)
    run = shop.start("--output", folder)
    time.sleep(seconds)
    victims = processes_of(shop, run.pid)
    for pid in [draw.choice(victims)] if victims else []:
        os.kill(pid, signal.SIGKILL)
    run.communicate(timeout=120)
    if not folder.exists():
        return "nothing was written yet", []
    left = sorted(path.name for path in folder.glob("restart-?.h5"))
    if not left:
        return "left no restart file", begins_again(shop, folder)
    found = wrong_files(shop, folder) or goes_on(shop, folder, spare)
    return f"left {', '.join(left)}", found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Kills at random moments."""
    shop, draw = open_shop(given.machine(), work), random.Random(given.seed)
    began = time.monotonic()
    shop.run("--output", work / "timed")
    whole = time.monotonic() - began
    for _ in range(given.n or 200):
        seconds = draw.uniform(0.0, whole)
        said, found = trial(shop, seconds, draw, work)
        yield f"{seconds:6.3f} s {said}", found
