"""The page of a case before it is computed: what comes where and when, marks of the warnings, and
that it works in a browser without a network."""

import base64
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from browser import Browser
from calls import MICS, mics_tools, needs_mics
from micstools.pages import plan_page, set_up
from micstools.pages.set_up import SetUp
from micstools.reading import units
from micstools.reading.reader import Grid, Run
from synthetic import write_run
from test_page import scene_of

pytestmark = needs_mics
CASE = """&run t_end = 8  dt = 0.02  title = '<i>Crane</i> and pusher' /
&grid cells = 48, 24, 16  length = 24, 12, 8 /
&fluid water_level = 9 /
&water min = 0, 0, 0  max = 2, 30, 1 /
&shape name = 'cube'  kind = 'cube'  size = 1.0 /
&body shape = 'cube'  position = 2, 6, 0.51  fixed = .true.  velocity = 1, 0, 0 /
&body shape = 'cube'  position = 20, 6, 0.51 /
&drop shape = 'cube'  position = 6, 3, 5  count = 2  interval = 2  spread = 0.5, 0.3, 0 /
&drop shape = 'cube'  position = 12, 3, 5  count = 2  first_time = 3  interval = 7
  orientation = 'random' /
"""


@pytest.fixture(scope="module")
def found() -> Iterator[SetUp]:
    with set_up.read(MICS, CASE) as found:
        yield found


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    case = tmp_path_factory.mktemp("plan") / "crane.nml"
    case.write_text(CASE)
    assert mics_tools(["check", str(case), "--program", str(MICS), "--page"]) == 0
    assert sorted(p.name for p in case.parent.iterdir()) == ["check.html", "crane.nml"]
    return case.with_name("check.html")


def test_the_program_tells_what_comes(found: SetUp) -> None:
    """Due times also of blocks that have not moved; random shifts about the places that are
    planned; where fixed bodies go."""
    assert found.run.bodies.release_time.tolist() == [0, 0, 0, 2, 3, 10]
    assert found.line.tolist() == [6, 7, 8, 8, 9, 9]
    assert found.place[2].tolist() == [6, 3, 5] and found.spread[2].tolist() == [0.5, 0.3, 0]
    shift = found.run.bodies.position[0] - found.place
    assert (np.abs(shift) <= found.spread).all() and (shift[2:4, :2] != 0).all()
    way = found.run.bodies.position[:, 0]
    assert way[-1] == pytest.approx([10, 6, 0.51]) and found.run.bodies.time[-1] == 8
    assert np.ptp(found.run.bodies.position[:, 1:], axis=0).max() == 0


def test_warnings_find_their_places(found: SetUp) -> None:
    by_group = {w.group: n for n, w in enumerate(found.warnings, 1)}
    assert {"fluid", "drop", "shape"} <= set(by_group)
    late = found.warnings[by_group["drop"] - 1]
    assert (late.variable, late.occurrence, late.line) == ("count", 1, 9)
    assert "line" not in late.text
    places = {mark["number"]: mark for mark in plan_page.marks(found)}
    assert places[by_group["drop"]]["bodies"] == [4, 5]
    assert places[by_group["shape"]]["bodies"] == [0]
    assert places[by_group["fluid"]]["at"] == [[12, 6, 8]]


def test_warnings_of_one_kind_are_one(tmp_path: Path, capfd) -> None:
    """With a count, and all their blocks marked; two are told one by one."""
    drops = "&drop shape = 'cube'  position = 6, 3, 5  first_time = {} /\n"
    text = CASE + "".join(drops.format(10 + k) for k in range(36))
    with set_up.read(MICS, text) as found:
        (late,) = (w for w in found.warnings if w.variable == "count")
        assert late.place == " (line 9; 36 more of this kind, the last in 46)"
        assert found.bodies_of(late) == list(range(4, 42))
    case = tmp_path / "case.nml"
    case.write_text(text)
    assert mics_tools(["check", str(case), "--program", str(MICS)]) == 0
    said = capfd.readouterr().out
    assert said.count("warning: &drop count") == 1 and "36 more of this kind" in said


def test_the_scene_has_what_comes(found: SetUp, page: Path) -> None:
    scene = scene_of(page)
    plan, bodies = scene["plan"], scene["bodies"]
    assert [body["release"] for body in bodies] == [0, 0, 1e-6, 2, 3, 10]
    assert [body.get("label") for body in bodies[1:4]] == [None, "3: 0 s", "4: 2 s"]
    assert plan["reach"] == [[[5.5, 2.7, 5], [6.5, 3.3, 5]]]
    assert plan["liquid"] == [[[0, 0, 0], [2, 12, 1]]]
    ways = {way["name"]: way["way"] for way in plan["ways"]}
    assert [p[0] for p in ways["drops 3–6"]] == [6, 6, 12, 12]
    assert [ways["body 1"][k][0] for k in (0, -1)] == pytest.approx([2, 10])
    assert [len(faces) for faces in plan["cells"]] == [47, 23, 15]
    times = np.frombuffer(base64.b64decode(scene["times"]), "<f4")
    assert times[0] == 0 and times[-1] == 8
    assert scene["water"] == {"level": 8}


def test_the_scene_does_not_depend_on_the_origin(found: SetUp) -> None:
    """Places count from the corner of the tank: single precision would not hold a survey's."""
    corner = np.array([354200.0, 5621080.0, -12.0])

    def moved(group: re.Match[str]) -> str:
        place = np.array([float(v) for v in group[2].split(",")]) + corner
        return group[1] + ", ".join(repr(v) for v in place.tolist())

    text = re.sub(r"((?:position|min|max) = )([\d., ]+\d)", moved, CASE)
    text = text.replace("24, 12, 8 /", "24, 12, 8  origin = 354200, 5621080, -12 /")
    with set_up.read(MICS, text.replace("water_level = 9", "water_level = -3")) as far:
        seen, wanted = plan_page.scene(far), plan_page.scene(found)
        row = plan_page._row(far, [2], units.SITE, "#000000")
    place = [np.frombuffer(base64.b64decode(s["place"]), "<f4") for s in (seen, wanted)]
    assert place[0] == pytest.approx(place[1], abs=1e-5)
    assert seen["water"] == pytest.approx(wanted["water"])
    for name in ("cells", "reach", "liquid"):
        for a, b in zip(seen["plan"][name], wanted["plan"][name], strict=True):
            assert np.array(a) == pytest.approx(np.array(b), abs=1e-6), name
    for a, b in zip(seen["plan"]["ways"], wanted["plan"]["ways"], strict=True):
        assert np.array(a["way"]) == pytest.approx(np.array(b["way"]), abs=1e-6)
    ends = [[m["at"] for m in s["plan"]["marks"] if m["at"]] for s in (seen, wanted)]
    assert ends[0] == ends[1]
    assert "354206, 5621083, -7" in row


def test_faces_of_many_cells_are_thinned(tmp_path: Path) -> None:
    many, one = np.linspace(3, 4, 1001), np.array([0.0, 1.0])
    run = Run(write_run(tmp_path / "run"))
    run.__dict__["grid"] = Grid(many, one, one)
    x, *others = plan_page._cells(run)
    assert len(x) < 160 and x[0] == 0.007 and others == [[], []]


def test_the_plan_is_told_in_words(found: SetUp, page: Path) -> None:
    text = page.read_text()
    assert found.entry("Tank", "cells") == "48 x 24 x 16 = 18432" and "18432" in text
    time, memory = found.entry("Time steps", "time of the run"), found.entry("Memory", "about")
    said = [time.split(" or ")[0][6:], memory.split(" of ")[0], "±0.5, ±0.3, 0", "3 to 4"]
    for words in (*said, "<h1>&lt;i&gt;Crane&lt;/i&gt; and pusher</h1>"):
        assert words in text, words
    assert "http" not in text.replace("http-equiv", "")


def test_a_refused_case_is_told_and_nothing_written(tmp_path: Path, capfd) -> None:
    case = tmp_path / "case.nml"
    case.write_text(CASE.replace("size = 1.0", "size = -1.0"))
    assert mics_tools(["check", str(case), "--program", str(MICS), "--page"]) == 2
    said = capfd.readouterr().err
    assert said.startswith("mics: &shape size = -1") and "(line 5)" in said
    assert [p.name for p in tmp_path.iterdir()] == ["case.nml"]
    remark = set_up.Refused(said, case.read_text()).remarks[0]
    assert (remark.group, remark.variable, remark.occurrence) == ("shape", "size", 0)


def test_the_page_works_in_a_browser(browser: Browser, page: Path) -> None:
    """It turns, marks a warning, lets blocks come; it loads nothing, and nothing fails."""
    browser.open(page)
    yaw = browser.run("planPlayer.stage.yaw")
    x, y = browser.corner()
    browser.drag((x + 200, y + 150), (x + 280, y + 150))
    assert browser.run("planPlayer.stage.yaw") == pytest.approx(yaw - 0.5)
    numbers = browser.run("planPlayer.plan.marks.map(m => m.number)")
    assert set(numbers) == {mark["number"] for mark in scene_of(page)["plan"]["marks"]}
    browser.run("document.querySelector('[data-mark=\"2\"]').click()")
    assert browser.run("planPlayer.plan.asked") == 2
    ghosts = "planPlayer.stage.scene.bodies.filter((b, k) => !planPlayer.stage.shown(k)).length"
    assert browser.run(ghosts) == 4
    browser.run("planPlayer.show(3)")
    assert browser.run(ghosts) == 1
    labels = browser.run("planPlayer.stage.overlay.labels.map(l => l[0])")
    assert "3: 0 s" in labels
    before = browser.picture()
    browser.run("document.querySelector('.cells').click()")
    browser.settle()
    assert browser.picture() != before
    browser.run("document.querySelector('[data-line]').click()")
    (line,) = re.findall(r"line (\d+)", browser.run("document.querySelector('.line').textContent"))
    assert browser.run("`${getSelection()}`").strip() == CASE.splitlines()[int(line) - 1].strip()
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []


@pytest.mark.parametrize("width", [390, 1400])
def test_names_of_many_units_leave_them_seen(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    """Of forty units on a roundhead no two names meet, and each is on its unit."""
    monkeypatch.chdir(MICS.parent)
    path = tmp_path / "check.html"
    words = ["check", "input/roundhead.nml", "--program", str(MICS), "--page", "--out", str(path)]
    assert mics_tools(words) == 0
    browser.open(path, width, 844)
    labels = browser.run("planPlayer.stage.overlay.labels")
    assert width / 200 <= len(labels) <= 40
    for k, (_, x, y, wide) in enumerate(labels):
        assert all(abs(x - u) > (wide + w) / 2 or abs(y - v) > 12 for _, u, v, w in labels[:k])
    seen = "s.scene.bodies[s.seen.at(Math.floor(x / 4), Math.floor(y / 4)) - 1].number"
    found = browser.run(f"(s => s.overlay.labels.map(([, x, y]) => {seen}))(planPlayer.stage)")
    assert found == [name for name, *_ in labels] and "D1" in found


@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_phone(browser: Browser, page: Path, dark: bool) -> None:
    browser.open(page, 360, 740, dark)
    assert browser.run("document.documentElement.scrollWidth") <= 360
