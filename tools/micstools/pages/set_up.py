"""The set-up of a case as the program reads it: `mics --check --plan` puts it into a file laid out
as `run.h5`, and prints its plan and its warnings."""

import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np

from micstools.cases import settings
from micstools.pages import falls
from micstools.reading.reader import BadRun, Run
from micstools.shapes.geometry import Array, IntArray

_LINE = re.compile(r" \(line (\d+)\)$")
_NAMED = re.compile(r"&(\w+)\s+(\w+)?")
_WARNING = "  warning: "
_LABEL = 2 + 24  # columns of the names in the plan
_TABLES = ("Shapes",)  # parts of the plan in columns of a fixed width
_FIGURE = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
_MANY = 3  # messages that differ in their figures alone are told as one


@dataclass(frozen=True)
class Remark:
    """What the program says about a place of the case, a warning or an error."""

    text: str
    group: str = ""  # that it concerns, empty where it names none
    variable: str = ""
    occurrence: int = 0  # of the group, from 0
    line: int = 0  # of the case, 0: not told
    more: tuple["Remark", ...] = ()  # of its kind

    @property
    def place(self) -> str:
        """Its line, and how many more there are."""
        said = [f"line {self.line}"] if self.line else []
        if self.more:
            said.append(f"{len(self.more)} more of this kind, the last in {self.more[-1].line}")
        return f" ({'; '.join(said)})" if said else ""


@dataclass(frozen=True)
class Part:
    """A part of the plan: its heading, pairs of a name and a text, and lines to leave as they
    are."""

    heading: str
    pairs: list[tuple[str, str]]
    table: str = ""


@dataclass(frozen=True)
class SetUp:
    """A checked case. `run` has one row, the starting poses, or those of the bodies that move as
    prescribed over the run; every release time in it is the due one."""

    run: Run
    text: str  # the case
    plan: list[Part]
    warnings: list[Remark]
    line: IntArray  # (N) of each body in the case
    place: Array  # (N, 3) before the random shift [m]
    spread: Array  # (N, 3) the random shift at most [m]

    def entry(self, heading: str, name: str) -> str:
        """What the plan says under a name; empty where it says nothing."""
        pairs = next((part.pairs for part in self.plan if part.heading == heading), [])
        return next((text for label, text in pairs if label == name), "")

    def bodies_of(self, remark: Remark) -> list[int]:
        """Numbers, from 0, of the bodies that a remark and those of its kind concern."""
        found = [k for one in (remark, *remark.more) for k in self._bodies_of(one)]
        return list(dict.fromkeys(found))

    def _bodies_of(self, remark: Remark) -> list[int]:
        if remark.group == "shape":
            name = settings.value(self.text, "shape", "name", remark.occurrence)
            wanted = re.escape(str(name or "").strip())
            stones = re.compile(rf"{wanted}(-\d+)?")  # of a family of rock, too
            names = self.run.bodies.shape
            return [k for k, shape in enumerate(names) if stones.fullmatch(shape)][:1]  # for all
        if remark.group not in ("body", "drop"):
            return []
        found = [g for g in spans(self.text) if g[0] == remark.group]
        if remark.occurrence >= len(found):
            return []
        _, first, last = found[remark.occurrence]
        return [int(k) for k in np.flatnonzero((self.line >= first) & (self.line <= last))]


class Refused(BadRun):
    """The program refuses a case; `remarks` say why."""

    def __init__(self, words: str, text: str) -> None:
        """`words`: what it wrote; `text`: the case."""
        super().__init__(words)
        lines = [line.removeprefix("mics: ") for line in words.splitlines()]
        self.remarks = [remark_of(line, text) for line in lines if line.strip()]


@contextmanager
def read(program: Path, text: str, patience: float | None = None) -> Iterator[SetUp]:
    """The set-up of a case of this text; files that it names are taken from where we are. It is
    there within the `with` only. Raises `Refused`, also where it takes more than `patience` [s]."""
    with tempfile.TemporaryDirectory(prefix="mics-plan-") as folder:
        file = Path(folder, "run.h5")
        words = [str(program), "--check", "--threads", "1", "--plan", str(file)]
        try:
            done = subprocess.run(
                words, input=text, capture_output=True, text=True, timeout=patience
            )
        except subprocess.TimeoutExpired as late:
            raise Refused(f"the check takes more than {patience} s", text) from late
        if done.returncode:
            said = done.stderr.strip() or f"{program} ended with code {done.returncode}"
            raise Refused(said, text)
        yield _found(Run(folder), text, done.stdout)


def _found(run: Run, text: str, said: str) -> SetUp:
    with h5py.File(run.folder / "run.h5") as h5:
        plan = {name: h5["plan"][name][:] for name in ("line", "place", "spread")}
        due = h5["bodies/release_time"][:]
    # nothing waits for room yet
    run.__dict__["bodies"] = replace(run.bodies, release_time=due, entry_time=due)
    parts = parts_of(said)
    if told := falls.falls(run, plan["line"]):
        steps = next(k for k, part in enumerate(parts) if part.heading == "Time steps")
        parts.insert(steps, Part("Falls", [(name, "; ".join(words)) for name, words in told]))
    return SetUp(run, text, parts, _warnings(said, text), **plan)


def shorter(plan: str) -> str:
    """The plan as the program prints it, with one warning of each kind."""
    lines = [line for line in plan.splitlines() if not line.startswith(_WARNING)]
    lines += [f"{_WARNING}{remark.text}{remark.place}" for remark in _warnings(plan, "")]
    return "".join(f"{line}\n" for line in lines)


def _warnings(plan: str, text: str) -> list[Remark]:
    """Of a plan as printed; many that differ in their figures alone are one."""
    lines = [line for line in plan.splitlines() if line.startswith(_WARNING)]
    remarks = [remark_of(line.removeprefix(_WARNING), text) for line in lines]
    names = [_FIGURE.sub("", remark.text) for remark in remarks]
    found: dict[str, list[Remark]] = {}
    for remark, name in zip(remarks, names, strict=True):
        found.setdefault(name if names.count(name) >= _MANY else remark.text, []).append(remark)
    return [replace(first, more=tuple(more)) for first, *more in found.values()]


def spans(text: str) -> list[tuple[str, int, int]]:
    """Every group of a case: its name, its first and its last line, from 1."""
    return [
        (name, 1 + text.count("\n", 0, start), 1 + text.count("\n", 0, end))
        for name, start, end in settings.groups(text)
    ]


def remark_of(said: str, text: str) -> Remark:
    """A message of the program with the group of the case that its line is in; without a line
    that of the first group of the name it begins with."""
    at, named = _LINE.search(said), _NAMED.match(said)
    group, variable = (named[1].lower(), named[2] or "") if named else ("", "")
    line = int(at[1]) if at else 0
    seen: dict[str, int] = {}
    for name, first, last in spans(text):
        if first <= line <= last:
            return Remark(_LINE.sub("", said), name, variable, seen.get(name, 0), line)
        seen[name] = seen.get(name, 0) + 1
    return Remark(_LINE.sub("", said), group, variable, 0, line)


def parts_of(said: str) -> list[Part]:
    """The plan as printed, part by part; a line without a name goes on with the one before."""
    found: list[Part] = []
    for line in said.splitlines():
        if not line.startswith("  "):
            found.append(Part(line.strip(), []))
        elif line.startswith(_WARNING) or not found:
            continue
        elif found[-1].heading in _TABLES:
            found[-1] = replace(found[-1], table=found[-1].table + line + "\n")
        else:
            name, words = line[:_LABEL].strip(), line[_LABEL:].strip()
            if name or not found[-1].pairs:
                found[-1].pairs.append((name, words))
            else:
                label, before = found[-1].pairs[-1]
                found[-1].pairs[-1] = (label, f"{before}; {words}")
    return [part for part in found if part.pairs or part.table]
