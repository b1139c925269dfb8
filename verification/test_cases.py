"""The verification cases as tests, as far as their runs are short; `make verify` runs all."""

from pathlib import Path

import pytest

from run_cases import Machine, changed, names, planned, verify
from verify import LEVELS, prepared_key

pytestmark = pytest.mark.cost(10)

COST = 10.0
"""Longest run [s] that is part of `make test`."""


@pytest.mark.parametrize("name", names())
def test_case(name: str, tmp_path: Path) -> None:
    """Run the short runs of the case and ask its check."""
    if all(plan.misses for plan in planned(name, tmp_path / name, COST)):
        pytest.skip("all its runs are long, or known to miss")
    holds, report = verify(name, tmp_path, Machine(), COST, misses=False)
    assert holds, report


def test_runs_kept_go_with_what_prepared_them() -> None:
    """The keys by which `make verify` keeps runs find the sources of prepared states."""
    assert prepared_key("sloshing") != prepared_key("cavity") == ""


def test_levels_fit_into_their_time(tmp_path: Path) -> None:
    """By the costs that the runs state, each level of `make verify` ends before its limit."""
    plans = [plan for name in names() for plan in planned(name, tmp_path / name)]
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
