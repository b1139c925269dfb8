"""The verification cases as tests, as far as their runs are short; `make verify` runs all."""

import json
from fnmatch import fnmatch
from pathlib import Path

import f90nml
import pytest

from report import OPTIONS
from run_cases import ROOT, Machine, Planned, changed, checker, names, planned, quick, verify
from verify import LEVELS, prepared_key

pytestmark = pytest.mark.cost(10)

TOGETHER = 15.0
"""Most that the quick runs of a case take together [s on one core]."""


@pytest.mark.parametrize("name", names())
def test_case(name: str, tmp_path: Path) -> None:
    """Run the quick runs of the case and ask its check."""
    plans = planned(name, tmp_path / name)
    chosen = quick(plans)
    if not chosen:
        pytest.skip("its short runs have no figure that counts")
    holds, report = verify(name, tmp_path, Machine(), chosen)
    assert holds, report


def test_runs_kept_go_with_what_prepared_them() -> None:
    """The keys by which `make verify` keeps runs find the sources of prepared states."""
    assert prepared_key("sloshing") != prepared_key("cavity") == ""


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> list[Planned]:
    """All runs of all cases."""
    work = tmp_path_factory.mktemp("plans")
    return [plan for name in names() for plan in planned(name, work / name)]


@pytest.mark.xdist_group("plans")
def test_quick_runs_are_few(plans: list[Planned]) -> None:
    """By their stated costs; and each pattern that chooses them fits one."""
    for name in names():
        chosen = quick([plan for plan in plans if plan.case == name])
        together = sum(plan.cost for plan in chosen)
        assert together <= TOGETHER, f"{name}: {together} s"
        for pattern in getattr(checker(name), "QUICK", ()):
            assert any(fnmatch(plan.name, pattern) for plan in chosen), f"{name}: {pattern}"


@pytest.mark.xdist_group("plans")
def test_cases_declare_the_options_that_they_vary(plans: list[Planned]) -> None:
    """Else the report of `make verify` counts the case as missed."""
    usual = json.loads((ROOT / "docs" / "mics-case.schema.json").read_text())["$defs"]
    for plan in plans:
        varies = getattr(checker(plan.case), "VARIES", ())
        for group in OPTIONS:
            for key, value in f90nml.reads(plan.text).get(group, {}).items():
                default = usual[group]["properties"][key].get("default")
                told = f"{group} {key}".startswith(varies)
                assert value == default or told, f"{plan.case}/{plan.name}: {group} {key}"


@pytest.mark.xdist_group("plans")
def test_levels_fit_into_their_time(plans: list[Planned]) -> None:
    """By the costs that the runs state, each level of `make verify` ends before its limit."""
    for level in LEVELS.values():
        needs = level.needs(plans)
        assert needs < 0.95 * level.limit, f"{level.name}: {needs / 60:.1f} min"


def test_variants_change_only_what_they_name() -> None:
    text = "&grid cells = 4, 4, 4 length = 1.0, 1.0, 1.0 /\n&body x = 1 /\n&body x = 2  y = 3 /\n"
    found = changed(text, {"grid": {"cells": [8, 8, 8]}, "body": [{}, {"x": 5}, {"x": 6}]})
    again = changed(found, {})
    assert found == again
    assert "cells = 8, 8, 8" in found
    assert "length = 1.0, 1.0, 1.0" in found
    assert [found.count(f"x = {n}") for n in (1, 2, 5, 6)] == [1, 0, 1, 1]
    assert "y = 3" in found
    assert "body" not in changed(text, {"body": False})
