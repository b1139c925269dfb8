"""Short runs with every check there is: run-time checks, sanitizers, valgrind.

usage: python verification/soak/checked_builds.py [NAME ...] [--cells N] [--how debug|san|valgrind]

Every case of `input` and `verification/cases` (or those whose folder or file is named) with at most
N cells makes a few steps with ./mics_debug (made by `make DEBUG=1`: bounds, unset and overflowing
numbers), ./mics_san (`make SAN=1`: address and undefined behaviour) and, if it is small, with
./mics_debug under valgrind (uninitialised memory), and is continued from its restart file. Each
must end with code 0 and no word on standard error but the program's own.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import f90nml

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "verification"))

from run_cases import CASES, changed, prepare  # noqa: E402

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
    Check(
        "valgrind",
        ("valgrind", "-q", "--error-exitcode=99", str(ROOT / "mics_debug")),
        10_000,
    ),
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
    done = subprocess.run(
        [*check.command, "--quiet", "--max-wall", "0:01:00", *words],
        cwd=work,
        env={**os.environ, **SETTINGS},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
    )
    foreign = [row for row in done.stderr.splitlines() if not row.startswith(("mics: ", "  "))]
    if done.returncode not in (0, 143) or foreign:
        return f"{' '.join(words)}: code {done.returncode}: {done.stderr[:2000]}"
    return ""


def try_case(check: Check, name: str, text: str, work: Path) -> str:
    """What is wrong with some steps of a case and a restart; empty if nothing is."""
    short, longer, cells = shortened(text)
    if cells > check.cells:
        return ""
    (work / "short.nml").write_text(short)
    (work / "longer.nml").write_text(longer)
    shutil.rmtree(work / "out", ignore_errors=True)
    began = time.monotonic()
    found = run(check, ["--output", "out", "short.nml"], work)
    newest = sorted((work / "out").glob("restart-?.h5"), key=lambda path: path.stat().st_mtime_ns)
    if not found and newest:
        found = run(check, ["--restart", str(newest[-1]), "longer.nml"], work)
    verdict = "FAILS" if found else "holds"
    print(f"{check.name:9}{verdict} {name} {time.monotonic() - began:.1f} s", flush=True)
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


def main() -> int:
    """Print a line per case and check; 1 if any failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all cases")
    parser.add_argument("--how", choices=[check.name for check in CHECKS], action="append")
    parser.add_argument("--cells", type=int, default=100_000, help="leave out larger cases")
    chosen = parser.parse_args()
    failed, ran = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for name, path in cases(Path(folder)):
            if chosen.names and not any(name.startswith(each) for each in chosen.names):
                continue
            text = path.read_text()
            if shortened(text)[2] > chosen.cells:
                continue
            for check in CHECKS:
                if chosen.how and check.name not in chosen.how:
                    continue
                if not check.there:
                    print(f"{check.name}: {' '.join(check.command)} is not there")
                    failed += 1
                    continue
                found = try_case(check, name, text, path.parent)
                ran += 1
                failed += bool(found)
                print(f"    {found}\n" if found else "", end="", flush=True)
    print(f"{failed} of {ran} fail")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
