"""Run the verification cases, two at a time, and write verification/report/index.html.

usage: python verification/verify.py [CASE ...]      (`make verify`)

Finished runs are kept in build/verify as long as program and case file stay the same; a run that
was stopped goes on from its restart file. Environment: QUICK=1 only short runs, 15 minutes at
most; FULL=1 the fine grids too, a day at most; else three hours. Exit code 1: something misses that
known_misses.toml does not name, or was not run.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from micstools.cases import initial_state
from report import Case, Finished, note_options, write
from run_cases import (
    CASES,
    KNOWN_MISSES,
    MPI_SETTINGS,
    ROOT,
    Machine,
    Planned,
    Run,
    checker,
    judge,
    names,
    planned,
    run,
)

OUT = ROOT / "build" / "verify"
REPORT = ROOT / "verification" / "report"
AT_ONCE = 2


@dataclass(frozen=True)
class Level:
    """How much is run."""

    name: str
    cost: float  # longest run [s on one core]
    limit: float  # all together [s]
    fine: bool = False  # with the runs that are marked as fine

    def takes(self, plan: Planned) -> bool:
        """Whether a run belongs to this level."""
        return plan.cost <= self.cost and (self.fine or not plan.fine)

    def needs(self, plans: list[Planned]) -> float:
        """What its part of the runs, and the programs of cases without runs, take together [s]."""
        programs = [getattr(checker(name), "COST", 0.0) for name in names()]
        costs = [plan.cost for plan in plans if self.takes(plan)]
        return (sum(costs) + sum(cost for cost in programs if cost <= self.cost)) / AT_ONCE


LEVELS = {
    "QUICK": Level("quick", 30.0, 900.0),
    "": Level("normal", 2500.0, 3 * 3600.0),
    "FULL": Level("full", float("inf"), 24 * 3600.0, fine=True),
}


def level() -> Level:
    """The level that the environment asks for."""
    return LEVELS[next((name for name in ("QUICK", "FULL") if os.environ.get(name)), "")]


def program_key() -> str:
    """Changes with the sources of the program and with compiler and flags."""
    digest = hashlib.sha256()
    for path in [*sorted((ROOT / "src").rglob("*.f90")), ROOT / "build" / "serial" / "settings"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def prepared_key(case: str) -> str:
    """Changes with what prepares a case, and the tables that it put beside the runs."""
    sources = [CASES / case / "prepare.py", Path(initial_state.__file__)]
    tables = [path for end in ("txt", "csv") for path in sorted((OUT / case).glob(f"*.{end}"))]
    return "".join(p.read_text() for p in sources + tables) if sources[0].is_file() else ""


class Progress:
    """One line about what is going on, and the processes to stop when time is up."""

    def __init__(self, total: int, limit: float) -> None:
        """Count from zero; the clock starts now."""
        self.total, self.done, self.deadline = total, 0, time.monotonic() + limit
        self.running: dict[str, subprocess.Popen[str]] = {}
        self.lock, self.over = threading.Lock(), threading.Event()

    def show(self, said: str = "") -> None:
        """Write the line anew; `said` stays above it."""
        left = max(0.0, self.deadline - time.monotonic())
        line = f"{self.done}/{self.total} runs, {left / 60:.0f} min at most left"
        line += f"; now {', '.join(self.running)}" if self.running else ""
        if sys.stdout.isatty():
            print(f"\r\033[K{said}\n{line}" if said else f"\r\033[K{line}", end="", flush=True)
        elif said:
            print(f"[{self.done}/{self.total}] {said}", flush=True)

    def watch(self) -> None:
        """Renew the line until all is over; stop what still runs at the deadline."""
        while not self.over.wait(2.0):
            self.show()
            if time.monotonic() > self.deadline:
                with self.lock:
                    for process in self.running.values():
                        process.terminate()


def compute(plan: Planned, key: str, progress: Progress) -> Finished:
    """Run a case file, or go on with it, or keep what is there."""
    folder = OUT / plan.case / plan.name
    note = folder.with_suffix(".json")
    key = hashlib.sha256((key + prepared_key(plan.case) + plan.text).encode()).hexdigest()
    before = json.loads(note.read_text()) if note.is_file() else {}
    before = before if before.get("key") == key else {}
    finished = Finished(plan.name, str(folder), before.get("seconds", 0.0), before.get("ended", ""))
    if finished.ended == "code 0":
        progress.done += 1
        return finished
    if time.monotonic() > progress.deadline:
        return Finished(plan.name, str(folder), finished.seconds, finished.ended or "not run")
    newest = sorted(folder.glob("restart-?.h5"), key=lambda path: path.stat().st_mtime_ns)[-1:]
    if before and newest:
        where = ["--restart", str(newest[0])]
    else:
        shutil.rmtree(folder, ignore_errors=True)
        where = ["--output", str(folder)]
    case = plan.write(folder.parent)
    note.write_text(json.dumps({"key": key, **asdict(finished)}))
    began = time.monotonic()
    process = subprocess.Popen(
        [*Machine(threads=1).command, *where, str(case)],
        cwd=folder.parent,
        env={**os.environ, **MPI_SETTINGS},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    label = f"{plan.case}/{plan.name}"
    with progress.lock:
        progress.running[label] = process
    said = process.communicate()[1]
    with progress.lock:
        del progress.running[label]
        progress.done += 1
    seconds = time.monotonic() - began
    ended = f"code {process.returncode}"
    if process.returncode in (-15, 143):
        ended = "stopped: no time left"
    elif process.returncode:
        ended += f": {' '.join(said.split())[-300:]}"
    finished = Finished(plan.name, str(folder), finished.seconds + seconds, ended)
    note.write_text(json.dumps({"key": key, **asdict(finished)}))
    progress.show(f"{label}: {ended}, {seconds:.0f} s")
    return finished


def main() -> int:
    """Run, check, report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", default=names(), help="default: all")
    chosen, wanted = parser.parse_args().case, level()
    every = {case: planned(case, OUT / case) for case in chosen}
    plans = [plan for runs in every.values() for plan in runs if wanted.takes(plan)]
    plans.sort(key=lambda plan: plan.cost, reverse=True)  # so that none runs alone at the end
    progress, key = Progress(len(plans), wanted.limit), program_key()
    threading.Thread(target=progress.watch, daemon=True).start()
    with ThreadPoolExecutor(AT_ONCE) as pool:
        ran = list(pool.map(lambda plan: compute(plan, key, progress), plans))
    progress.over.set()

    cases, plain, new = [], defaults(), list[str]()
    for name in chosen:
        mine = [run for plan, run in zip(plans, ran, strict=True) if plan.case == name]
        left_out = [plan.name for plan in every[name] if not wanted.takes(plan)]
        module = checker(name)
        case = Case(name, getattr(module, "VARIES", ()), mine, left_out)
        good = [Run(run.folder) for run in sorted(mine, key=lambda r: r.name) if run.good]
        try:
            alone = not every[name] and getattr(module, "COST", 0.0) <= wanted.cost
            case.checks = judge(name, good) if good or alone else None
        except Exception as problem:  # a check must not take the report with it
            case.problem = f"check.py: {type(problem).__name__}: {problem}"
        note_options(case, plain)
        cases.append(case)
        print(f"{case.verdict:8} {name}")
        new += news(case)
    write(cases, REPORT, plain, wanted.name)
    print(f"report: {(REPORT / 'index.html').relative_to(ROOT)}")
    print("\n".join(f"not known: {words}" for words in new) or "all misses are known")
    return int(bool(new))


def news(case: Case) -> list[str]:
    """What of a case misses, or was not run, and is not known to."""
    known, results = KNOWN_MISSES.get(case.name, {}), []
    if case.checks:
        results = case.checks.results + case.checks.routine
    found = [r.quantity for r in results if r.counts and not (r.holds or r.known)]
    found += [
        f"{run.name}: {run.ended}" for run in case.runs if not (run.good or run.name in known)
    ]
    return [f"{case.name}: {words}" for words in [*found, *case.strange, case.problem] if words]


def defaults() -> Run:
    """A run of a case that leaves every option alone."""
    case = OUT / "defaults.nml"
    OUT.mkdir(parents=True, exist_ok=True)
    case.write_text(
        "&run physics = 'dry'  t_end = 0.01  restart_interval = 0.0 /\n"
        "&grid cells = 4, 4, 4  length = 1.0, 1.0, 1.0 /\n"
        "&shape name = 'ball'  kind = 'sphere'  size = 0.1 /\n"
        "&body shape = 'ball'  position = 0.5, 0.5, 0.5 /\n"
    )
    run(case, OUT / "defaults", Machine(threads=1))
    return Run(OUT / "defaults")


if __name__ == "__main__":
    sys.exit(main())
