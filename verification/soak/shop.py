"""What the fault tests share: a short wet run, undisturbed results, and what must be left of it."""

import os
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np

from run_cases import MPI_SETTINGS, Machine
from same_bits import LOCK, but_restarts, contents, differences

CHANGING = {
    f"bodies/{name}"
    for name in ("release_time", "entry_time", "exit_time", "raised", "status")
    + ("impact_speed", "rest_since")
}
"""Datasets that are written again when a block comes in or is let go."""

CASE = Path(__file__).with_suffix(".nml").read_text()
RESULTS = ("run.h5", "fields.vtkhdf", "blocks.vtkhdf")


def start(
    machine: Machine, *words: object, before: tuple[str, ...] = (), **settings: object
) -> subprocess.Popen[str]:
    """Begin a run, in a group of processes of its own."""
    return subprocess.Popen(
        [*before, *machine.command, *map(str, words)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **{"env": {**os.environ, **MPI_SETTINGS, "OMP_WAIT_POLICY": "passive"}, **settings},
    )


@dataclass(frozen=True)
class Shop:
    """A case, where it is run, and results of the undisturbed run."""

    machine: Machine
    case: Path
    whole: Path
    seconds: float = 0.0  # that this one took

    def start(self, *words: object, **more: object) -> subprocess.Popen[str]:
        """Begin a run of the case."""
        return start(self.machine, *words, self.case, **more)

    def run(self, *words: object, limit: Callable[[], None] | None = None) -> tuple[int, str]:
        """Exit code and what was said on standard error."""
        run = self.start(*words, preexec_fn=limit)
        said = run.communicate(timeout=900)[1]
        return run.returncode, said

    def unlike(self, folder: Path) -> list[str]:
        """What differs from the undisturbed run, restart files of other times apart."""
        return but_restarts(differences(self.whole, folder))


def open_shop(machine: Machine, work: Path, text: str = CASE) -> Shop:
    """Make the undisturbed run."""
    work.mkdir(exist_ok=True)
    case = work / "case.nml"
    case.write_text(text)
    shop, began = Shop(machine, case, work / "whole"), time.monotonic()
    code, said = shop.run("--output", shop.whole)
    if code != 0:
        raise RuntimeError(f"the undisturbed run fails: {said}")
    return replace(shop, seconds=time.monotonic() - began)


def restart_files(folder: Path) -> list[Path]:
    """The oldest first."""
    return sorted(folder.glob("restart-?.h5"), key=lambda path: path.stat().st_mtime_ns)


def column(folder: Path, name: str) -> np.ndarray:
    """A dataset of run.h5 as it is by now; empty where the file is caught while it is written."""
    try:
        with h5py.File(folder / "run.h5", "r", locking=False) as h5:
            return np.asarray(h5[name][:])
    except (OSError, KeyError, RuntimeError):
        return np.empty(0)


def exit_status(folder: Path) -> int | None:
    """How run.h5 says that the run ended; None without that file."""
    if not (folder / "run.h5").exists():
        return None
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        return int(h5["provenance"].attrs["exit_status"])


def goes_on(shop: Shop, folder: Path, spare: Path) -> list[str]:
    """Each restart file continues in a copy, the newest then in place, to the same bits."""
    found, restarts = [], restart_files(folder)
    for path, output in [(path, spare) for path in restarts] + [(p, None) for p in restarts[-1:]]:
        shutil.rmtree(spare, ignore_errors=True)
        code, said = shop.run("--restart", path, *(["--output", output] if output else []))
        how = f"--restart {path.name} {'--output' if output else 'in place'}"
        if code != 0:
            found.append(f"{how}: exit code {code}: {said.strip()}")
        else:
            found += [f"{how}: {line}" for line in shop.unlike(output or folder)]
    return found


def begins_again(shop: Shop, folder: Path) -> list[str]:
    """What is wrong with a new run into a folder where one was killed as it began."""
    code, said = shop.run("--output", folder)
    if code != 0:
        return [f"a new run there: exit code {code}: {said.strip()}"]
    for older in folder.parent.glob(f"{folder.name}.bak-*"):
        shutil.rmtree(older)
    return differences(shop.whole, folder)


def wrong_files(shop: Shop, folder: Path, killed: bool = True, extra: int = 0) -> list[str]:
    """Files that cannot be read, and whole rows or frames that are not those of the whole run. The
    last row of a `killed` run may have been in the making, and so may files; of another one a
    column of another length, and any other file, are faults. `extra` rows at the end, as a run has
    that was stopped in good order, are not looked at."""
    found = []
    for path in sorted(folder.glob("*")):
        if path.suffix not in (".h5", ".vtkhdf"):
            making = path.suffix == ".part" or path.name == LOCK  # the next run removes them
            found += [] if killed and making else [f"{path.name} is left over"]
            continue
        try:
            here = contents(path)
        except (OSError, RuntimeError, KeyError) as trouble:
            found.append(f"{path.name} cannot be read: {trouble}")
            continue
        if path.name not in RESULTS:
            continue
        there = contents(shop.whole / path.name)
        lengths = _lengths(path.name, here)
        if not killed and len(lengths) > 1:
            found.append(f"{path.name}: columns of {sorted(lengths)} rows")
        last = killed and path.name == "run.h5"
        rows, total = min(lengths, default=0) - last - extra, min(_lengths(path.name, there))
        for key, a in here.items():
            if "@" not in key and a.ndim and a.dtype != object and key not in CHANGING:
                n = len(there[key]) * max(0, rows) // max(1, total)
                if len(a) < n or a[:n].tobytes() != there[key][:n].tobytes():
                    found.append(f"{path.name}: other numbers in {key}")
    return found


def _lengths(name: str, file: dict[str, np.ndarray]) -> set[int]:
    """Lengths of the columns of a result file; of frames their number, which is written last."""
    if name == "run.h5":
        return {len(a) for key, a in file.items() if key.startswith("series/") and "@" not in key}
    return {int(file.get("VTKHDF/Steps@NSteps", np.int64(0)))}


def processes_of(shop: Shop, parent: int) -> list[int]:
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
