"""Runs that are killed at any moment: what they wrote can be read, and goes on to the same bits.

usage: python verification/soak/kills.py [N] [--ranks R] [--program ./mics] [--seed S]

N times a short wet run is ended by kill -9 at a moment between its start and its end; of several
processes one is killed. Then must hold: every result file can be read to its last byte, and its
complete rows and frames are those of an undisturbed run; each restart file goes on, in a copy and,
the newest, in the same folder, to the same bits. Before the first restart file there is nothing to
go on from, and a file may have been in the making: then a second run must take the folder.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "verification"))

from run_cases import MPI_SETTINGS, Machine  # noqa: E402
from same_bits import LOCK, contents, differences  # noqa: E402
from soak.full_disk import CHANGING, RESULTS, Workshop, goes_on, open_shop  # noqa: E402


def start(shop: Workshop, output: Path, *before: str) -> subprocess.Popen[bytes]:
    """Begin a run into a folder, in a group of processes of its own."""
    return subprocess.Popen(
        [*before, *shop.machine.command, "--output", str(output), str(shop.case)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env={**os.environ, **MPI_SETTINGS, "OMP_WAIT_POLICY": "passive"},
        start_new_session=True,
    )


def processes_of(shop: Workshop, parent: int) -> list[int]:
    """Processes of the program in the session of `parent`."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            same = os.getsid(int(entry.name)) == parent
            if same and (entry / "exe").resolve() == shop.machine.program:
                found.append(int(entry.name))
        except OSError:  # it has gone
            continue
    return found


def complete(name: str, file: dict[str, np.ndarray]) -> int:
    """Rows or frames that are whole; the last row may have been in the making."""
    if name == "run.h5":
        columns = [a for key, a in file.items() if key.startswith("series/") and "@" not in key]
        return max(0, min(map(len, columns), default=1) - 1)
    return int(file.get("VTKHDF/Steps@NSteps", np.int64(0)))


def wrong_files(folder: Path, whole: Path, extra: int = 0) -> list[str]:
    """Files that cannot be read, and whole rows or frames that are not those of the whole run.
    A run that was stopped in good order has an `extra` last one."""
    found = []
    for path in sorted(folder.glob("*")):
        if path.suffix == ".part" or path.name == LOCK:
            continue  # in the making when the run was killed; the next one removes them
        try:
            here = contents(path)
        except (OSError, RuntimeError, KeyError) as trouble:
            found.append(f"{path.name} cannot be read: {trouble}")
            continue
        if path.name in RESULTS:
            there = contents(whole / path.name)
            rows, total = complete(path.name, here), complete(path.name, there)
            total += path.name == "run.h5"  # its last row is whole, too
            rows = max(0, rows - extra)
            for key, a in here.items():
                growing = "@" not in key and a.ndim and a.dtype != object
                if not growing or key in CHANGING:
                    continue
                n = len(there[key]) * rows // max(1, total)
                if len(a) < n or a[:n].tobytes() != there[key][:n].tobytes():
                    found.append(f"{path.name}: other numbers in {key}")
    return found


def trial(shop: Workshop, seconds: float, draw: random.Random, work: Path) -> tuple[str, list[str]]:
    """Kill a run after about so many seconds: what was left, and all that does not hold."""
    folder, spare = work / "run", work / "spare"
    shutil.rmtree(folder, ignore_errors=True)
    run = start(shop, folder)
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
    found = wrong_files(folder, shop.whole) or goes_on(shop, folder, spare)
    return f"left {', '.join(left)}", found


def begins_again(shop: Workshop, folder: Path) -> list[str]:
    """What is wrong with a new run into a folder where one was killed as it began."""
    run = start(shop, folder)
    said = run.communicate(timeout=120)[1].decode()
    if run.returncode != 0:
        return [f"a new run there: exit code {run.returncode}: {said.strip()}"]
    for older in folder.parent.glob(f"{folder.name}.bak-*"):
        shutil.rmtree(older)
    return differences(shop.whole, folder)


def soak(n: int, shop: Workshop, seed: int, work: Path) -> int:
    """Number of trials in which something does not hold."""
    draw, failed = random.Random(seed), 0
    began = time.monotonic()
    start(shop, work / "timed").communicate()
    whole = time.monotonic() - began
    for i in range(n):
        seconds = draw.uniform(0.0, whole)
        said, found = trial(shop, seconds, draw, work)
        print(f"{i:4d} {seconds:6.3f} s {'FAILS' if found else 'holds'}  {said}", flush=True)
        print("".join(f"    {line}\n" for line in found), end="", flush=True)
        failed += bool(found)
    print(f"{failed} of {n} kills fail")
    return failed


def main() -> None:
    """Print a line per kill; the exit code says whether any failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", type=int, nargs="?", default=200, help="kills")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--program", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    name = "mics" if options.ranks == 1 else "mics_mpi"
    machine = Machine((options.program or ROOT / name).resolve(), options.ranks, 1)
    with tempfile.TemporaryDirectory() as folder:
        shop = open_shop(machine, Path(folder))
        raise SystemExit(int(soak(options.n, shop, options.seed, Path(folder)) > 0))


if __name__ == "__main__":
    main()
