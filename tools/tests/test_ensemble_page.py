"""The page of an ensemble: its sentence, its maps, and that every pile opens in a browser."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from browser import Browser
from calls import mics_tools
from micstools.pages import charts, ensemble_page
from micstools.piles import pile_ensemble
from test_page import OUT_OF_TILES
from test_pile_ensemble import ENDS, HALF, HEXAPOD, WAITING, write_ensemble


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
    assert json.loads(base64.b64decode(content))["complete"] == 10


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


def test_no_pattern_where_the_papers_blocks_are_not(tmp_path: Path) -> None:
    folder = write_ensemble(tmp_path)
    found = pile_ensemble.open_ensemble(folder, 0.002)
    text = ensemble_page.page(found)
    shown = text.split("<main>")[1].split('id="case"')[0]
    assert "pattern" not in shown and "Were the runs enough" in shown
    assert "All blocks let go, five runs" in shown and "Blocks without room, one run" in shown
    assert shown.index("Where blocks will lie") < shown.index("How much piles differ")


def test_an_ensemble_without_a_title_bears_the_name_of_its_folder(tmp_path: Path) -> None:
    found = pile_ensemble.open_ensemble(write_ensemble(tmp_path / "my reef", ENDS[:1]), 0.002)
    found.piles[0].run.__dict__["parameters"] = {}
    assert "<h1>my reef: one run</h1>" in ensemble_page.page(found)


def test_one_pile_is_an_ensemble(tmp_path: Path) -> None:
    found = pile_ensemble.open_ensemble(write_ensemble(tmp_path, ENDS[:1]), 0.002)
    text = ensemble_page.page(found).replace("\u00a0", " ")
    assert "One block lies at x = 40, y = 50 mm. 100 % of them" in text
    assert re.search(r"The one complete pile is [0-9.]+ mm high", text)


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
    assert browser.run(OUT_OF_TILES.replace(".facts div", ".wall button")) == []
