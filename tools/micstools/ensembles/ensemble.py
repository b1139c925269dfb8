"""An ensemble: which runs it has, a folder and a case each, and how each of them ended.

    DIR/ensemble.csv, ensemble.json     a row per run; settings, counts and shares
    DIR/0001/case.nml, files.json       what the program was given, seed included
    DIR/0001/result/                    its results
    DIR/0001/log.txt                    what it said

How a run ended is read from these files alone, so it does not matter who ran it, or when.
"""

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from micstools.cases import case_copy, settings
from micstools.cases.settings import Setting
from micstools.reading import result_file
from micstools.reading.reader import BadRun

OUTCOMES = ("settled", "time over", "no room")
NO_FIELDS = {"field_interval": 0.0}
UNATTENDED = {"stop_when_settled": True}
NO_ROOM = "never found room"
_INTERRUPTED = (-1, 130, 143)


@dataclass(frozen=True)
class Plan:
    """What the runs of an ensemble have in common, and what differs."""

    text: str  # of the case
    folder: Path
    runs: int  # of each choice
    seed: int
    spread: float | None = None  # [m]
    tilt: float | None = None  # [degrees]
    choices: tuple[tuple[Setting, ...], ...] = ((),)
    loads: tuple[str, ...] = ()  # files, taken in turn


@dataclass(frozen=True)
class Member:
    """One run."""

    number: int  # from 1
    seed: int
    choice: tuple[Setting, ...]
    text: str
    folder: Path
    load: str = ""

    @property
    def case(self) -> Path:
        """The case file."""
        return self.folder / "case.nml"

    @property
    def result(self) -> Path:
        """The output folder of the program."""
        return self.folder / "result"

    @property
    def log(self) -> Path:
        """What the program said."""
        return self.folder / "log.txt"


@dataclass(frozen=True)
class State:
    """How a run ended."""

    outcome: str  # one of OUTCOMES, or 'failed', 'interrupted', 'missing'
    code: int | None = None
    time: float = float("nan")  # [s]
    reason: str = ""

    @property
    def counts(self) -> bool:
        """Is it done, never to be run again?"""
        return self.outcome in OUTCOMES


def product(choices: Sequence[Sequence[Setting]]) -> tuple[tuple[Setting, ...], ...]:
    """Every combination of the varied variables."""
    return tuple(itertools.product(*choices))


def seed_of(base: int, index: int, group: int = 0) -> int:
    """Seed of a run (from 0) and a &drop group, from the base seed: any two differ in practice."""
    state = np.random.SeedSequence([base, index, group]).generate_state(1)
    return int(state[0]) & 0x7FFFFFFF


def members(plan: Plan, fields: bool = False) -> Iterator[Member]:
    """All runs; the same seeds for every choice, so that choices differ in nothing else. More runs
    come after those that were there, so an ensemble may grow. `fields`: write those of the water,
    as often as the case says."""
    for number, (index, choice) in enumerate(
        itertools.product(range(plan.runs), plan.choices), start=1
    ):
        text = settings.set_variables(plan.text, choice)
        text = settings.set_group(text, "run", ({} if fields else NO_FIELDS) | UNATTENDED)
        load = plan.loads[index % len(plan.loads)] if plan.loads else ""
        text = with_load(text, load) if load else text
        for group in range(sum(name == "drop" for name, _, _ in settings.groups(text))):
            drawn: dict[str, Any] = {"seed": seed_of(plan.seed, index, group)}
            if plan.spread is not None:
                drawn["spread"] = [plan.spread, plan.spread, 0.0]
            if plan.tilt is not None:
                drawn["tilt_deg"] = plan.tilt
            text = settings.set_group(text, "drop", drawn, group)
        folder = plan.folder / f"{number:04d}"
        yield Member(number, seed_of(plan.seed, index), choice, text, folder, load)


def with_load(text: str, load: str) -> str:
    """The case with blocks from a file, a plan (.csv) or the run.h5 in which they were left, in
    place of those of its plan."""
    if load.lower().endswith(".csv"):
        plans = [n for n, group in enumerate(_groups(text, "drop")) if group.get("file")]
        return settings.set_group(text, "drop", {"file": load}, plans[0] if plans else None)
    for name, start, end in reversed(settings.groups(text)):
        if name == "drop" and settings.variables(text[start:end]).get("file"):
            text = text[:start] + text[end:]
    return settings.set_group(text, "start", {"file": load})


def is_random(text: str) -> bool:
    """Do the seeds of a case's drops change anything: a place, an attitude or the stone, the shape
    that is drawn?"""
    stones = {str(g.get("name")) for g in _groups(text, "shape") if g.get("kind") == "rock"}
    for drop in _groups(text, "drop"):
        path = Path(str(drop.get("file") or ""))
        rows = path.read_text(errors="replace") if path.is_file() else ""
        drawn = {drop.get("shape"), *re.split(r"[\s,;]+", rows)}
        scattered = any(drop.get(name) not in (None, 0, 0.0, [0, 0, 0], "given")
                        for name in ("spread", "tilt_deg", "orientation"))  # fmt: skip
        if scattered or stones & drawn or isinstance(drop.get("shapes"), list):
            return True
    return False


def _groups(text: str, wanted: str) -> list[dict[str, Any]]:
    found = [text[start:end] for name, start, end in settings.groups(text) if name == wanted]
    return [settings.variables(group) for group in found]


def write_case(member: Member) -> None:
    """Make the folder of a run; one that was made for another case is left alone."""
    case_copy.keep(member.case, member.text)


def state(member: Member) -> State:
    """How a run ended, from its files."""
    said = member.log.read_text(errors="replace").strip() if member.log.exists() else ""
    last = said.splitlines()[-1] if said else ""
    path = member.result / "run.h5"
    if not path.is_file():
        return State("failed", None, reason=last) if said else State("missing")
    try:
        code, time = result_file.take(path, _end, waits=())
    except BadRun as error:
        return State("failed", None, reason=last or str(error))
    if code == 0:
        end = float(settings.value(member.text, "run", "t_end"))
        return State("time over" if time >= end - 1e-9 else "settled", code, time)
    if code == 3 and NO_ROOM in said:
        return State("no room", code, time)
    if code in _INTERRUPTED:
        return State("interrupted", code, time, last)
    return State("failed", code, time, last)


def _end(h5: h5py.File) -> tuple[int, float]:
    """Exit status and last time [s]."""
    status = np.ravel(h5["provenance"].attrs["exit_status"])[0]
    return int(status), float(h5["series/time"][-1])
