"""Short runs with every check there is: run-time checks, sanitizers, valgrind.

Every case of `input` and `verification/cases` (or those whose folder or file is named: words) makes
a few steps with ./mics_debug (made by `make DEBUG=1`: bounds, unset and overflowing numbers),
./mics_san (`make SAN=1`: address and undefined behaviour) and, if it is small, with ./mics_debug
under valgrind (uninitialised memory), and is continued from its restart file. Each must end with
code 0 and no word on standard error but the program's own.
"""

import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import f90nml

from run_cases import CASES, ROOT, changed, prepare
from run_soak import Given
from shared_runs import call
from soak.shop import restart_files

STEPS = 3
SETTINGS = {
    "OMP_NUM_THREADS": "1",
    "ASAN_OPTIONS": "detect_leaks=0",  # HDF5 keeps what it has until the end
    "UBSAN_OPTIONS": "print_stacktrace=1",
}


@dataclass(frozen=True)
class Check:
    """A way to run, and how many cells a case may have for it."""

    name: str
    command: tuple[str, ...]
    cells: int

    @property
    def there(self) -> bool:
        return all(shutil.which(word) for word in self.command if not word.startswith("-"))


CHECKS = (
    Check("debug", (str(ROOT / "mics_debug"),), 100_000),
    Check("san", (str(ROOT / "mics_san"),), 50_000),
    Check("valgrind", ("valgrind", "-q", "--error-exitcode=99", str(ROOT / "mics_debug")), 10_000),
)


def shortened(text: str) -> tuple[str, str, int]:
    """A case of STEPS steps, the same one step longer, and its cells."""
    case = f90nml.reads(text)
    dt = float(case["run"].get("dt", 1.0e-2))
    cells = case["grid"]["cells"]
    own = {"t_end": STEPS * dt, "field_interval": dt, "restart_interval": 2 * dt}
    longer = {**own, "t_end": (STEPS + 1) * dt}
    n = int(cells[0]) * int(cells[1]) * int(cells[2])
    return changed(text, {"run": own}), changed(text, {"run": longer}), n


def run(check: Check, words: list[str], work: Path) -> str:
    """What is wrong with a run in a folder; empty if nothing is."""
    command = (*check.command, "--quiet", "--max-wall", "0:01:00")
    done = call(*command, *words, cwd=work, more=SETTINGS, errors="replace", timeout=None)
    foreign = [row for row in done.stderr.splitlines() if not row.startswith(("mics: ", "  "))]
    if done.returncode not in (0, 143) or foreign:
        return f"{' '.join(words)}: code {done.returncode}: {done.stderr[:2000]}"
    return ""


def try_case(check: Check, text: str, work: Path) -> str:
    """What is wrong with some steps of a case and a restart; empty if nothing is."""
    short, longer, _ = shortened(text)
    (work / "short.nml").write_text(short)
    (work / "longer.nml").write_text(longer)
    shutil.rmtree(work / "out", ignore_errors=True)
    found, newest = run(check, ["--output", "out", "short.nml"], work), restart_files(work / "out")
    if not found and newest:
        found = run(check, ["--restart", str(newest[-1]), "longer.nml"], work)
    return found


def cases(work: Path) -> list[tuple[str, Path]]:
    """Name and file of every case; those that need it are prepared, each in a folder of its own."""
    found = []
    for path in sorted((ROOT / "input").glob("*.nml")):
        here = work / "input" / path.stem
        shutil.copytree(path.parent, here / "input")
        shutil.copy(path, here)
        found.append((f"input/{path.stem}", here / path.name))
    for folder in sorted(path.parent for path in CASES.glob("*/README.md")):
        for path in prepare(folder.name, work / folder.name):
            here = work / folder.name / path.name
            if not here.exists():
                shutil.copy(path, here)
            found.append((f"{folder.name}/{path.stem}", here))
    return found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Every case in every way that its size allows."""
    for name, path in cases(work):
        if given.words and not name.startswith(given.words):
            continue
        text = path.read_text()
        for check in CHECKS:
            if shortened(text)[2] > check.cells:
                continue
            began, missing = time.monotonic(), f"{' '.join(check.command)} is not there"
            found = try_case(check, text, path.parent) if check.there else missing
            said = f"{check.name:9} {name} {time.monotonic() - began:.1f} s"
            yield said, [found] if found else []
