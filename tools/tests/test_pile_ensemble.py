"""Piles of a made-up ensemble: patterns, maps, shares and files are known exactly; so is its page,
from which every pile opens in a browser."""

import base64
import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.axes import Axes

from browser import Browser
from calls import mics_tools
from micstools.pages import charts, ensemble_page
from micstools.piles import drawing, pile_ensemble, pile_numbers, placing
from micstools.reading import places, shares
from micstools.reading.reader import BadRun, Run
from micstools.shapes import shape as shapes
from synthetic import UPRIGHT, Motion, reword, write_run

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


def cube_run(places: list[tuple[float, float, float]]) -> Motion:
    """Cubes dropped one a second that end at some places."""
    ends, t_end = [(np.array(place), UPRIGHT) for place in places], len(places) + 1.0
    return Motion(shape=shapes.cube(EDGE), places=ends, t_end=t_end, history_step=0.05,
                  field_step=t_end, cells=(12, 4, 8))  # fmt: skip


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
    assert " mm [" in said and " cm2 [" in said
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
    assert "17 % of them (0 to 75 % in 90 % of the runs; 95 % interval 0 to 50 %) lie" in said
    assert "x = 200 to 300, y = 0 to 100 mm" in said
    placing = json.loads((ensemble.folder / "pile.json").read_text())["placing"]
    assert placing["outside"] == pytest.approx(1 / 6)
    assert placing["area"]["high"] == [0.3, 0.1]
    assert mics_tools(["pile", str(ensemble.folder), "--area", "0.3", "0", "0.2", "0.1"]) == 2
    assert "first corner must be the lower" in capsys.readouterr().err


def test_intervals_are_those_of_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the mean of 400 independent runs as of the normal distribution; the three blocks of a run
    that lie together count once."""
    monkeypatch.setattr(placing, "ends", lambda run: run)
    monkeypatch.setattr(placing, "waiting", lambda run: 0)
    x = np.random.default_rng(5).normal(size=(400, 2))
    area = placing.Area((0.0, -9.0), (9.0, 9.0), True)
    for times in (1, 3):
        found = placing.placing([np.repeat(one[None], times, axis=0) for one in x], area)
        low, high = found.interval_95["centre_x"]
        assert (low + high) / 2 == pytest.approx(x[:, 0].mean(), abs=0.01)
        assert high - low == pytest.approx(2 * 1.96 * x[:, 0].std() / 20, rel=0.06)
        share = found.outside
        low, high = found.interval_95["outside"]
        assert high - low == pytest.approx(2 * 1.96 * np.sqrt(share * (1 - share)) / 20, rel=0.06)
    assert np.isnan(placing.placing([x], area).interval_95["centre_x"]).all()


def test_an_ensemble_without_an_end_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadRun, match="no run that came to its end"):
        pile_ensemble.open_ensemble(write_ensemble(tmp_path, []))


def test_a_run_without_a_block_is_left_out(tmp_path: Path) -> None:
    folder = write_ensemble(tmp_path, ENDS[:2])
    with h5py.File(folder / "0001/result/run.h5", "r+") as h5:
        h5["bodies/release_time"][:] = 1e9
    assert pile_ensemble.open_ensemble(folder).left_out == {1: "no block in the tank", 3: "failed"}


def test_a_block_that_left_is_counted(tmp_path: Path) -> None:
    """Also where its run holds no other one."""
    folder = write_ensemble(tmp_path, ENDS[:3])
    for path, fixed in (("0001", 1e9), ("0002", 0.0)):
        with h5py.File(folder / path / "result/run.h5", "r+") as h5:
            bodies = h5["bodies"]
            bodies["release_time"][:3] = fixed
            bodies["status"] = np.array([2, 2, 2, 4])
            bodies["exit_time"] = np.array([np.inf, np.inf, np.inf, 1.5])
            bodies["position"][-1, 3, 0] = -0.01
            bodies["entry_time"], bodies["raised"] = bodies["release_time"][:], np.zeros(4)
    tank = placing.Area((0.0, 0.0), (0.3, 0.1), True)
    found = pile_ensemble.open_ensemble(folder, area=tank)
    assert found.left_out == {1: "all blocks out of the tank", 4: "failed"}
    assert [row["out_of_tank"] for row in pile_ensemble.rows(found)] == [1, 0]
    assert (found.placing.blocks, found.placing.outside) == (3, pytest.approx(2 / 3))
    within = places.within(sum(pile_ensemble.places_of(found)[0], []), 1.0)
    assert (within.units, within.count) == (3, 1)
    assert mics_tools(["places", str(folder)]) == 0
    with (folder / "places.csv").open() as file:
        assert {row["run"] for row in csv.DictReader(file)} == {"1", "2", "3"}


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
    found = pile_ensemble.spread_of(list(range(1, 22)))
    assert (found["5 %"], found["median"], found["95 %"]) == (2, 11, 20)
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
    """Choices share their drops, so no interval is taken over all of them; no run of the third has
    come to its end."""
    folder, name = write_ensemble(tmp_path, ENDS[:4], paper=True), "contact.friction"
    about = json.loads((folder / "ensemble.json").read_text())
    about["choices"] = [{name: 0.4}, {name: 0.6}, {name: 0.8}]
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


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_ensemble(tmp_path_factory.mktemp("page") / "piles", ENDS * 2, paper=True)
    assert mics_tools(["report", str(folder)]) == 0
    return folder / "report.html"


def on_hexapods(end: tuple[float, float, float]) -> list[float]:
    """Where a hexapod ends in the place of a cube."""
    return [end[0], end[1], end[2] + HEXAPOD - HALF]


def test_the_sentence_has_shares_and_heights(report: Path) -> None:
    found = pile_ensemble.open_ensemble(report.parent, 0.002)
    said = ensemble_page.sentence(found)
    assert "17\u00a0%" in said  # numbers and units stay on one line
    said = said.replace("\u00a0", " ")
    assert said.startswith("12 blocks lie around x = 223.3, y = 50 mm, with a standard deviation")
    assert "% of them (" in said and "lie outside the area of the drops, x = 120 to 180" in said
    assert "In 2 of 12 (17 %, 5 to 45) runs every dropped block ends off the floor" in said
    assert "in 6 of 12 (50 %, 25 to 75) at least one more" in said
    assert "Half of the 10 complete piles are higher than" in said
    assumed = ensemble_page.assumptions(found)
    assert "friction of blocks 0.6" in assumed and "runs 13 (failed)" in assumed


def test_the_page_holds_every_pile(report: Path) -> None:
    text = report.read_text()
    found = re.search(r'id="piles">(.*?)</script>', text, re.DOTALL)
    assert found
    piles = json.loads(found[1])
    assert list(piles["runs"]) == [str(k) for k in range(1, 13)]
    place = np.frombuffer(base64.b64decode(piles["runs"]["1"]["scene"]["place"]), "<f4")
    assert place.reshape(-1, 3)[3] == pytest.approx(on_hexapods(ENDS[0]))
    assert text.count("data-pile=") == 12
    for mark in ("most typical", "least typical", "highest", "lowest"):
        assert f"<b>{mark}</b>" in text


def test_what_is_taken_along_is_whole(report: Path) -> None:
    text = report.read_text()
    (table,) = re.findall(r'data:text/csv;base64,([^"]*)', text)
    assert len(base64.b64decode(table).decode().splitlines()) == 13
    (content,) = re.findall(r'data:application/json;base64,([^"]*)', text)
    found = json.loads(base64.b64decode(content), parse_constant=pytest.fail)  # nan is no JSON
    assert found["complete"] == 10


def test_health_is_the_worst_of_all_runs(tmp_path: Path) -> None:
    found = pile_ensemble.open_ensemble(write_ensemble(tmp_path, ENDS[:2]), 0.002)
    good = ensemble_page.page(found).split('id="health"')[1].split("</section>")[0]
    series = found.piles[1].run.series
    deep = replace(series, max_overlap=np.full_like(series.max_overlap, 0.5))
    found.piles[1].run.__dict__["series"] = deep
    bad = ensemble_page.page(found).split('id="health"')[1].split("</section>")[0]
    assert bad.count("! look") == good.count("! look") + 1
    assert "500\u00a0mm" in bad and "contact_time" in bad and "run 2" in bad


def test_an_ensemble_without_a_complete_pile_tells_so(tmp_path: Path) -> None:
    found = pile_ensemble.open_ensemble(write_ensemble(tmp_path, [WAITING] * 2), 0.002)
    text = ensemble_page.page(found).replace("\u00a0", " ")
    assert "In 2 of 2 (100 %, 34 to 100) runs not all blocks found room." in text
    assert "No pile has all its blocks, so there is no mean pile." in text
    assert text.count("data-pile=") == 2 and 'id="plan"' not in text


def test_no_pattern_where_the_papers_blocks_are_not(ensemble: pile_ensemble.Ensemble) -> None:
    shown = ensemble_page.page(ensemble).split("<main ")[1].split('id="case"')[0]
    assert "pattern" not in shown and "Were the runs enough" in shown
    assert "All blocks let go, five runs" in shown and "Blocks without room, one run" in shown
    assert shown.index("Where blocks will lie") < shown.index("How much piles differ")


@pytest.mark.parametrize("turned", [0.0, 30.0])
def test_maps_have_axes_frames_and_the_current(turned: float, tmp_path: Path) -> None:
    """In metres of the survey; the shares tell what they leave out."""
    folder, drawn = write_ensemble(tmp_path), list[Axes]()
    reword(folder / "0001/result", lambda text: text.replace("&fluid", "&fluid velocity = 0, 3, 0"))
    words = ["--area", "0.2", "0", "0.3", "0.1", "--origin", "354200,5621080,0"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "uri", lambda figure: drawn.append(figure.axes[0]) or "")
        assert mics_tools(["report", str(folder), *words, "--north", str(turned)]) == 0
    text = (folder / "report.html").read_text().replace("\u00a0", " ")
    assert "7 (failed)" in text and "; left out: 1 not released." in text
    assert "Solid line: the wanted area. Arrow: current, 3 m/s." in text and len(drawn) == 4
    axes = drawn[0]
    assert axes.get_xlabel() == "easting [m]" and axes.get_ylabel() == "northing [m]"
    east, north = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    assert axes.get_xlim() == pytest.approx((354200 - 0.1 * north, 354200 + 0.3 * east), abs=1e-6)
    drops, wanted = axes.patches
    to = axes.transData.inverted()
    corner = to.transform(wanted.get_transform().transform([[1, 0]]))[0]
    assert corner == pytest.approx((354200 + 0.3 * east, 5621080 + 0.3 * north), abs=1e-6)
    assert (drops.get_linestyle(), wanted.get_linestyle()) == ("--", "-")
    (arrow,) = axes.collections
    assert [*arrow.U, *arrow.V] == pytest.approx([-0.03 * north, 0.03 * east])


def test_one_pile_is_an_ensemble(tmp_path: Path) -> None:
    """Without a title it bears the name of its folder."""
    found = pile_ensemble.open_ensemble(write_ensemble(tmp_path / "my reef", ENDS[:1]), 0.002)
    text = ensemble_page.page(found).replace("\u00a0", " ")
    assert "One block lies at x = 40, y = 50 mm. 100 % of them" in text
    assert re.search(r"The one complete pile is [0-9.]+ mm high", text)
    found.piles[0].run.__dict__["parameters"] = {}
    assert "<h1>my reef: one run</h1>" in ensemble_page.page(found)


def test_each_choice_has_its_own_maps(tmp_path: Path) -> None:
    folder, name = write_ensemble(tmp_path), "contact.friction"
    about = json.loads((folder / "ensemble.json").read_text())
    about["choices"] = [{name: 0.4}, {name: 0.6}, {name: 0.8}]
    for row in about["table"]:  # left | right, right, high | in the air, nowhere
        row[name] = 0.4 if row["run"] == 1 else 0.6 if row["run"] < 5 else 0.8
    (folder / "ensemble.json").write_text(json.dumps(about))
    found = pile_ensemble.open_ensemble(folder, 0.002)
    left, right = (pile_ensemble.maps(part) for part in found.parts[:2])
    more = left.cover - right.cover  # fixed blocks lie in all piles
    assert more[:, left.x < 0.15].max() == 1.0 and more[:, left.x > 0.15].min() == -1.0
    assert more[:, left.x < 0.15].min() == 0.0 and more[:, left.x > 0.15].max() == 0.0
    text = ensemble_page.page(found)
    plan = text[text.index("Where blocks will lie") : text.index("How much piles differ")]
    said = re.findall(r"<h3>(contact\.friction[^<]*)</h3>", plan)
    piles = {0.4: "one pile", 0.6: "three piles", 0.8: "one pile"}
    assert said == [f"{name} = {value}: {n}" for value, n in piles.items()]
    assert text.count('class="maps"') == 3


def test_a_histogram_counts_every_value() -> None:
    drawn = charts.histogram(np.array([1.0, 1.1, 2.0, 5.0]), "a", [(1.5, "median")])
    heights = [float(h) for h in re.findall(r'class="bar"[^>]* height="([\d.]+)"', drawn)]
    unit = min(heights)
    assert sum(round(h / unit) for h in heights) == 4
    assert "0.5" not in re.findall(r">([\d.]+)</text>", drawn)


def test_values_that_differ_by_rounding_are_one_bar() -> None:
    values = 40.0 + 1e-14 * np.arange(3)
    drawn = charts.histogram(values, "a", [(40.0, "median")])
    assert drawn.count('class="bar"') == 1
    low, high = charts.spanning(values)
    assert low < 39 and high > 41


def test_a_click_opens_a_pile(browser: Browser, report: Path) -> None:
    browser.open(report)
    for number in (1, 4):
        browser.run(f"document.querySelector('[data-pile=\"{number}\"]').click()")
        assert browser.run("dialog.open")
        assert f"Run {number}:" in browser.run("dialog.querySelector('h3').textContent")
        place = browser.run("pilePlayer.stage.pose(3).place")
        assert place == pytest.approx(on_hexapods(ENDS[number - 1]), abs=1e-6)
        browser.run("dialog.querySelector('.close').click()")
        assert not browser.run("dialog.open")
    browser.run("document.querySelector('[data-pile]').click()")
    row = "getComputedStyle(dialog.querySelector('.row.moving')).display"
    assert browser.run(row) == "none"  # nothing moves
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith("data:")] == [report.as_uri()]


@pytest.mark.parametrize("dark", [False, True])
def test_the_page_fits_a_phone(browser: Browser, report: Path, dark: bool) -> None:
    browser.open(report, 360, 740, dark)
    assert browser.run("document.documentElement.scrollWidth") <= 360
    assert browser.out_of(".wall button") == []
