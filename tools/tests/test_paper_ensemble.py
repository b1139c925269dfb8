"""The fifty drops of the paper: what differs from choice to choice, and the table of the shares."""

import csv
from pathlib import Path

import numpy as np
import pytest

from calls import MICS, needs_mics
from micstools.cases import program, settings
from micstools.cli import script
from micstools.commands import paper
from micstools.ensembles import paper_ensemble
from micstools.ensembles.paper_ensemble import CHOICES
from micstools.piles import pile_ensemble
from micstools.reading.reader import BadRun
from micstools.shapes.geometry import rotation_matrix
from test_pile_ensemble import write_ensemble

CASE = paper.CASE.read_text()


def fixed(text: str, name: str) -> np.ndarray:
    return np.array([settings.value(text, "body", name, k) for k in range(3)])


def test_choices_differ_in_what_they_say() -> None:
    texts = {choice.name: choice.text(CASE) for choice in CHOICES}
    assert texts.pop("as_it_is") == CASE
    same = {choice.name for choice in CHOICES if choice.options}
    assert {name for name, text in texts.items() if text == CASE} == same
    assert settings.value(texts["spheres"], "contact", "model") == "spheres"
    others = [text for name, text in texts.items() if name not in same]
    assert len(set(others)) == len(others)


@needs_mics
def test_the_program_takes_every_choice() -> None:
    for choice in CHOICES:
        program.check(MICS, choice.text(CASE))


def test_fixed_blocks_move_along_the_tank_and_turn_about_the_upright() -> None:
    near = paper_ensemble.fixed_at(0.065)(CASE)
    assert fixed(near, "position")[:, 0] == pytest.approx([0.085, 0.15, 0.215])
    assert (fixed(near, "position")[:, 1:] == fixed(CASE, "position")[:, 1:]).all()
    turned = paper_ensemble.fixed_turned(0, 60, 90)(CASE)
    before = rotation_matrix(fixed(CASE, "quaternion"))
    between = rotation_matrix(fixed(turned, "quaternion")) @ before.transpose(0, 2, 1)
    for turn, angle in zip(between, np.radians([0, 60, 90]), strict=True):
        c, s = np.cos(angle), np.sin(angle)
        assert turn == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), abs=1e-12)


def test_another_case_than_the_papers_is_refused() -> None:
    for change in (paper_ensemble.fixed_at(0.065), paper_ensemble.fixed_turned(60)):
        with pytest.raises(BadRun, match="it is not the paper's"):
            change("&run t_end = 1.0 /\n")


def test_the_row_of_an_ensemble(tmp_path: Path) -> None:
    piles = pile_ensemble.open_ensemble(write_ensemble(tmp_path / "e"), 0.002).piles
    found = paper_ensemble.row("cubes", piles)
    assert [found[k] for k in ("runs", "A", "B", "neither")] == [6, 1, 3, 2]
    assert found["A of those under water"] == "1 of 4 (25 %, 5 to 70)"
    assert found["first on the floor"] == "drop 1: 3"
    assert found["top [mm]"] == "46"  # of three, on the floor: that of the fixed cubes


@needs_mics
def test_runs_what_is_missing_and_writes_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the program itself, in air: three blocks, let go in a moment."""
    case, out = tmp_path / "blocks.nml", tmp_path / "out"
    dry = ("run.physics='dry'", "run.t_end=0.6", "drop.count=2", "drop.interval=0.3")
    case.write_text(program.case_text(paper.CASE, list(dry)))
    few = tuple(c for c in CHOICES if c.name in ("as_it_is", "tilt_15"))
    monkeypatch.setattr(paper, "CHOICES", few)
    words = ["x", "--case", str(case), "--out", str(out), "--runs", "2", "--moves", "1"]
    words += ["--set", "drop.if_blocked=raise"]
    monkeypatch.setattr("sys.argv", words)
    for left in ("2 of them to do", "0 of them to do"):
        with pytest.raises(SystemExit) as end:
            script("paper_ensemble", "Once more.")
        assert end.value.code == 0
        assert left in capsys.readouterr().out
    with (out / "shares.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["runs"] for row in rows] == ["2", "1", "1"]
    assert [row["what"] for row in rows] == [
        "blocks.nml, drop.if_blocked=raise", "coarse: as it is",
        "coarse: tilts up to 15 degrees"]  # fmt: skip
    assert "tilt_deg = 15" in (out / "tilt_15/0001/case.nml").read_text()
    for name in ("drops", "as_it_is"):
        assert "if_blocked = 'raise'" in (out / name / "0001/case.nml").read_text()
    assert (out / "drops/report.html").is_file() and (out / "shares.md").is_file()
