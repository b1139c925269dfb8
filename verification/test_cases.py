"""The verification cases as tests; each has its own check.py."""

from pathlib import Path

import pytest

from run_cases import Machine, names, verify

QUICK = {"buoyancy", "divergence", "neutral_hexapod", "two_basins", "water_ball"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in QUICK else [pytest.mark.slow]) for n in names()]
)
def test_case(name: str, tmp_path: Path) -> None:
    """Run all files of the case and ask its check."""
    holds, report = verify(name, tmp_path, Machine())
    assert holds, report
