"""Piles of a made-up ensemble: patterns, maps, shares and files are known exactly."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from calls import mics_tools
from micstools.piles import pile_ensemble, pile_numbers
from micstools.reading import shares
from micstools.reading.reader import BadRun, Run
from micstools.shapes import shape as shapes
from synthetic import UPRIGHT, Motion, write_run

EDGE, HALF, HEXAPOD = 0.02, 0.01, 0.03
LEFT, RIGHT, HIGH, WAITING = 0.04, 0.26, 0.12, (0.15, 0.05, 0.16)
# Where the one dropped cube of each run ends: on the floor left, right, again right, hanging, in
# the air above the water, nowhere.
ENDS = [(LEFT, 0.05, HALF), (RIGHT, 0.05, HALF), (RIGHT, 0.05, HALF), (RIGHT, 0.05, HIGH),
        (RIGHT, 0.05, 0.17), WAITING]  # fmt: skip


def write_ensemble(
    folder: Path, ends: list[tuple[float, float, float]] = ENDS, paper: bool = False
) -> Path:
    """An ensemble with a run for each end, and one more that failed; of cubes, or of the `paper`'s
    hexapods, which reach 2 cm farther."""
    table = []
    for number, end in enumerate(ends, start=1):
        # One that waits does so behind another one.
        places = [(RIGHT, 0.05, HIGH), end] if end == WAITING else [end]
        motion = cube_run(places)
        if paper:
            lift = np.array([0.0, 0.0, HEXAPOD - HALF])
            up = [(at if tuple(at) == WAITING else at + lift, q) for at, q in motion.places]
            motion = replace(motion, places=up, shape=shapes.hexapod(EDGE))
        write_run(folder / f"{number:04d}" / "result", motion)
        table.append(row(number, "no room" if end == WAITING else "settled"))
    table.append(row(len(ends) + 1, "failed"))
    about = {"format": "mics-ensemble", "runs": len(table), "seed": 1, "spread": 0.005,
             "tilt_deg": None, "choices": [{}], "case": "&run title = 'a <b>' t_end = 2 /",
             "table": table}  # fmt: skip
    (folder / "ensemble.json").write_text(json.dumps(about))
    return folder


def cube_run(places: list[tuple[float, float, float]], more: str = "") -> Motion:
    """Cubes dropped one a second that end at some places."""
    return Motion(
        shape=shapes.cube(EDGE),
        places=[(np.array(place), UPRIGHT) for place in places],
        t_end=len(places) + 1.0,
        history_step=0.05,
        field_step=len(places) + 1.0,
        cells=(12, 4, 8),
        more=more,
    )


def row(number: int, outcome: str) -> dict:
    return {"run": number, "seed": 100 + number, "outcome": outcome, "exit_code": 0,
            "time_end": "2", "folder": f"{number:04d}"}  # fmt: skip


@pytest.fixture(scope="module")
def ensemble(tmp_path_factory: pytest.TempPathFactory) -> pile_ensemble.Ensemble:
    folder = write_ensemble(tmp_path_factory.mktemp("ensemble"))
    return pile_ensemble.open_ensemble(folder, 0.002)


def test_patterns_and_their_shares(ensemble: pile_ensemble.Ensemble) -> None:
    assert [p.pattern for p in ensemble.piles] == ["B", "B", "B", "A", "neither", "neither"]
    assert ensemble.left_out == {7: "failed"}
    found = pile_ensemble.pattern_shares(ensemble.piles)
    assert [found[k]["count"] for k in ("A", "B", "neither")] == [1, 3, 2]
    assert found["B"]["share"] == 0.5
    assert found["B"]["interval_95"] == list(shares.wilson(3, 6))
    steps = list(pile_ensemble.running(ensemble.piles, "B"))
    assert [n for n, *_ in steps] == [1, 2, 3, 4, 5, 6]
    assert [share for _, share, *_ in steps] == pytest.approx([1, 1, 1, 0.75, 0.6, 0.5])
    assert steps[3][2:] == shares.wilson(3, 4)


def test_maps_of_five_complete_piles(ensemble: pile_ensemble.Ensemble) -> None:
    """The cube stands left in one of five piles, right on the floor in two, high up in two."""
    assert len(ensemble.whole) == 5
    found = pile_ensemble.maps(ensemble)

    def at(values: np.ndarray, x: float) -> float:
        return float(values[np.abs(found.y - 0.05).argmin(), np.abs(found.x - x).argmin()])

    assert at(found.cover, LEFT) == pytest.approx(0.2)
    assert at(found.cover, RIGHT) == pytest.approx(0.8)
    assert at(found.cover, 0.12) == 0.0 and at(found.cover, 0.15) == 1.0
    assert at(found.mean, LEFT) == pytest.approx(0.2 * EDGE)
    heights = [0, EDGE, EDGE, HIGH + HALF, 0.17 + HALF]
    assert at(found.mean, RIGHT) == pytest.approx(np.mean(heights))
    assert at(found.low, RIGHT) == pytest.approx(np.percentile(heights, 10))
    assert at(found.high, RIGHT) == pytest.approx(np.percentile(heights, 90))


def test_remarkable_piles(ensemble: pile_ensemble.Ensemble) -> None:
    found = pile_ensemble.remarkable(ensemble)
    assert "highest" in found[5]
    assert sorted(words for marks in found.values() for words in marks) == [
        "highest", "least typical", "lowest", "most typical"]  # fmt: skip


def test_the_command_writes_what_it_says(tmp_path: Path, capsys) -> None:
    folder = write_ensemble(tmp_path / "e")
    assert mics_tools(["pile", str(folder), "--step", "0.002", "--box", "0.25", "0.04", "0", "0.27",
                  "0.06", "0.04"]) == 0  # fmt: skip
    said = capsys.readouterr().out
    assert "5 blocks lie around x = " not in said and "6 blocks lie around x = " in said
    assert "A 1 of 6" not in said  # these are no blocks of the paper
    assert " mm (" in said and " cm2 (" in said
    content = json.loads((folder / "pile.json").read_text())
    assert content["complete"] == 5 and content["left_out"] == {"7": "failed"}
    assert content["convergence"]["A"][3][:2] == [4, 0.25]
    with (folder / "pile.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [line["pattern"] for line in table] == ["B", "B", "B", "A", "neither", "neither"]
    voids = [float(line["porosity"]) for line in table]
    assert voids == pytest.approx([1, 0.5, 0.5, 1, 1, 1])
    assert content["numbers"]["porosity"]["median"] == pytest.approx(1.0)
    with h5py.File(folder / "pile_maps.h5") as h5:
        assert h5["cover"].shape == (50, 150) and h5["mean"].attrs["units"] == "m"


def test_patterns_are_told_of_the_papers_blocks(tmp_path: Path, capsys) -> None:
    folder = write_ensemble(tmp_path / "e", paper=True)
    mics_tools(["pile", str(folder), "--step", "0.002"])
    said = capsys.readouterr().out
    assert "A 1 of 6 (17 %, 3 to 56), B 3 of 6 (50 %, 19 to 81)" in said


def test_where_blocks_lie(ensemble: pile_ensemble.Ensemble, tmp_path: Path, capsys) -> None:
    """Seven cubes were let go, two of them in the last run, where one hangs at the drop."""
    found = ensemble.placing
    x = np.array([LEFT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT])
    assert found and found.blocks == 6
    assert found.centre == pytest.approx((x.mean(), 0.05))
    assert found.spread == pytest.approx((x.std(), 0.0))
    away = np.abs(x - x.mean())
    assert found.half_within == pytest.approx(np.percentile(away, 50))
    assert found.most_within == pytest.approx(np.percentile(away, 90))
    # All are dropped at x = 0.15, so the area of the drops is as large as a cube.
    assert found.area.low == pytest.approx((0.14, 0.04))
    assert found.area.high == pytest.approx((0.16, 0.06))
    assert found.outside == 1.0 and found.outside_of_runs == (1.0, 1.0)
    words = ["pile", str(ensemble.folder), "--step", "0.002", "--area", "0.2", "0", "0.3", "0.1"]
    assert mics_tools(words) == 0
    said = capsys.readouterr().out
    assert "17 % of them (0 to 75 % in 90 % of the runs) lie outside the wanted area" in said
    assert "x = 200 to 300, y = 0 to 100 mm" in said
    placing = json.loads((ensemble.folder / "pile.json").read_text())["placing"]
    assert placing["outside"] == pytest.approx(1 / 6)
    assert placing["area"]["high"] == [0.3, 0.1]
    for wrong, text in ((["--area", "0.3", "0", "0.2", "0.1"], "first corner must be the lower"),):
        assert mics_tools(["pile", str(ensemble.folder), *wrong]) == 2
        assert text in capsys.readouterr().err


def test_an_area_is_for_an_ensemble(ensemble: pile_ensemble.Ensemble, capsys) -> None:
    run = str(ensemble.piles[0].run.folder)
    for command in ("pile", "report"):
        assert mics_tools([command, run, "--area", "0", "0", "1", "1"]) == 2
        assert "for an ensemble" in capsys.readouterr().err


def test_an_ensemble_without_an_end_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadRun, match="no run that came to its end"):
        pile_ensemble.open_ensemble(write_ensemble(tmp_path, []))


@pytest.mark.parametrize("text", ['{"format": "mics-ens', "{}", "[]", '{"format": "x"}'])
def test_a_damaged_table_is_one_line(tmp_path: Path, text: str, capsys) -> None:
    (tmp_path / "ensemble.json").write_text(text)
    for command in ("pile", "report"):
        assert mics_tools([command, str(tmp_path)]) == 2
        assert "ensemble.json: cannot be read; the same" in capsys.readouterr().err


def test_interval_of_a_median() -> None:
    """Ranks 6 and 15 of 20: Conover, table A3 (binomial, 20, one half); none below six."""
    assert pile_ensemble.median_interval(list(range(1, 21))) == (6, 15)
    assert pile_ensemble.median_interval([3, 1, 2, 6, 5, 4]) == (1, 6)
    assert np.isnan(pile_ensemble.median_interval([1, 2, 3, 4, 5])).all()
    assert pile_ensemble.spread_of([float("nan")]) is None
    many = pile_ensemble.median_interval(list(range(1, 2001)))  # by the normal distribution
    assert np.array(many) == pytest.approx(1000.5 + 0.98 * np.sqrt(2000) * np.array([-1, 1]), abs=1)


def test_a_drop_of_the_very_start_can_wait(tmp_path: Path) -> None:
    """It hangs at its place, due since t = 0: the pile is not complete, and no pattern."""
    folder = write_ensemble(tmp_path, [WAITING])
    run = Run(write_run(folder / "0001" / "result", cube_run([WAITING])))
    assert list(run.bodies.present(-1)) == [True, True, True, False]
    (pile,) = pile_ensemble.open_ensemble(folder, 0.002).piles
    assert (pile.pattern, pile.complete, pile.numbers.blocks) == ("neither", False, 3)


@pytest.mark.parametrize(("height", "dry"), [(0.1503, False), (0.152, True)])
def test_under_water_is_judged_by_the_level_of_the_end(
    height: float, dry: bool, tmp_path: Path
) -> None:
    """Cubes lift the water by some 0.67 mm, so a centroid 0.3 mm above its first level is wet."""
    ends = [(LEFT, 0.05, HALF), (0.12, 0.05, 0.08), (RIGHT, 0.05, height)]
    run = Run(write_run(tmp_path / "run", cube_run(ends)))
    found = pile_numbers.numbers(run, 0.002)
    assert (pile_ensemble.pattern(run, found) == "neither") == dry


def test_each_choice_has_its_own_numbers(tmp_path: Path, capsys) -> None:
    """Choices share their drops, so no interval is taken over all of them."""
    folder, name = write_ensemble(tmp_path, ENDS[:4], paper=True), "contact.friction"
    about = json.loads((folder / "ensemble.json").read_text())
    about["choices"] = [{name: 0.4}, {name: 0.6}]
    for line in about["table"]:
        line[name] = 0.4 if line["run"] % 2 else 0.6
    (folder / "ensemble.json").write_text(json.dumps(about))
    mics_tools(["pile", str(folder), "--step", "0.002"])
    said = capsys.readouterr().out
    assert "contact.friction = 0.4: A 0 of 2" in said and "contact.friction = 0.6: A 1 of 2" in said
    content = json.loads((folder / "pile.json").read_text())
    tops = [part["numbers"]["top"] for part in content["patterns"]]
    assert [top["known"] for top in tops] == [2, 2] and tops[0] != tops[1]
    assert "numbers" not in content and "convergence" not in content
    with h5py.File(folder / "pile_maps.h5") as h5:
        assert sorted(h5) == ["contact.friction = 0.4", "contact.friction = 0.6"]
        assert h5["contact.friction = 0.4/cover"].attrs["units"] == "-"
