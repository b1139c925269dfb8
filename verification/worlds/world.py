"""A case as groups of values, in any units, and its run."""

import csv
import io
import re
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import hypothesis
import numpy as np

from micstools.cases import settings
from micstools.cases.case import schema
from micstools.reading.reader import Run
from run_cases import Machine
from shared_runs import call

Group = dict[str, Any]
Table = tuple[dict[str, str], list[list[Any]]]
"""Units of the columns by their names, and the rows."""
ALONE = Machine(threads=1)
REFUSED = 2
"""Exit code of a case that is wrong: such a draw is no world."""
_BASE = {"m": (1, 0, 0), "s": (0, 1, 0), "kg": (0, 0, 1)}
_BASE |= {"N": (1, -2, 1), "Pa": (-1, -2, 1), "J": (2, -2, 1)}


class Broken(Exception):
    """A law does not hold; the text says by how much."""


@cache
def exponents(unit: str) -> np.ndarray:
    """Powers of length, time and mass in a unit as results and the reference write it."""
    above, _, below = re.sub(r"\^gamma_.", "", unit).partition("/")
    found = np.zeros(3, int)
    for text, sign in ((above, 1), (below, -1)):
        for name, power in re.findall(r"([A-Za-z]+)(\d*)", text):
            found += sign * int(power or 1) * np.array(_BASE.get(name, (0, 0, 0)))
    return found


@dataclass(frozen=True)
class World:
    """A case file, and the tables beside it; words of `bed.txt` stand between blanks."""

    groups: list[tuple[str, Group]]
    tables: dict[str, Table] = field(default_factory=dict)

    @classmethod
    def known(cls, name: str) -> "World":
        """A world that is kept as a case file, for what it once showed."""
        text = (Path(__file__).parent / "known" / f"{name}.nml").read_text()
        return cls([(n, settings.variables(text[a:b])) for n, a, b in settings.groups(text)])

    def value(self, group: str, name: str, default: Any = None) -> Any:
        """A variable of the first such group."""
        return next((g[name] for n, g in self.groups if n == group and name in g), default)

    def all(self, group: str) -> list[Group]:
        """Every group of that name."""
        return [g for n, g in self.groups if n == group]

    def changed(self, group: str, **values: Any) -> "World":
        """The world with values of every such group changed."""
        return replace(
            self, groups=[(n, {**g, **values} if n == group else g) for n, g in self.groups]
        )

    def scaled(self, length: float, time: float, mass: float) -> "World":
        """The same world in other units; factors of whole powers of two change no digit."""

        def change(value: Any, unit: str) -> Any:
            if isinstance(value, list):
                return [change(v, unit) for v in value]
            if isinstance(value, int | str) or not exponents(unit).any():
                return value
            return value * float(np.prod(np.array([length, time, mass]) ** exponents(unit)))

        def change_group(name: str, group: Group) -> Group:
            about = schema()["$defs"][name]["properties"]
            return {k: change(v, about[k].get("unit", "")) for k, v in group.items()}

        tables = {
            name: (
                units,
                [[change(v, u) for v, u in zip(row, units.values(), strict=True)] for row in rows],
            )
            for name, (units, rows) in self.tables.items()
        }
        return World([(n, change_group(n, g)) for n, g in self.groups], tables)

    def shifted(self, by: list[float]) -> "World":
        """The same world at another place of a survey."""

        def change(name: str, group: Group) -> Group:
            if name == "grid":
                return {**group, "origin": _plus(group.get("origin", [0.0] * 3), by)}
            places = {k: _plus(group[k], by) for k in ("position", "min", "max") if k in group}
            level = {"water_level": group["water_level"] + by[2]} if "water_level" in group else {}
            return {**group, **places, **level}

        tables = {}
        for name, (units, rows) in self.tables.items():
            ways = [0.0, *by, 0.0, 0.0, 0.0, 0.0]
            if name == "bed.txt":
                ways = [0, 0, *by[:2], 0.0, 0.0] + [by[2]] * (len(units) - 6)
            tables[name] = (units, [_plus(row, ways) for row in rows])
        return World([(n, change(n, g)) for n, g in self.groups], tables)

    @property
    def text(self) -> str:
        """The case file."""
        lines = [
            f"&{name} " + "  ".join(f"{k} = {_text(v)}" for k, v in group.items()) + " /\n"
            for name, group in self.groups
        ]
        return "".join(lines)

    def write(self, folder: Path) -> Path:
        """Write the case file and its tables into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, (units, rows) in self.tables.items():
            out = io.StringIO()
            comma = " " if name.endswith(".txt") else ","
            csv.writer(out, delimiter=comma, lineterminator="\n").writerows([list(units), *rows])
            (folder / name).write_text(out.getvalue())
        path = folder / "case.nml"
        path.write_text(self.text)
        return path

    def run(
        self, folder: Path, *words: str, machine: Machine = ALONE, ends: tuple[int, ...] = (0, 3)
    ) -> Run:
        """Run it in a new folder: its results. A case that is refused is no world."""
        command = (*machine.command, "--output", folder / "out", *words, self.write(folder))
        done = call(*command, more={"OMP_WAIT_POLICY": "passive"}, timeout=600)
        if done.returncode == REFUSED:
            hypothesis.reject()
        last = done.stderr.strip().splitlines()[-1:]
        if done.returncode not in ends and "found room" not in str(last):
            raise Broken(f"exit code {done.returncode}: {last}")
        return Run(folder / "out")


def _plus(values: list[float], by: list[float]) -> list[float]:
    return [v + b for v, b in zip(values, by, strict=True)]


def _text(value: Any) -> str:
    """A value as a case file has it, with all its digits."""
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, bool):
        return f".{value}.".lower()
    return f"'{value}'" if isinstance(value, str) else repr(value)
