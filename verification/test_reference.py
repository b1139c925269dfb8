"""The reference of the case file says what the program does: names, defaults, examples, ranges."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import f90nml
import jsonschema
import numpy as np
import pytest
import trimesh

from micstools.cases.initial_state import write_initial_state
from micstools.reading.reader import Run
from run_cases import ROOT
from shared_runs import texts
from test_input import GOOD, mics
from write_reference import PAGE, ask, page

SCHEMA = ROOT / "docs" / "mics-case.schema.json"

SIDES = [f"{axis}_{end}" for axis in "xyz" for end in ("min", "max")]
CONTRACT = tomllib.loads((ROOT / "verification" / "contract.toml").read_text())["case"]
"""Groups and variables that users rely on; more may come."""

TANK = {
    "run": "&run t_end = 10 /\n",
    "grid": "&grid cells = 6, 2, 4  length = 0.3, 0.1, 0.2 /\n",
    "shape": "&shape name = 'hexapod'  kind = 'hexapod'  size = 0.02 /\n",
}
"""What the other groups need beside them."""


class Row(NamedTuple):
    """A row of a table of the page."""

    group: str
    name: str
    values: str
    default: str
    unit: str
    meaning: str
    example: str


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """All variables as the program tells them."""
    return [
        Row(text.split("\n")[0], *(cell.strip("` ") for cell in line[1:-1].split(" | ")))
        for text in page().split("\n## &")[1:]
        for line in text.splitlines()
        if line.startswith("| `")
    ]


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    """The schema as the program prints it."""
    return json.loads(ask("json"))


def test_files_are_fresh() -> None:
    """The page and the schema are what this program would write; else: make reference."""
    assert PAGE.read_text() == page()
    assert SCHEMA.read_text() == ask("json")


def test_contract_is_described(rows: list[Row]) -> None:
    """Every variable of the contract has a row, and every row a meaning and an example."""
    described = {(row.group, row.name) for row in rows}
    promised = {(group, name) for group, names in CONTRACT.items() for name in names.split()}
    assert promised - described == set()
    assert len(described) == len(rows)
    assert [row for row in rows if not (row.meaning and row.values and row.example)] == []
    reals = [row for row in rows if re.match(r"(\d to )?(\d )?number", row.values)]
    assert len(reals) > 50
    assert [row for row in reals if not row.unit] == []


def test_help_on_a_group(rows: list[Row]) -> None:
    """--help GROUP tells the same in paragraphs; --help lists all groups."""
    overview = mics(["--help"], ROOT).stdout
    for group in CONTRACT:
        assert f"\n  {group} " in overview
        text = " ".join(mics(["--help", group], ROOT).stdout.split())
        for row in rows:
            if row.group == group:
                assert f" {row.name} " in text
                assert " ".join(f"{row.meaning} example: {row.example}".split()) in text


def test_unknown_group(tmp_path: Path) -> None:
    """A group that does not exist is refused with the nearest one."""
    done = mics(["--help", "contacts"], tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert (
        done.stderr == "mics: unknown group 'contacts'; the nearest is contact (--help lists all)\n"
    )


def write_files(folder: Path) -> None:
    """The files that examples name."""
    (folder / "mound.txt").write_text("2 2 0 0 0.3 0.1\n" + 4 * "0.01\n")
    corners = [(0, 0, 0.01), (0.3, 0, 0.01), (0.3, 0.1, 0.01), (0, 0.1, 0.01)]
    trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)]).export(folder / "slope.stl")
    (folder / "block.txt").write_text(
        "mics-shape 1\npoints 4\n0 0 0\n0.05 0 0\n0 0.05 0\n0 0 0.05\ntets 1\n1 2 3 4\n"
    )
    (folder / "plan.csv").write_text("shape,x,y,z,time\nhexapod,0.15,0.05,,0\n")
    (folder / "door.csv").write_text("time,x,y,z\n0,0.15,0.05,0.1\n1,0.15,0.05,0.11\n")
    write_initial_state(folder / "start.h5", liquid=np.zeros((4, 2, 6)))
    held = "&body shape = 'hexapod'  position = 0.15, 0.05, 0.1  fixed = T /\n"
    run = "&run t_end = 0.01  physics = 'dry'  output = 'fill' /\n"
    assert mics([], folder, run + TANK["grid"] + TANK["shape"] + held).returncode == 0


REPLACED = {
    ("drop", "file"): "shape position",
    ("drop", "shapes"): "shape",
    ("drop", "weights"): "shape",
}
"""Required variables that others take the place of."""


def test_examples_are_accepted(rows: list[Row], tmp_path: Path) -> None:
    """Each example, beside the examples of the required variables, makes a good case."""
    write_files(tmp_path)
    refused = []
    for row in rows:
        needed = [
            other for other in rows if other.group == row.group and other.default == "required"
            and other.name not in REPLACED.get((row.group, row.name), "")
        ]  # fmt: skip
        lines = [f"{other.example}\n" for other in needed if f"{other.name} = " not in row.example]
        group = f"&{row.group}\n{''.join(lines)}{row.example}\n/\n"
        others = [text for name, text in TANK.items() if name != row.group]
        done = mics(["--check"], tmp_path, "".join(others) + group)
        if done.returncode != 0:
            refused.append((row.group, row.name, done.stderr))
    assert refused == []


PLAIN = tomllib.loads((ROOT / "verification" / "given.toml").read_text())
GIVEN, NEEDED = PLAIN["given"], PLAIN["needed"]
CHOICES = (GIVEN, {**GIVEN, **PLAIN["chosen"]}, {**GIVEN, **PLAIN["rock"]})
"""Cases with a group of each name, which give variables a meaning that have none by default."""


def used_by_program(
    folder: Path, given: dict[str, str], defaults: dict[str, str]
) -> dict[str, list[dict[str, Any]]]:
    """All values that a run used, from its results, with more written into some groups."""
    folder.mkdir()
    write_files(folder)
    case = "".join(
        f"&{group}\n{given.get(group, '')}\n{defaults.get(group, '')}/\n" for group in CONTRACT
    )
    done = mics([], folder, case)
    assert done.returncode == 0, done.stderr
    return Run(folder / "mics-out").parameters


def test_defaults_are_those_of_the_program(rows: list[Row], tmp_path: Path) -> None:
    """A run without a variable uses its printed default, and is the same when it is written; one
    without a meaning is not used."""
    seen = set()
    for number, given in enumerate(CHOICES):
        used = used_by_program(tmp_path / f"without-{number}", given, {})
        defaults: dict[str, str] = {}
        for row in rows:
            if f" {row.name} = " in f" {given.get(row.group, '')}":
                seen.add((row.group, row.name))
                continue
            if row.default == "no default":
                assert row.name not in used[row.group][0]
            elif row.name in used[row.group][0]:
                value = f90nml.reads(f"&a b = {row.default} /")["a"]["b"]
                assert value == used[row.group][0][row.name], (row.group, row.name)
                defaults[row.group] = f"{defaults.get(row.group, '')}{row.name} = {row.default}\n"
                seen.add((row.group, row.name))
        assert used_by_program(tmp_path / f"with-{number}", given, defaults) == used
    assert seen >= {(row.group, row.name) for row in rows if row.default != "no default"}


def edges(rule: dict[str, Any]) -> Iterator[tuple[float, bool]]:
    """Values on and just outside the bounds of a number, and whether they are good."""
    whole = rule.get("type") == "integer"
    if "exclusiveMinimum" in rule:
        yield rule["exclusiveMinimum"], False
    if "minimum" in rule:
        yield rule["minimum"], True
        yield rule["minimum"] - (1 if whole else 1e-9), False
    if "maximum" in rule:
        yield rule["maximum"], True
        yield rule["maximum"] + (1 if whole else 1e-3), False


def test_bounds_are_those_of_the_program(schema: dict[str, Any], tmp_path: Path) -> None:
    """A number on a bound of the schema is taken, one just outside is refused."""
    tried = 0
    for group, rules in schema["$defs"].items():
        for name, rule in rules["properties"].items():
            one = rule["anyOf"][0] if "anyOf" in rule else rule.get("items", rule)
            for value, good in edges(one):
                choice = NEEDED.get(name, "")
                text = f"&{group} {name} = {rule.get('minItems', 1)}*{value!r} {choice} /"
                if name == "cells":  # one cell is good between such sides
                    text += "&boundary " + " ".join(f"{side} = 'slip'" for side in SIDES) + " /"
                errors = mics(["--check"], tmp_path, text).stderr.splitlines()
                start = f"mics: &{group} {name} = {value!r}"
                refused = any(e.startswith(start) and " must " in e for e in errors)
                assert refused != good, (text, errors)
                tried += 1
    assert tried > 60


def as_json(text: str) -> dict[str, Any]:
    """A case as the schema sees it: groups of one name in a list."""
    case: dict[str, Any] = {}
    for name, group in f90nml.reads(text).items():
        groups = group if isinstance(group, list) else [group]
        case[name] = [dict(one) for one in groups]
    return {name: groups[0] if len(groups) == 1 else groups for name, groups in case.items()}


@pytest.mark.parametrize("case", GOOD, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_good_cases_fit_the_schema(case: Path, schema: dict[str, Any]) -> None:
    """Every case of the project is good by the schema, too."""
    jsonschema.validate(as_json(case.read_text()), schema)


def test_the_page_shows_how_to_check_a_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its lines in Python run as they stand."""
    (shown,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    monkeypatch.chdir(ROOT)
    exec(shown, {})
    damaged = shown.replace("jsonschema.validate", "case['run']['dt'] = 0.0; jsonschema.validate")
    with pytest.raises(jsonschema.ValidationError, match="0.0 is less than or equal to"):
        exec(damaged, {})


def test_examples_and_defaults_fit_the_schema(schema: dict[str, Any]) -> None:
    """The values in the schema obey it."""
    for rules in schema["$defs"].values():
        for rule in rules["properties"].values():
            assert rule["description"]
            for value in [*rule["examples"], *([rule["default"]] if "default" in rule else [])]:
                jsonschema.validate(value, rule)


def test_an_unknown_name_ends_the_program(schema: dict[str, Any]) -> None:
    """Who adds a choice and forgets a branch is told: a `select case` on it stops by default."""
    pattern = r"select case \((?:trim\()?(?:\w+%)+(\w+)\)+\n((?:(?!end select).)*)end select"
    source = "\n".join(path.read_text() for path in (ROOT / "src").rglob("*.f90"))
    stops = {name for name, body in re.findall(pattern, source, re.DOTALL)
             if re.search(r"case default;?\s*error stop", body)}  # fmt: skip
    choices = {name for group in schema["$defs"].values() for name, rule in
               group["properties"].items() if "enum" in rule and name not in SIDES}  # fmt: skip
    # advection by `scheme_of`, the model by the solver, others by `if`
    assert choices - stops == {"advection", "attitude", "if_blocked", "release", "model"}


@pytest.mark.parametrize("change", texts("reference")["not_in_schema"])
def test_bad_cases_do_not_fit_the_schema(change: tuple[str, str], schema: dict[str, Any]) -> None:
    """The schema finds what an editor should mark."""
    text = (ROOT / "input" / "blocks.nml").read_text()
    assert change[0] in text
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(as_json(text.replace(*change)), schema)
