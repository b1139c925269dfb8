"""Many runs of one case that differ by chance, or in a variable."""

import argparse
import contextlib
import fcntl
import os
import re
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from micstools.cases import program, settings
from micstools.ensembles import (
    ensemble,
    ensemble_engine,
    ensemble_fields,
    ensemble_queue,
    ensemble_table,
    slurm,
)
from micstools.ensembles.ensemble import Member, Plan, State
from micstools.ensembles.ensemble_engine import Engine
from micstools.piles import pile_ensemble
from micstools.reading.reader import BadRun

STOPPED = 130
"""Exit code after Ctrl-C."""


def _plan(given: argparse.Namespace) -> Plan:
    for word in [*given.vary, *given.settings]:
        if re.match(r"\s*drop\.seed\s*=", word):
            raise BadRun(f"{word}: the seeds of all runs are drawn from --seed")
    text = program.case_text(given.case, given.settings)
    choices = ensemble.product([settings.parse_choices(word) for word in given.vary])
    if any(choices.count(choice) > 1 for choice in choices):
        raise BadRun(f"--vary {' '.join(given.vary)}: a value stands twice (a decimal has a point)")
    loads = tuple(str(load) for path in given.start for load in _loads(path))
    if not (runs := given.runs or len(loads)):
        raise BadRun("--runs: how many? (with --start by default one for each load)")
    for word in given.vary:
        if re.fullmatch(r"[^=]+=\s*[+-]?\d+(,[+-]?\d+)+\s*", word):
            many = word.count(",") + 1
            print(f"--vary {word}: {many} values (a decimal has a point)", file=sys.stderr)
    folder = given.out or Path(f"mics-ensemble-{given.case.stem}")
    return Plan(text, folder, runs, given.seed, given.spread, given.tilt, choices, loads)


def _loads(path: Path) -> list[Path]:
    """The load of a plan or of results, or those of an ensemble, of its runs that settled."""
    if not pile_ensemble.is_ensemble(path):
        found = path / "run.h5" if path.is_dir() else path
        if not found.is_file():
            raise BadRun(f"--start {path}: is no plan (.csv), no run.h5, and no folder of results")
        return [found]
    rows = pile_ensemble.about(path / "ensemble.json")["table"]
    left = [f"{row['run']} ({row['outcome']})" for row in rows if row["outcome"] != "settled"]
    if left:
        print(f"--start {path}: left out {len(left)} of {len(rows)} runs: {', '.join(left)}",
              file=sys.stderr)  # fmt: skip
    if len(left) == len(rows):
        raise BadRun(f"--start {path}: no run settled")
    return [path / row["folder"] / "result/run.h5" for row in rows if row["outcome"] == "settled"]


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[IO[str]]:
    """Hold the folder, so that a second call there is refused; the system frees it after a kill."""
    known = (folder / "ensemble.lock").exists()
    if folder.exists() and not known and (not folder.is_dir() or any(folder.iterdir())):
        raise BadRun(f"{folder} is there and is no ensemble: give another --out")
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "ensemble.lock").open("a+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            lock.seek(0)
            raise BadRun(f"{folder} is in use by process {lock.read().strip()}") from error
        lock.truncate(0)
        lock.write(f"{os.getpid()} on {os.uname().nodename}\n")
        lock.flush()
        yield lock


class _Live:
    """Tells of the runs that end: a line that changes on a terminal, else a line each."""

    def __init__(self, plan: Plan, table: dict[Member, State]) -> None:
        self.plan, self.table = plan, table
        self.left = sum(not end.counts for end in table.values())
        self.todo, self.start = self.left, time.monotonic()
        self.terminal = sys.stdout.isatty()

    def ended(self, member: Member, end: State) -> None:
        """One run came to its end."""
        self.table[member], self.left = end, self.left - 1
        ensemble_table.write(self.plan, self.table)
        if not end.counts:
            text = f"run {member.number:04d} {end.outcome}: {end.reason or end.code}"
            print(f"\r{text}\033[K" if self.terminal else text)
        passed = time.monotonic() - self.start
        left = passed / (self.todo - self.left) * self.left
        done = sum(known.counts for known in self.table.values())
        text = f"{done} of {len(self.table)} done"
        text += f" | {ensemble_table.sentence(self.table)} | {left / 60:.1f} min left"
        print(f"\r{text}\033[K" if self.terminal else text, end="" if self.terminal else "\n")
        sys.stdout.flush()

    def close(self) -> None:
        """Leave the last line standing."""
        if self.terminal:
            print()


def work(given: argparse.Namespace) -> int:
    queue = ensemble_queue.parse(given.cluster) if given.cluster else None
    if queue and given.slurm is not None:
        raise BadRun(f"{ensemble_queue.OPTION} runs, --slurm only writes a script: give one")
    plan, engine = _plan(given), Engine(program.find(given.program, given.case), given.jobs, queue)
    members = list(ensemble.members(plan))
    if plan.runs > max(1, len(plan.loads)) and not ensemble.is_random(members[0].text):
        raise BadRun("nothing is left to chance in this case: give --spread or --tilt")
    wanted, again = _kept(given, plan, len(members))
    # check the first run of each choice and say what one takes
    said = [program.check(engine.program, m.text) for m in members[: len(plan.choices)]]
    found = re.search(r"time of the run\s+(.*)", said[0])
    cost = found[1] if found else "unknown"
    with _alone(plan.folder):
        for member in members:
            ensemble.write_case(member)
        table = {member: ensemble.state(member) for member in members}
        waiting = [member for member, end in table.items() if not end.counts]
        print(f"{len(members)} runs in {plan.folder}, {len(waiting)} of them to do; "
              f"each takes {cost}; {min(given.jobs, len(waiting))} at once")  # fmt: skip
        sys.stdout.flush()
        ensemble_table.write(plan, table)
        if given.slurm is not None:
            script, numbers = plan.folder / "array.sh", [m.number for m in waiting]
            script.write_text(slurm.script(plan.folder, numbers, engine.program, given.slurm))
            print(f"sbatch {script}")
            return 0
        code = _compute(plan, table, waiting, engine)
        if again is None or code == STOPPED:
            return code
        numbers = wanted or ensemble_fields.medians(table)
        return max(code, _run_again([again[number - 1] for number in numbers], engine))


def _kept(
    given: argparse.Namespace, plan: Plan, runs: int
) -> tuple[list[int], list[Member] | None]:
    """Of --keep-fields the numbers of the runs, none for the median, and every run with fields."""
    if given.keep_fields is None:
        return [], None
    if given.slurm is not None:
        raise BadRun("--keep-fields comes after the runs: give it in the call without --slurm")
    return ensemble_fields.parse(given.keep_fields, runs), ensemble_fields.with_fields(plan)


def _run_again(chosen: list[Member], engine: Engine) -> int:
    """Run members with their fields, as far as that is not done yet."""
    for member in chosen:
        ensemble.write_case(member)
    waiting = [member for member in chosen if not ensemble.state(member).counts]
    print(f"with fields: {ensemble_fields.numbered(m.number for m in chosen)}, "
          f"{len(waiting)} of them to do", flush=True)  # fmt: skip
    try:
        if waiting:
            ensemble_engine.run_all(waiting, engine, lambda *_: None)
    except KeyboardInterrupt:
        print("stopped; the same command goes on where each run stood", file=sys.stderr)
        return STOPPED
    failed = [member for member in chosen if not ensemble.state(member).counts]
    for member in chosen:
        if member not in failed:
            print(member.result)
    for member in failed:
        print(f"mics-tools ensemble: {member.folder} failed: {ensemble.state(member).reason}",
              file=sys.stderr)  # fmt: skip
    return 3 if failed else 0


def _compute(plan: Plan, table: dict[Member, State], waiting: list[Member], engine: Engine) -> int:
    live = _Live(plan, table)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    stopped = False
    try:
        if waiting:
            ensemble_engine.run_all(waiting, engine, live.ended)
    except KeyboardInterrupt:
        stopped = True
    live.close()
    for member in waiting:
        table[member] = ensemble.state(member)
    ensemble_table.write(plan, table)
    print(f"{ensemble_table.sentence(table)}\n{plan.folder / 'ensemble.csv'}")
    failed = [m.number for m, end in table.items() if not end.counts]
    if stopped:
        print("stopped; the same command goes on where each run stood", file=sys.stderr)
        return STOPPED
    if failed:
        names = ensemble_fields.numbered(failed)
        print(f"mics-tools ensemble: failed: {names}; the same command tries again, "
              f"{plan.folder}/{failed[0]:04d}/log.txt tells why", file=sys.stderr)  # fmt: skip
    return 3 if failed else 0
