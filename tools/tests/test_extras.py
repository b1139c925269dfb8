"""What only some commands need is asked for by them, and never installed."""

import subprocess
import sys
from pathlib import Path

import pytest

from micstools import extras
from micstools.reading.reader import BadRun

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("prefix", "told"),
    [("/usr", "pip install 'micstools[shape]'"), (".venv", f"make -C {ROOT} deps")],
)
def test_what_is_missing_is_asked_for(
    prefix: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the Python of `make deps` and in that of others."""
    monkeypatch.setitem(extras.PACKAGES, "shape", ("json",))
    extras.need("shape")
    monkeypatch.setitem(extras.PACKAGES, "shape", ("json", "no_such_package"))
    monkeypatch.setattr(sys, "prefix", str(ROOT / prefix))
    for name in ("run", "Popen", "call"):
        monkeypatch.setattr(subprocess, name, None)
    with pytest.raises(BadRun) as fault:
        extras.need("shape")
    assert str(fault.value) == f"no_such_package missing: {told}"


def test_every_extra_has_its_packages() -> None:
    """And `make deps` installs what the guide names."""
    rule = (ROOT / "Makefile").read_text().split("\ndeps:\n")[1].split("\n")[0]
    for extra, names in extras.PACKAGES.items():
        if extra == "pictures":  # of a first run
            continue
        text = (ROOT / f"requirements-{extra}.txt").read_text()
        pinned = {
            line.split("==")[0].replace("-", "_") for line in text.splitlines() if "==" in line
        }
        assert pinned == set(names) and extra in rule
