"""What only some commands need is installed by them, or asked for."""

import sys
from pathlib import Path

import pytest

from micstools import extras
from micstools.reading.reader import BadRun


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder of sources whose `deps.sh` notes what it was asked for, and a package missing."""
    monkeypatch.setitem(extras.PACKAGES, "shape", ("json", "no_such_package"))
    monkeypatch.setattr(extras, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "prefix", str(tmp_path / ".venv"))
    script = tmp_path / "tools" / "deps.sh"
    script.parent.mkdir()
    script.write_text('#!/bin/sh\ncd "$(dirname "$0")" && echo "$@" > asked && test ! -e full\n')
    script.chmod(0o755)
    return script.parent


def test_what_is_there_is_not_asked_for(lacking: Path) -> None:
    extras.PACKAGES["shape"] = ("json",)
    extras.need("shape")
    assert not (lacking / "asked").exists()


def test_what_is_missing_is_installed(lacking: Path, capfd: pytest.CaptureFixture) -> None:
    extras.need("shape")
    assert (lacking / "asked").read_text() == "shape\n"
    assert capfd.readouterr().err == "first call: installing no_such_package\n"
    (lacking / "full").touch()
    with pytest.raises(BadRun, match="no_such_package could not be installed"):
        extras.need("shape")


def test_the_python_of_others_is_left_alone(lacking: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", "/usr")
    with pytest.raises(BadRun, match=r"no_such_package missing: pip install 'micstools\[shape\]'"):
        extras.need("shape")
    assert not (lacking / "asked").exists()


def test_every_extra_has_its_packages() -> None:
    root = Path(__file__).parents[2]
    for extra, names in extras.PACKAGES.items():
        if extra == "pictures":  # of a first run
            continue
        text = (root / f"requirements-{extra}.txt").read_text()
        pinned = {
            line.split("==")[0].replace("-", "_") for line in text.splitlines() if "==" in line
        }
        assert pinned == set(names)
