"""Sizes are counted as budgets.py says."""

from pathlib import Path

import budgets


def test_what_a_source_holds() -> None:
    assert budgets.of_fortran([Path(__file__).with_name("source.f90")]) == {
        "public names": 2, "derived types": 1, "components of types": 2, "longest file": 28,
        "called once and short": 1, "executable lines per procedure": 1.0, "longest procedure": 5,
    }  # fmt: skip
