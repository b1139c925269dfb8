"""Folders that are moved away from a running program: it ends, and no other run loses anything.

100 times, at a random moment, the result folder of a run is moved and a second run begun in its
place, deleted, or replaced by an empty one; or a second run on a node that does not see the lock of
the first begins in the folder, or goes on in it. The first must end with code 4 and one line, or
have been done; what it wrote stays as it was; the second must end like an undisturbed run.
"""

import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from run_cases import MPI_SETTINGS
from run_soak import Given
from same_bits import LOCK, but_restarts, differences
from soak.shop import RESULTS, Shop, column, open_shop, processes_of, wrong_files

WAYS = ("moved", "deleted", "emptied", "unseen", "unseen in place")
SECOND = ("moved", "unseen", "unseen in place")  # those with a second run
ELSEWHERE = """
#include <string.h>
int flock(int fd, int operation) { return 0; }
int gethostname(char *name, size_t size) { strncpy(name, "elsewhere", size); return 0; }
"""
"""A node with another name, whose locks nobody sees."""


def elsewhere(work: Path) -> dict[str, str]:
    """Environment of a program on another node."""
    library = work / "elsewhere.so"
    if not library.exists():
        command = ["gcc", "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
        subprocess.run(command, input=ELSEWHERE.encode(), check=True)
    return {**os.environ, **MPI_SETTINGS, "LD_PRELOAD": str(library)}


def begun(folder: Path, work: Path, way: str) -> bool:
    """Has the second run its files, or what there is of the first?"""
    if way == "unseen in place":
        lock = folder / LOCK  # gone once the first run has ended
        return lock.exists() and lock.read_text().endswith("elsewhere")
    if way == "unseen" and not (work / "run.bak-1").exists():
        return False
    return all((folder / name).exists() for name in RESULTS)


def wrong_results(whole: Path, folder: Path, way: str) -> list[str]:
    """Where the second run differs from an undisturbed one; in place restart files begin with the
    other of the two."""
    try:
        found = differences(whole, folder)
    except (OSError, RuntimeError, KeyError) as trouble:
        return [f"a file cannot be read: {trouble}"]
    return but_restarts(found) if way == "unseen in place" else found


def trial(shop: Shop, way: str, seconds: float, work: Path) -> tuple[str, list[str]]:
    """One folder after about so many seconds: how the first run ended, and what does not hold."""
    folder, kept = work / "run", work / "kept"
    for path in work.glob("run*"):
        shutil.rmtree(path)
    shutil.rmtree(kept, ignore_errors=True)
    first = shop.start("--output", folder)
    wanted = folder / ("restart-a.h5" if way == "unseen in place" else "run.h5")
    while not wanted.exists() and first.poll() is None:
        time.sleep(0.001)
    time.sleep(seconds)
    still = processes_of(shop, first.pid)
    for pid in still:  # whatever it was about to do comes when the other is at work
        os.kill(pid, signal.SIGSTOP)
    rows, whole = (len(column(path, "series/wall_time")) for path in (folder, shop.whole))
    # Do to the folder what comes before a second run
    if way == "deleted":
        while folder.exists():  # the run may write a file meanwhile
            shutil.rmtree(folder, ignore_errors=True)
    elif not way.startswith("unseen"):
        folder.rename(kept)
    if way == "emptied":
        folder.mkdir()
    second, words = None, ["--output", folder]
    if way == "unseen in place":
        words = ["--restart", folder / "restart-a.h5"]
    if way in SECOND:
        node = {"env": elsewhere(work)} if way.startswith("unseen") else {}
        second = shop.start(*words, **node)
    while second and second.poll() is None and not begun(folder, work, way):
        time.sleep(0.001)
    for pid in still:
        os.kill(pid, signal.SIGCONT)
    said = first.communicate(timeout=120)[1]
    lines = [line for line in said.splitlines() if line.startswith("mics: ")]
    well = first.returncode == 4 and len(lines) == 1 and str(folder) in lines[0]
    done = first.returncode == 0 and rows >= whole - 2
    found = [] if well or done else [f"the first: exit code {first.returncode}: {said}"]
    if second is not None:
        end = second.communicate(timeout=120)[1]
        found += [] if second.returncode == 0 else [f"the second: {end.strip()}"]
        found += [f"the second: {line}" for line in wrong_results(shop.whole, folder, way)]
    if way == "unseen":
        kept = work / "run.bak-1"
    if kept.exists() and first.returncode == 0:
        found += [f"the first: {line}" for line in differences(shop.whole, kept)]
    elif kept.exists() and (kept / "run.h5").stat().st_size > 0:  # else it had not begun
        found += [f"the first: {line}" for line in wrong_files(shop, kept)]
    if way == "emptied" and first.returncode == 4 and list(folder.iterdir()):
        found.append("the empty folder holds something")
    if way == "deleted" and folder.exists():
        found.append("the deleted folder is there again")
    return f"exit {first.returncode}", found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Every way in turn."""
    shop, draw = open_shop(given.machine(), work), random.Random(given.seed)
    for i in range(given.n or 100):
        way, seconds = WAYS[i % len(WAYS)], draw.uniform(0.0, 0.7 * shop.seconds)
        said, found = trial(shop, way, seconds, work)
        yield f"{way:16} {seconds:6.3f} s {said}", found
