"""Run verification cases and their checks.

usage: python verification/run_cases.py [CASE ...] [--program ./mics] [--ranks N] [--threads N]
                                        [--cost SECONDS]

Every run of a case (see verification/README.md) goes into OUT/<case>/<name of the run>; then the
folder's check.py gets all of them. The exit code is the number of cases that failed.

A prepare.py in the folder is run first, in OUT/<case>: it writes the initial states that the case
files name, and may write further case files there.
"""

import argparse
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import f90nml

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))

from measures import expect  # noqa: E402
from measures.checks import Checks, sound  # noqa: E402
from micstools.cases import settings  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402

CASES = ROOT / "verification" / "cases"
MPI_SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}
KNOWN_MISSES = tomllib.loads((ROOT / "verification" / "known_misses.toml").read_text())
COST = 10.0
"""Seconds on one core that a run takes which does not say so; the longest run of `make test`."""


@dataclass(frozen=True)
class Machine:
    """Which program runs a case and on how much of the computer."""

    program: Path = ROOT / "mics"
    ranks: int = 1
    threads: int = 0  # 0: the program's own choice

    @property
    def command(self) -> list[str]:
        """Everything before the program's own arguments that belong to a case."""
        start = []
        if self.program.name.startswith("mics_mpi"):
            start = ["mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(self.ranks)]
        threads = ["--threads", str(self.threads)] if self.threads else []
        return [*start, str(self.program), "--quiet", *threads]

    @property
    def patience(self) -> dict[str, str]:
        """Threads that share a core must not spin while they wait."""
        crowded = self.ranks * max(1, self.threads) > (os.cpu_count() or 1)
        return {"OMP_WAIT_POLICY": "passive"} if crowded else {}


@dataclass(frozen=True)
class Planned:
    """One run of a case."""

    case: str
    name: str
    text: str  # of the case file
    cost: float  # about that many seconds on one core
    fine: bool = False  # beyond what three resolutions need: for `FULL=1 make verify` only

    def write(self, work: Path) -> Path:
        """Put the case file into a folder of its own beside the results."""
        path = work / "cases" / f"{self.name}.nml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self.text)
        return path


def names() -> list[str]:
    """All cases that have a check."""
    tables = CASES.glob("*/expect.toml")
    return sorted(path.parent.name for path in [*CASES.glob("*/check.py"), *tables])


def prepare(name: str, work: Path) -> list[Path]:
    """Make what a case needs in a folder; all its case files. They run in that folder."""
    work.mkdir(parents=True, exist_ok=True)
    for old in work.glob("*.nml"):
        old.unlink()
    script = CASES / name / "prepare.py"
    if script.exists():
        paths = {"PYTHONPATH": str(ROOT / "tools")}
        subprocess.run([sys.executable, str(script)], cwd=work, check=True, env=os.environ | paths)
    return sorted([*(CASES / name).glob("*.nml"), *work.glob("*.nml")])


def planned(case: str, work: Path) -> list[Planned]:
    """The runs of a case: every *.nml, and for every table in variants.toml the file `from`
    (case.nml) with some values changed."""
    folder, found = CASES / case, []
    for path in prepare(case, work):
        text = path.read_text()
        stated = re.search(r"^! cost: ([\d.]+) s", text, re.MULTILINE)
        own_cost = float(stated[1]) if stated else COST
        found.append(Planned(case, path.stem, text, own_cost))
    if (folder / "variants.toml").is_file():
        tables = tomllib.loads((folder / "variants.toml").read_text())
        for name, table in tables.items():
            base = folder / table.pop("from", "case.nml")
            own_cost, fine = float(table.pop("cost", COST)), bool(table.pop("fine", False))
            found.append(Planned(case, name, changed(base.read_text(), table), own_cost, fine))
    return found


def quick(plans: list[Planned]) -> list[Planned]:
    """Those of the runs of a case that `make test` takes: short ones that are not known to break
    off, of these the ones that fit a pattern of `QUICK` in check.py, if there are any."""
    patterns = getattr(checker(plans[0].case), "QUICK", ("*",)) if plans else ()
    short = [p for p in plans if p.cost <= COST and p.name not in KNOWN_MISSES.get(p.case, {})]
    return [plan for plan in short if any(fnmatch(plan.name, pattern) for pattern in patterns)]


def changed(text: str, groups: dict[str, Any]) -> str:
    """A case file with other values: for each group a table, or a list of tables for a group that
    is repeated, one for each occurrence in order. A group that is not there is added; those of a
    name whose values are False are taken out."""
    for name, start, end in reversed(settings.groups(text)):
        text = text[:start] + text[end:] if groups.get(name) is False else text
    case = f90nml.reads(text)
    for group, values in groups.items():
        if values is False:
            continue
        present = case.get(group, [])
        present = list(present) if isinstance(present, list) else [present]
        for k, table in enumerate(values if isinstance(values, list) else [values]):
            if k < len(present):
                present[k].update(table)
            else:
                case.add_cogroup(group, table)
    return f"{case}\n"


def run(case: Path, output: Path, machine: Machine, *options: str) -> float:
    """Run one case file into a fresh folder; the seconds it took."""
    shutil.rmtree(output, ignore_errors=True)
    output.parent.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    done = subprocess.run(
        [*machine.command, *options, "--output", str(output.resolve()), str(case.resolve())],
        cwd=output.parent,
        env={**os.environ, **MPI_SETTINGS, **machine.patience},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{case.name} ended with code {done.returncode}\n{done.stderr[-2000:]}")
    return time.perf_counter() - began


def checker(case: str) -> ModuleType | SimpleNamespace:
    """The check.py of a case: `check(runs, checks)`, and `VARIES` if its runs leave the defaults;
    or the table in its place."""
    path = CASES / case / "check.py"
    if not path.exists():
        return expect.module(path.with_name("expect.toml"))
    spec = importlib.util.spec_from_file_location(f"check_{case}", path)
    if spec is None or spec.loader is None:
        raise RuntimeError(f"cannot read {path}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def judge(name: str, runs: list[Run]) -> Checks:
    """The check of a case on its runs, and what has to hold in each of them."""
    checks = Checks(name)
    checker(name).check(runs, checks)
    checks.know(KNOWN_MISSES.get(name, {}))
    for run in runs:
        sound(run, checks)
    return checks


def verify(name: str, out: Path, machine: Machine, plans: list[Planned]) -> tuple[bool, str]:
    """Run these of a case, and its check; whether it holds, and the report."""
    folders, lines = [], []
    for plan in plans:
        folder, case = out / name / plan.name, plan.write(out / name)
        seconds = run(case, folder, machine)
        lines.append(f"{name}/{plan.name}: {seconds:.1f} s")
        folders.append(folder)
    checks = judge(name, [Run(folder) for folder in folders])
    return checks.failed == 0, "\n".join([*lines, checks.text(), ""])


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", default=names(), help="default: all")
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "cases")
    parser.add_argument("--cost", type=float, default=float("inf"), help="leave out longer runs")
    given = parser.parse_args()
    machine = Machine(given.program.resolve(), given.ranks, given.threads)
    failed = 0
    for name in given.case:
        try:
            plans = planned(name, given.out / name)
            chosen = [plan for plan in plans if plan.cost <= given.cost]
            holds, report = verify(name, given.out, machine, chosen)
        except RuntimeError as problem:
            holds, report = False, str(problem)
        print(report, flush=True)
        failed += not holds
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
