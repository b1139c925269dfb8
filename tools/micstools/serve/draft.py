"""A case that is being edited: its text, what was changed, and what the program says of it."""

import json
import math
import re
import subprocess
import threading
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from micstools import files
from micstools.cases import case_copy, settings
from micstools.pages import plan_page, set_up
from micstools.pages.set_up import Refused
from micstools.reading.reader import BadRun

NEW = Path(__file__).with_name("new.nml").read_text()
_FIRST = {"shape": {"kind": "cube", "size": 0.02}}
"""Values to begin with that the schema does not ask for, since they depend on others."""
_STEPS = 200  # that can be taken back
_PATIENCE = 120.0  # with a check [s]
_FINE = 3  # digits of the tank's length to which a block that is moved is placed
_HEAD = re.compile(r"^&\w+ \w+ = .*?: ")
Schema = dict[str, Any]


class Stale(BadRun):
    """A change is based on a text that is no longer the one of the draft."""


class Draft:
    """The text of a case beside its file. Changes are one at a time; each has a number."""

    def __init__(self, case: Path, program: Path) -> None:
        """Of a case file that may not be there yet."""
        if case.is_dir() or not case.parent.is_dir():
            raise BadRun(f"{case}: must be a file in a folder that is there")
        self.case, self.program = case, program
        done = subprocess.run([program, "--help=json"], capture_output=True, text=True)
        if done.returncode:
            told = done.stderr.strip() or f"{program} --help=json ended with {done.returncode}"
            raise BadRun(told)
        self.schema: Schema = json.loads(done.stdout)
        self.lock = threading.RLock()
        self.saved = settings.read(case) if case.exists() else ""
        self.text = self.saved or NEW
        self.number = 0  # of changes so far
        self.before: list[str] = []
        self.seen = -1  # number of the text whose bodies are these
        self.bodies: list[tuple[str, int]] = []  # group and occurrence of each
        self.step = 0.0  # places of blocks are multiples of this [m]

    @property
    def groups(self) -> dict[str, Schema]:
        """Every group by its name, as the schema describes it."""
        found: dict[str, Schema] = self.schema["$defs"]
        return found

    def needed(self, group: str) -> list[str]:
        """Variables that a group must have, where there are several ways by the first."""
        about = self.groups[group]
        found: list[str] = about.get("anyOf", [about])[0].get("required", [])
        return found

    def variable(self, group: str, name: str) -> Schema:
        """A variable as the schema describes it. Raises BadRun where there is none."""
        try:
            found: Schema = self.groups[group]["properties"][name]
        except KeyError:
            raise BadRun(f"&{group} {name}: no such variable") from None
        return found

    def values(self) -> list[tuple[str, int, dict[str, str] | None]]:
        """The groups of the text in order: name, occurrence, and what is typed there; none where
        it cannot be read."""
        seen: dict[str, int] = {}
        found = []
        for name, start, end in settings.groups(self.text):
            n = seen[name] = seen.get(name, -1) + 1
            try:
                group = settings.variables(self.text[start:end])
                said = {str(k): words_of(v) for k, v in group.items()}
            except BadRun:
                said = None
            found.append((name, n, said))
        return found

    def edit(self, order: dict[str, Any]) -> None:
        """Change the text as ordered: `op` is set, add, copy, remove, move, text, new or undo."""
        work = {"set": self._set, "add": self._add, "copy": self._copy, "remove": self._remove,
                "move": self._move, "text": self._write, "undo": self._undo,
                "new": self._begin}  # fmt: skip
        op = order.get("op")
        if op not in work:
            raise BadRun(f"no change '{op}'")
        with self.lock:
            before = self.text
            work[op](order)
            if self.text == before:
                return
            if op != "undo":
                self.before = [*self.before[1 - _STEPS :], before]
            self.number += 1
            if op == "move":  # and no group came or went
                self.seen = self.number

    def require(self, number: object) -> None:
        """Raise Stale where the text has another number."""
        if number != self.number:
            raise Stale("the case was changed in another window since this page showed it")

    def _set(self, order: dict[str, Any]) -> None:
        group, name, n = str(order["group"]), str(order["variable"]), int(order["n"])
        about, words = self.variable(group, name), str(order["value"]).strip()
        there = sum(g == group for g, _, _ in settings.groups(self.text))
        value = typed(about, words, f"{group}.{name}") if words else None
        if words or there:
            self.text = settings.set_group(self.text, group, {name: value}, n if there else None)

    def _add(self, order: dict[str, Any]) -> None:
        group = str(order["group"])
        if group not in self.groups:
            raise BadRun(f"&{group}: no such group")
        needed = self.needed(group)
        given = {name: self._example(group, name) for name in needed} | _FIRST.get(group, {})
        self.text = self.text.rstrip("\n") + "\n\n" + settings.group_text(group, given)

    def _example(self, group: str, name: str) -> Any:
        """A value to begin with: of the first shape, in the middle of the tank."""
        if name == "shape":
            return settings.value(self.text, "shape", "name") or "cube"
        if name == "position":
            length = settings.value(self.text, "grid", "length") or [1.0, 1.0, 1.0]
            origin = settings.value(self.text, "grid", "origin") or [0.0, 0.0, 0.0]
            share = np.array([0.5, 0.5, 0.8 if group == "drop" else 0.5])
            return (np.array(origin, float) + share * np.array(length, float)).round(9).tolist()
        about = self.variable(group, name)
        if group == "shape" and name == "name":
            return f"shape{1 + sum(g == 'shape' for g, _, _ in settings.groups(self.text))}"
        found = about.get("examples", [about.get("default", "")])
        return found[0] if found else ""

    def _place(self, order: dict[str, Any]) -> tuple[int, int]:
        """Where the ordered group stands in the text."""
        group, n = str(order["group"]), int(order["n"])
        places = [(start, end) for g, start, end in settings.groups(self.text) if g == group]
        if not 0 <= n < len(places):
            raise BadRun(f"&{group} {n + 1}: no such group in the case")
        return places[n]

    def _copy(self, order: dict[str, Any]) -> None:
        start, end = self._place(order)
        self.text = self.text[:end] + "\n" + self.text[start:end] + self.text[end:]

    def _remove(self, order: dict[str, Any]) -> None:
        start, end = self._place(order)
        self.text = self.text[:start] + self.text[end:].lstrip("\n")

    def _move(self, order: dict[str, Any]) -> None:
        body, by = int(order["body"]), [float(v) for v in order["by"]]
        if self.seen != self.number:
            raise BadRun("the blocks shown are those of an older text: wait for the check")
        if not 0 <= body < len(self.bodies) or not all(math.isfinite(v) for v in by):
            raise BadRun("no such block")
        group, n = self.bodies[body]
        place = settings.value(self.text, group, "position", n)
        if place is None:
            raise BadRun(f"&{group} {n + 1} has no position of its own: change its file")
        ends = {"position": place, "to": settings.value(self.text, group, "to", n)}
        new = {name: [self._moved(float(p), d) for p, d in zip(end, by, strict=True)]
               for name, end in ends.items() if end is not None}  # fmt: skip
        self.text = settings.set_group(self.text, group, new, n)

    def _moved(self, place: float, by: float) -> float:
        """A coordinate moved to a round place; one that hardly moves stays as it is."""
        moved = round(round((place + by) / self.step) * self.step, 12)
        return moved if abs(by) > self.step / 2 else place

    def _write(self, order: dict[str, Any]) -> None:
        text = settings.plain(str(order["text"]))
        if "\0" in text:
            raise BadRun("this is no text")
        self.text = text

    @property
    def ours(self) -> Path:
        """The folder of the cases that come with the program, installed or in its sources."""
        built, installed = (self.program.parents[k] for k in (0, 1))
        share = installed / "share" / "mics"
        return (share if (share / "input").is_dir() else built) / "input"

    def _begin(self, order: dict[str, Any]) -> None:
        """A case of ours, with its files where they are and a folder of results of its own."""
        text = settings.read(self.ours / Path(f"{order['case']}.nml").name)
        if Path().resolve() != self.ours.parent:
            text = case_copy.from_here(text, self.ours.parent)
        run = {"output": f"mics-{self.case.stem}", **order.get("run", {})}
        self.text = settings.set_group(text, "run", run, 0)

    def _undo(self, _: dict[str, Any]) -> None:
        if self.before:
            self.text = self.before.pop()

    def look(self) -> dict[str, Any]:
        """What the program says of the text: the plan with its scene, or what is wrong."""
        with self.lock:
            number, text = self.number, case_copy.from_here(self.text, self.case.parent)
        try:
            with set_up.read(self.program, text, _PATIENCE) as found:
                with self.lock:
                    if number == self.number:
                        self.seen = number
                        self._keep_bodies(found)
                parts = {k: v or "" for k, v in plan_page.parts(found).items()}
                return {"problems": [], "warnings": len(found.warnings), "parts": parts,
                        "scene": plan_page.scene(found)}  # fmt: skip
        except Refused as refused:
            said = [asdict(r) | {"short": _HEAD.sub("", r.text)} for r in refused.remarks]
            return {"problems": said, "warnings": 0}

    def _keep_bodies(self, found: set_up.SetUp) -> None:
        """Which group each body comes from."""
        edges = found.run.grid.high - found.run.grid.low
        self.step = 10.0 ** (math.floor(math.log10(float(edges.max()))) - _FINE)
        seen: dict[str, int] = {}
        self.bodies = [("", 0)] * found.run.bodies.n
        for group, first, last in set_up.spans(found.text):
            n = seen[group] = seen.get(group, -1) + 1
            for k in np.flatnonzero((found.line >= first) & (found.line <= last)):
                self.bodies[k] = (group, n)

    def state(self) -> dict[str, Any]:
        """The text and what is typed in each group."""
        with self.lock:
            values = [{"group": g, "n": n, "values": said} for g, n, said in self.values()]
            return {"text": self.text, "values": values, "saved": self.text == self.saved,
                    "undo": bool(self.before), "number": self.number}  # fmt: skip

    def save(self) -> dict[str, Any]:
        """Write the case, unless somebody else has changed it since."""
        with self.lock:
            if self.case.exists() and settings.read(self.case) not in (self.saved, self.text):
                raise BadRun(f"{self.case} was changed by another program: copy your text, "
                             "then open it anew")  # fmt: skip
            files.write(self.case, self.text)
            self.saved = self.text
        return {"told": f"{self.case} is written"}


def typed(about: Schema, words: str, name: str) -> Any:
    """What was typed as a value of a variable; the program judges it."""
    if _is_text(about):
        return words.strip("'\"")
    if about.get("type") == "array" and _is_text(about.get("items", {})):
        found = [part.strip().strip("'\"") for part in words.split(",")]
        return found if len(found) > 1 else found[0]
    return settings.parse(f"{name}={words.rstrip(', ')}").value


def _is_text(about: Schema) -> bool:
    """Is its value a text, one of several perhaps?"""
    return about.get("type") == "string" or "enum" in about


def words_of(value: Any) -> str:
    """A value of a namelist as one would type it, without quotes."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, list):
        return ", ".join(words_of(v) for v in value)
    return "" if value is None else str(value)
