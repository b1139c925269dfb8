"""The commands, and the scripts of `tools`, as commands.toml tells them: arguments, their ranges,
and the function that does the work."""

import argparse
import os
import re
import sys
import tomllib
from collections.abc import Sequence
from functools import reduce
from importlib import import_module
from importlib.resources import files
from math import isfinite
from operator import lt
from pathlib import Path
from typing import Any, NoReturn

from micstools.reading.reader import BadRun

COMMANDS: dict[str, Any] = tomllib.loads((files("micstools") / "commands.toml").read_text())
_SHARED, _SCRIPTS = COMMANDS.pop("shared"), COMMANDS.pop("script")
_TYPES = {"Path": Path, "float": float, "int": int}
_POSITIVE = (sys.float_info.min, float("inf"))


class Parser(argparse.ArgumentParser):
    """The arguments of a command or script; says in one line what is wrong with them."""

    def __init__(self, name: str, description: str = "") -> None:
        about = COMMANDS.get(name) or _SCRIPTS[name]
        module, _, work = about.get("work", f"{name}.work").partition(".")
        self._constants = vars(import_module(f"micstools.commands.{module}")) | {
            "CORES": os.cpu_count() or 1
        }
        self._work, self._wanted = self._constants[work], list[tuple[str, str, Any, str]]()
        super().__init__(description=description or about["summary"].strip(),
                         formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
        if name in COMMANDS:
            self.prog = f"mics-tools {name}"
            self.epilog = "\n  mics-tools ".join(["examples:", *about["examples"]])
        for option, how in COMMANDS.get(about.get("like"), about)["arguments"].items():
            self._add(option, dict(_SHARED[how] if isinstance(how, str) else how))

    def _add(self, option: str, how: dict[str, Any]) -> None:
        """An argument in the words of the table."""
        must = how.pop("must", "positive")
        allowed = how.pop("range", _POSITIVE if how.pop("positive", False) else None)
        form, corners = how.pop("numbers", ""), how.pop("corners", False)
        how |= {"metavar": form} if form else {}
        for key, said in how.items():
            if isinstance(said, str) and said.startswith("$"):
                how[key] = self._constant(said[1:])
        said = re.sub(r"\$([\w.]*\w)", lambda m: self._words(m[1]), how.pop("help", ""))
        if "type" in how:
            how["type"] = _TYPES[how["type"]]
        if isinstance(how.get("metavar"), list):
            how["metavar"] = tuple(how["metavar"])
        action = self.add_argument(option, help=said, **how)
        if allowed or form or corners:
            self._wanted.append((option, action.dest, allowed or form, must))

    def _constant(self, name: str) -> Any:
        first, *parts = name.split(".")
        return reduce(getattr, parts, self._constants[first])

    def _words(self, name: str) -> str:
        value = self._constant(name)
        return value if isinstance(value, str) else ", ".join(value)

    def call(self, words: Sequence[str] | None = None) -> int:
        """Do the work on the words of a user; its exit code."""
        given = self.parse_args(words)
        for option, name, wanted, must in self._wanted:
            if (value := getattr(given, name)) is not None:
                setattr(given, name, _checked(value, option, wanted, must))
        return int(self._work(given))

    def error(self, message: str) -> NoReturn:
        """One line and the exit code 2."""
        self.exit(2, f"{self.prog}: {message} (--help tells more)\n")


def _checked(value: Any, option: str, wanted: Any, must: str) -> Any:
    """What a user gave, where it is what is `wanted`: numbers of a form, as X,Y,Z, which become a
    list; two corners (nothing else); or a number in a range."""
    if wanted and isinstance(wanted, str):
        try:
            found = [float(part) for part in value.split(",")]
        except ValueError:
            found = []
        if len(found) != len(wanted.split(",")) or not all(map(isfinite, found)):
            raise BadRun(f"{option} {value}: must be {wanted}")
        return found
    if isinstance(value, list):
        half = len(value) // 2
        if not all(map(lt, value[:half], value[half:])):
            said = " ".join(map(str, value))
            raise BadRun(f"{option} {said}: the first corner must be the lower one")
    elif not wanted[0] <= value <= wanted[1]:
        raise BadRun(f"{option} {value}: must be {must}")
    return value
