"""`mics-tools harbour`: a case of many blocks that the program plans."""

import re
import subprocess
from pathlib import Path

import f90nml
import pytest

from calls import MICS, mics_tools, needs_mics, plan_of
from micstools.cases import harbour
from micstools.reading.reader import BadRun


def write(path: Path, *words: str) -> None:
    assert mics_tools(["harbour", "--out", str(path), *words]) == 0


@needs_mics
@pytest.mark.parametrize(
    ("words", "cells", "blocks", "memory"),
    [
        ([], 25_600_000, 2000, 23.0),
        (["--spacing", "0.5", "--blocks", "333", "--kind", "dolos"], 3_200_000, 333, 3.16),
    ],
)
def test_the_program_plans_memory_and_time(
    words: list[str], cells: int, blocks: int, memory: float, tmp_path: Path
) -> None:
    case = tmp_path / "harbour.nml"
    write(case, *words)
    plan = plan_of(tmp_path, case.read_text())
    assert f"= {cells}\n" in plan
    assert re.search(rf"dropped +{blocks}, the last one at \d+ s", plan)
    assert re.search(r"time of the run +about [\d.]+ (hours|days|min)", plan)
    found = re.search(r"Memory\n +about +([\d.]+) GB", plan)
    assert found and float(found[1]) == pytest.approx(memory, rel=0.1)
    assert [path.name for path in tmp_path.iterdir()] == ["harbour.nml"]


@pytest.mark.parametrize("blocks", [1, 7, 190, 2000, 5001])
def test_places(blocks: int) -> None:
    """As many blocks as asked for, in the basin, no two places too near to each other."""
    drops = f90nml.reads(harbour.case(harbour.Harbour(blocks=blocks)))["drop"]
    drops = drops if isinstance(drops, list) else [drops]
    assert sum(drop["count"] for drop in drops) == blocks
    places = {(round(drop["position"][0], 3), round(drop["position"][1], 3)) for drop in drops}
    assert len(places) == len(drops)
    assert all(1.3 <= x <= 198.7 and 1.3 <= y <= 98.7 for x, y in places)
    assert len({drop["seed"] for drop in drops}) == len(drops)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (harbour.Harbour(water=19.0), "--water 19"),
        (harbour.Harbour(length=(2.0, 100.0, 20.0)), "no room"),
        (harbour.Harbour(blocks=0), "must be positive"),
    ],
)
def test_refuses(wanted: harbour.Harbour, said: str) -> None:
    with pytest.raises(BadRun, match=said):
        harbour.case(wanted)


@pytest.mark.parametrize("blocks", [1, 190, 2000])
def test_one_by_one(blocks: int, tmp_path: Path) -> None:
    """One after another, none two at a time, row by row up the slope, in a case that is sound."""
    case = tmp_path / "light.nml"
    write(case, "--light", "--blocks", str(blocks), "--every", "5")
    drops = f90nml.reads(case.read_text())["drop"]
    drops = drops if isinstance(drops, list) else [drops]
    times = [d["first_time"] + k * d["interval"] for d in drops for k in range(d["count"])]
    assert sorted(times) == [5.0 * k for k in range(blocks)]
    first = sorted(drops, key=lambda drop: drop["first_time"])
    assert [drop["position"][1] for drop in first] == sorted(d["position"][1] for d in drops)
    if MICS.exists():
        plan = subprocess.run([MICS, "--check", case], capture_output=True, text=True, timeout=60)
        assert plan.returncode == 0 and "light: not resolved" in plan.stdout
        assert "bed from" in plan.stdout


@pytest.mark.skipif(not MICS.exists(), reason="needs the program")
def test_time_counts_blocks_that_others_wake(tmp_path: Path) -> None:
    """Measured 54 minutes for the first 1,950 of 2,000."""
    case = tmp_path / "light.nml"
    write(case, "--light", "--blocks", "2000", "--every", "3")
    plan = subprocess.run([MICS, "--check", case], capture_output=True, text=True, timeout=60)
    found = re.search(r"time of the run +about ([\d.]+) minutes", plan.stdout)
    assert found and 25 < float(found[1]) < 60


def test_one_by_one_refuses() -> None:
    with pytest.raises(BadRun, match="rows of places reach"):
        harbour.one_by_one(harbour.Harbour((50.0, 100.0, 20.0), every=3.0), "bed.txt")


def test_keeps_a_file_that_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = tmp_path / "harbour.nml"
    case.write_text("mine")
    assert mics_tools(["harbour", "--out", str(case)]) == 2
    assert case.read_text() == "mine"
    assert "is there already" in capsys.readouterr().err
