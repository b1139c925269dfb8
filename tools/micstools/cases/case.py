"""A case file as Python values: groups as attributes, repeated ones as lists.

    case = Case.read("input/blocks_coarse.nml")
    case.run.t_end = 2.0                # a group and a variable
    case.drop[0].seed = 7               # of repeated groups each
    case.drop.add(shape="hexapod", position=[0.1, 0.05, 0.16])
    case.write("changed.nml")           # remarks stay
    print(case.check())                 # the plan, or BadRun with all that is wrong
    run = case.run()                    # micstools.Run

Groups and variables, with units, defaults and meanings, are those of the schema that the program
prints: `help(case.run)`, `case.drop[0].about("spread")`.
"""

import difflib
import html
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from micstools import files
from micstools.cases import case_copy, program, settings
from micstools.pages.html import table, tag
from micstools.reading.reader import BadRun, Run
from micstools.reading.schema import schema, variables

if TYPE_CHECKING:
    import pandas as pd

_OUTPUT = "mics-out"


def _near(name: str, known: Iterable[str]) -> str:
    """The nearest known name, in words."""
    found = difflib.get_close_matches(name, list(known), 1)
    return f": is {found[0]} meant?" if found else ""


class _Variable:
    """A variable of a group as an attribute."""

    def __init__(self, group: str, name: str) -> None:
        about = variables(group)[name]
        self.name, self.default = name, about.get("default")
        # Meaning, unit, values and default of a variable in a line
        said = str(about["description"])
        if "enum" in about:
            said += f"; {', '.join(repr(v) for v in about['enum'])}"
        if "default" in about:
            said += f"; default {about['default']!r}"
        self.__doc__ = said

    def __get__(self, group: "Group | None", owner: type) -> Any:
        """What the case gives, else the default; None where there is none."""
        return self if group is None else group.given.get(self.name, self.default)

    def __set__(self, group: "Group", value: Any) -> None:
        """Give a value; the program checks it."""
        group.given[self.name] = list(value) if isinstance(value, tuple) else value

    def __delete__(self, group: "Group") -> None:
        """Go back to the default."""
        group.given.pop(self.name, None)


class Group:
    """One namelist group; its variables are attributes."""

    _group = ""

    def __init__(self, **given: Any) -> None:
        """A group with some of its variables given."""
        self.given: dict[str, Any] = {}
        for name, value in given.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name != "given" and not isinstance(getattr(type(self), name, None), _Variable):
            known = variables(self._group)
            raise AttributeError(f"&{self._group} has no variable {name}{_near(name, known)}")
        super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        known = variables(self._group)
        raise AttributeError(f"&{self._group} has no variable {name}{_near(name, known)}")

    @classmethod
    def about(cls, name: str) -> str:
        """What a variable means: unit, values, default."""
        return str(getattr(cls, name).__doc__)

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={value!r}" for name, value in self.given.items())
        return f"{self._group}({said})"

    def _repr_html_(self) -> str:
        """All variables: what is given, the default and the meaning."""
        rows = [
            [tag("b", name) if name in self.given else name, repr(self.given.get(name, "")),
             repr(about.get("default", "")), about["description"]]
            for name, about in variables(self._group).items()
        ]  # fmt: skip
        return table(["variable", "given", "default", "meaning"], rows, numbers=False)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.given == getattr(other, "given", None)

    __hash__ = None  # type: ignore[assignment]


class _RunGroup(Group):
    """`&run`; called, it runs the case."""

    _group = "run"

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        object.__setattr__(self, "_case", None)

    def __call__(self, output: str | Path | None = None, threads: int | None = None,
                 mics: str | Path | None = None, quiet: bool = True) -> Run:  # fmt: skip
        """Run the case; its results. `output`: their folder, by default that of the case."""
        case: Case = self._case
        return case.compute(output, threads, mics, quiet)


@cache
def group_class(name: str) -> type[Group]:
    """The class of the groups of a name, with a property and a docstring for each variable."""
    base = _RunGroup if name == "run" else Group
    known = {key: _Variable(name, key) for key in variables(name)}
    lines = [f"    {key}: {variable.__doc__}" for key, variable in known.items()]
    doc = f"&{name}: {schema()['$defs'][name]['description']}.\n\n" + "\n".join(lines)
    return type(name, (base,), {"_group": name, "__doc__": doc, **known})


class Groups(list[Group]):
    """The groups of a name that may be repeated, in their order."""

    def __init__(self, name: str, found: Iterable[Group] = ()) -> None:
        super().__init__(found)
        self.name = name

    def add(self, **given: Any) -> Group:
        """One more group at the end."""
        self.append(group_class(self.name)(**given))
        return self[-1]

    def _repr_html_(self) -> str:
        """A row per group, of the variables that one of them gives."""
        names = list(dict.fromkeys(name for group in self for name in group.given))
        rows = [[k, *(repr(g.given.get(name, "")) for name in names)] for k, g in enumerate(self)]
        return table([f"&{self.name}", *names], rows, numbers=False)


class Case:
    """A case file: its groups are attributes, those that may be repeated are lists."""

    def __init__(self, text: str = "", folder: str | Path = ".") -> None:
        """A case from its text; files that it names lie in `folder`, or where we are."""
        self.folder = Path(folder)
        self._pieces: list[tuple[str, str, Group | None]] = []  # before, text, group
        self._groups: dict[str, Group | Groups] = {}
        places = settings.groups(text)
        for name, about in schema()["properties"].items():
            self._groups[name] = Groups(name) if "anyOf" in about else group_class(name)()
        end, seen = 0, set()
        for name, start, stop in places:
            if name not in self._groups:
                raise BadRun(f"&{name}: there is no such group{_near(name, self._groups)}")
            part = text[start:stop]
            try:
                group = group_class(name)(**settings.variables(part))
            except AttributeError as error:
                raise BadRun(str(error)) from None
            if isinstance(known := self._groups[name], Groups):
                known.append(group)
            elif name in seen:
                raise BadRun(f"&{name} stands twice")
            else:
                self._groups[name] = group
            seen.add(name)
            self._pieces.append((text[end:start], part, group))
            end = stop
        self._tail = text[end:]
        object.__setattr__(self._groups["run"], "_case", self)

    @classmethod
    def read(cls, path: str | Path) -> "Case":
        """The case of a file."""
        return cls(settings.read(Path(path)), Path(path).parent)

    def __getattr__(self, name: str) -> Any:
        groups = self.__dict__.get("_groups", {})
        if name not in groups:
            raise AttributeError(f"a case has no group {name}{_near(name, groups)}")
        return groups[name]

    def __setattr__(self, name: str, value: Any) -> None:
        if name in schema()["properties"]:
            raise AttributeError(f"set variables of case.{name}, or change the list")
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._groups]

    @property
    def text(self) -> str:
        """The case file: as it was read, with what was changed since."""
        left = [g for one in self._groups.values() for g in _all(one)]
        said = []
        for before, part, group in self._pieces:
            here = next((k for k, g in enumerate(left) if g is group), None)
            if here is None:  # was taken out
                said.append(before)
                continue
            group = left.pop(here)
            given = dict.fromkeys(settings.variables(part)) | group.given
            said.append(before + settings.patched(part, given))
        said.append(self._tail)
        new = [settings.group_text(g._group, g.given) for g in left if g.given]
        return "".join(said).rstrip("\n") + "\n" + "".join(f"\n{text}\n" for text in new)

    def write(self, path: str | Path) -> Path:
        """Write the case; files that it names are then looked for beside it, or where we are."""
        path = Path(path)
        files.write(path, self.text)
        return path

    def _here(self) -> str:
        """The text with the files that lie beside the case named from where we are."""
        return case_copy.from_here(self.text, self.folder)

    def check(self, mics: str | Path | None = None) -> "PlanText":
        """What the program says of the case: its plan; BadRun with all that is wrong."""
        return PlanText(program.check(self._program(mics), self._here()))

    def _program(self, mics: str | Path | None) -> Path:
        return program.find(Path(mics) if mics else None, self.folder / "case.nml")

    def compute(self, output: str | Path | None = None, threads: int | None = None,
                mics: str | Path | None = None, quiet: bool = True) -> Run:  # fmt: skip
        """Run the case and open its results; `case.run()` is the same."""
        folder = Path(output or str(self.run.output).strip() or _OUTPUT)
        words = [str(self._program(mics)), "--output", str(folder)]
        words += ["--threads", str(threads)] if threads else []
        words += ["--quiet"] if quiet else []
        how: dict[str, Any] = {"stdout": subprocess.DEVNULL if quiet else None, "text": True}
        with subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE, **how) as done:
            try:
                said = done.communicate(self._here())[1].strip()
            except KeyboardInterrupt:
                program.wait(done)  # it has the signal, too, and writes a restart file
                raise
        if done.returncode in (2, 4) or not (folder / "run.h5").is_file():
            raise BadRun(said or f"mics ended with code {done.returncode}")
        if said:
            print(said, file=sys.stderr)
        return Run(folder)

    def ensemble(self, runs: int, out: str | Path = "mics-ensemble", jobs: int | None = None,
                 vary: dict[str, Sequence[Any]] | None = None, mics: str | Path | None = None,
                 **options: Any) -> "Ensemble":  # fmt: skip
        """Run the case many times with other random drops, as `mics-tools ensemble` does.

        `vary`: values by variable, as {"contact.friction": [0.4, 0.6]}; `options`: seed, spread
        [m], tilt [degrees], keep_fields, start (loads). A second call with the same `out` runs
        what is missing."""
        from micstools.commands.base import Parser

        if threading.current_thread() is not threading.main_thread():
            raise BadRun("an ensemble is started from the main thread")
        folder = Path(out)
        words = ["--runs", str(runs), "--out", str(folder), "--program", str(self._program(mics))]
        words += ["--jobs", str(jobs)] if jobs else []
        for name, values in (vary or {}).items():
            words += ["--vary", f"{name}={','.join(str(v) for v in values)}"]
        for name, value in options.items():
            each = value if isinstance(value, (list, tuple)) else [value]
            words += [f"--{name.replace('_', '-')}", *map(str, each)]
        case = folder.with_name(f"{folder.name}.nml")
        files.write(case, self._here())
        code = Parser("ensemble").call([str(case), *words])
        if code:
            raise BadRun(f"{folder}: not all runs came to their end (code {code})")
        return Ensemble(folder)

    def __repr__(self) -> str:
        """Title, and the groups with what they give."""
        lines = [f"Case {str(self.run.title).strip() or 'without a title'}"]
        for name, found in self._groups.items():
            lines += [f"  &{name} {', '.join(g.given) or '(defaults)'}" for g in _all(found)
                      if g.given]  # fmt: skip
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """The groups with what they give."""
        rows: list[list[object]] = [
            [f"&{name}", ", ".join(f"{key} = {value!r}" for key, value in group.given.items())]
            for name, found in self._groups.items()
            for group in _all(found)
            if group.given
        ]
        return table([str(self.run.title).strip() or "case", "given"], rows, numbers=False)


def _all(found: Group | Groups) -> Sequence[Group]:
    return found if isinstance(found, Groups) else [found]


class PlanText(str):
    """The plan of a case, which a notebook shows as it is."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class Ensemble:
    """The folder of an ensemble."""

    def __init__(self, folder: str | Path) -> None:
        """Point at a folder of `mics-tools ensemble`."""
        self.folder = Path(folder)
        if not (self.folder / "ensemble.csv").is_file():
            raise FileNotFoundError(f"{self.folder} holds no ensemble.csv: is it an ensemble?")

    @property
    def table(self) -> "pd.DataFrame":
        """A row per run: seed, varied variables, outcome, folder."""
        import pandas as pd

        return pd.read_csv(self.folder / "ensemble.csv", dtype={"folder": str})

    def __iter__(self) -> Iterator[Run]:
        """The results of each run that has some."""
        yield from (run for _, run in self._done())

    def _done(self) -> Iterator[tuple[dict[str, Any], Run]]:
        """Row of the table and results of each run that has some."""
        for row in self.table.to_dict("records"):
            folder = self.folder / str(row["folder"]) / "result"
            if (folder / "run.h5").is_file():
                yield {str(name): value for name, value in row.items()}, Run(folder)

    @property
    def places(self) -> "pd.DataFrame":
        """Where each block lies at the end of each run, with the run's number and its values of the
        varied variables."""
        import pandas as pd

        each = [
            run.places.assign(
                **{name: v for name, v in row.items() if name == "run" or "." in name}
            )
            for row, run in self._done()
        ]
        return pd.concat(each, ignore_index=True)

    def __len__(self) -> int:
        return len(self.table)

    def __repr__(self) -> str:
        counted = self.table["outcome"].value_counts().to_dict()
        said = ", ".join(f"{n} {name}" for name, n in counted.items())
        return f"Ensemble {self.folder}: {len(self)} runs, {said}"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(repr(self))}</p>" + str(self.table._repr_html_())
