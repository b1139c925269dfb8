"""The verification cases as tests, as far as their runs are short; `make verify` runs all."""

from pathlib import Path

import pytest

from run_cases import Machine, changed, names, planned, verify

COST = 20.0
"""Longest run [s] that is part of `make test`."""


@pytest.mark.parametrize("name", names())
def test_case(name: str, tmp_path: Path) -> None:
    """Run the short runs of the case and ask its check."""
    if not planned(name, tmp_path / name, COST):
        pytest.skip("all its runs are long")
    holds, report = verify(name, tmp_path, Machine(), COST)
    assert holds, report


def test_variants_change_only_what_they_name() -> None:
    text = "&grid cells = 4, 4, 4 length = 1.0, 1.0, 1.0 /\n&body x = 1 /\n&body x = 2  y = 3 /\n"
    found = changed(text, {"grid": {"cells": [8, 8, 8]}, "body": [{}, {"x": 5}, {"x": 6}]})
    again = changed(found, {})
    assert found == again
    assert "cells = 8, 8, 8" in found
    assert "length = 1.0, 1.0, 1.0" in found
    assert [found.count(f"x = {n}") for n in (1, 2, 5, 6)] == [1, 0, 1, 1]
    assert "y = 3" in found
