"""The page of a run: what is in it, that titles are text, how it tells the case, and that it plays
in a browser."""

import base64
import json
import re
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from browser import Browser
from calls import ROOT, mics_tools, until
from micstools.pages import charts, html, motion, run_page, run_words, views
from micstools.pages.charts import Curve
from micstools.piles import maps, pile_numbers
from micstools.reading import block_numbers, units
from micstools.reading.overlap import Placed
from micstools.reading.reader import Run
from micstools.reading.units import LABORATORY, SITE
from micstools.shapes import shape as shapes
from synthetic import UPRIGHT, Motion, change, reword, write_run

TITLE = "<b>Reef</b> & \"co\" </script><script>document.title = 'x'</script>"
CLEAR = np.array([0.2, 0.05, 0.12])  # of the other blocks [m]


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a synthetic run with a title that looks like markup."""
    folder = write_run(tmp_path_factory.mktemp("page") / "run")
    written = '"' + TITLE.replace('"', '""') + '"'
    reword(folder, lambda text: text.replace("'synthetic'", written))
    assert mics_tools(["report", str(folder)]) == 0
    return folder / "report.html"


def scene_of(page: Path) -> dict:
    found = re.search(r'id="scene">(.*?)</script>', page.read_text(), re.DOTALL)
    assert found
    return json.loads(found[1])


def test_text_is_never_markup() -> None:
    assert html.tag("p", "<b>", html.tag("i", "&"), title='"') == (
        '<p title="&quot;">&lt;b&gt;<i>&amp;</i></p>'
    )
    assert "</script>" not in html.data("a", {"t": "</script>"})[:-9]


def test_a_run_without_blocks_has_a_page(make_run) -> None:
    run = make_run(Motion(t_end=0.1))
    run.__dict__["bodies"] = replace(run.bodies, shape=[])
    text = run_page.page(run)
    assert "without blocks" in text and "There are no blocks." in text
    assert "drift of the liquid volume" in text and "overlap" not in text.split("<main ")[1]


def words_of(page: str) -> str:
    """What stands on a page, but for pictures and data, down to the settings of the case."""
    return re.sub(r"data:[^\"]*", "", page).split("<main ")[1].split('id="settings"')[0]


def test_units_go_with_the_blocks(make_run) -> None:
    """Blocks of 2 m: m, m2, m3, kN, t and kJ everywhere, and figures without exponents; of 60 mm:
    mm, N, kg."""
    motion = Motion(t_end=2.0, field_step=2.0, cells=(12, 4, 8), places=[(CLEAR, UPRIGHT)])
    small = words_of(run_page.page(make_run(motion)))
    large = words_of(run_page.page(make_run(replace(motion, scale=100 / 3))))
    for text, there, never in (
        (small, ("mm", "cm²", "cm³", "N", "kg", "mJ", "m/s"), ("m", "m²", "m³", "kN", "t", "kJ")),
        (large, ("m", "m²", "m³", "kN", "t", "kJ", "m/s"), ("mm", "cm²", "cm³", "N", "kg", "mJ")),
    ):
        found = set(re.findall(r"(?:\[|[\d–]\u00a0)([^\d\W][²³\w/]*)", text))
        assert found >= set(there), set(there) - found
        assert not found & set(never), found & set(never)
    tiles = large.split('class="facts"')[1].split("</dl>")[0]
    assert "e+" not in tiles and "\u00a0kN" in tiles


def test_plan_is_covered_within_the_footprint(make_run) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0, cells=(12, 4, 8), places=[(CLEAR, UPRIGHT)]))
    n = pile_numbers.numbers(run, maps.usual_step(run))
    tile = run_page.page(run).split("plan covered")[1].split("</div>")[0].replace("\u00a0", " ")
    share = f"{100 * n.plan_area / n.footprint:.0f} % of a footprint of"
    assert share in tile and f"{1e4 * n.footprint:.3g} cm²" in tile


def test_make_run_makes_the_page() -> None:
    """The newcomer's one command ends with the page of its case."""
    words = ["make", "--no-print-directory", "-n", "run", "CASE=input/dam_break.nml"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    said = [line for line in done.stdout.splitlines() if "input/dam_break.nml" in line]
    assert said[0] == "./mics < input/dam_break.nml"
    assert said[-1].endswith(" report input/dam_break.nml")


def test_nothing_is_loaded_from_outside(report: Path) -> None:
    text = report.read_text()
    assert 'content="default-src &#x27;none&#x27;;' in text
    for found in re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\'>) ]{1,20})', text):
        assert found.startswith("data:"), found


def test_motions_are_those_of_the_run(loose_pile: Run) -> None:
    scene, rows = motion.scene(loose_pile), motion.frames(loose_pile)
    b = loose_pile.bodies
    place = np.frombuffer(base64.b64decode(scene["place"]), "<f4").reshape(len(rows), b.n, 3)
    turn = np.frombuffer(base64.b64decode(scene["turn"]), "<i2").reshape(len(rows), b.n, 4)
    assert rows[0] == 0 and rows[-1] == len(b.time) - 1
    there = b.time[rows][:, None] >= b.entry_time
    assert place[there] == pytest.approx(b.position[rows][there], abs=1e-7)  # the corner is at 0
    assert turn / 32767 == pytest.approx(b.quaternion[rows], abs=2e-5)
    assert np.diff(b.time[rows]).max() <= 1.5 / motion.FRAMES_A_SECOND
    assert [body["release"] for body in scene["bodies"]][:4] == [0.0, 0.0, 0.0, 0.0]


def test_a_block_waits_where_it_is_first_seen(loose_pile: Run) -> None:
    run, k = Run(loose_pile.folder), int(loose_pile.bodies.dropped[-1])
    rows, waits = motion.frames(run), run.bodies.time < run.bodies.entry_time[k]
    run.bodies.position[waits, k] = 9.0
    place = np.frombuffer(base64.b64decode(motion.scene(run)["place"]), "<f4")
    seen, late = place.reshape(len(rows), run.bodies.n, 3)[:, k], waits[rows]
    assert late.sum() > 9 and (seen[late] == seen[late.sum()]).all() and (seen < 1.0).all()


SURVEY = (354200.0, 5621080.0, -12.0)
"""Where single precision knows places to 3 cm and half a metre."""


@pytest.fixture
def far_pile(tmp_path: Path) -> Run:
    """A run of 2 m blocks in coordinates of a survey."""
    return Run(write_run(tmp_path / "far", Motion(scale=100 / 3, origin=SURVEY)))


def test_motions_do_not_depend_on_the_origin(far_pile: Run, tmp_path: Path) -> None:
    near = Run(write_run(tmp_path / "near", Motion(scale=100 / 3)))
    found, wanted = motion.scene(far_pile), motion.scene(near)
    assert found["origin"] == list(SURVEY) and found["size"] == pytest.approx(wanted["size"])
    place = [np.frombuffer(base64.b64decode(s["place"]), "<f4") for s in (found, wanted)]
    assert place[0] == pytest.approx(place[1], abs=1e-6)
    for name in ("x", "y"):
        ends = [np.frombuffer(base64.b64decode(s["water"][name]), "<f4") for s in (found, wanted)]
        assert ends[0] == pytest.approx(ends[1], abs=1e-6)
    assert found["water"]["low"] == pytest.approx(wanted["water"]["low"], abs=1e-9)


def test_places_in_a_survey_are_told_to_the_centimetre(far_pile: Run) -> None:
    said = run_words.drops(far_pile, units.of_run(far_pile))[0]
    page = run_page.page(far_pile)
    columns = re.findall(r"<td>(3542\d\d[\d.]*), (5621[\d.]*), ([\d.-]*)</td>", page)
    assert "354206" in {x.split(".")[0] for x, _, _ in columns}  # of a block at the end
    assert {len(v.split(".")[1]) for row in columns for v in row} == {2}  # alike in a column
    assert "x\u00a0=\u00a0354205, y\u00a0=\u00a05621081.67, z\u00a0=\u00a0-6.67 m" in said


def test_the_surface_is_that_of_the_fields(loose_pile: Run) -> None:
    water = motion.water(loose_pile)
    assert water is not None
    height = np.frombuffer(base64.b64decode(water["height"]), np.uint8).reshape(-1, 20, 60)
    found = water["low"] + water["span"] / 255 * height
    assert found[0].mean() == pytest.approx(0.15, abs=1e-4)
    assert found[-1].mean() == pytest.approx(0.1612, abs=1e-4)


def test_numbers_that_would_meet_are_left_out() -> None:
    """Of two blocks side by side the one has its number of which more is seen."""
    block = np.zeros((100, 200), int)
    block[:, :60], block[:, 60:70], block[40:60, 150:] = 1, 2, 3
    seen = views.Seen(block, block, block, np.zeros(2), 1.0)
    assert [re.sub("<.*?>", "", text) for text in views._numbers(seen)] == ["1", "3"]
    block[:, 30:60] = 0
    assert [re.sub("<.*?>", "", text) for text in views._numbers(seen)] == ["1", "2", "3"]


def test_a_column_has_the_same_decimals() -> None:
    column = SITE.number.column
    assert column([0.5, 12.34, np.nan, 9]) == ["0.5", "12.3", "–", "9.0"]
    assert column([585.0, 4.9]) == ["585", "5"] and column([]) == [] and column([0.0]) == ["0.00"]
    assert SITE.place.column([1.9, -1e-9, np.nan]) == ["1.90", "0.00", "–"]


def test_a_peak_survives_in_a_chart() -> None:
    y = np.zeros(10_000)
    y[4321] = 7.0
    x, kept = charts._thinned(Curve(np.arange(10_000.0), y))
    assert len(x) < 700 and kept.max() == 7.0 and x[kept.argmax()] == 4321


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(0.0, 10.0, [0, 2, 4, 6, 8, 10]), (-0.1, 0.31, [-0.1, 0, 0.1, 0.2, 0.3]), (3e-9, 5e-9, None)],
)
def test_ticks_are_round(low: float, high: float, wanted: list[float] | None) -> None:
    found = charts.ticks(low, high)
    assert 2 <= len(found) <= 7 and low - 1e-12 <= found[0] and found[-1] <= high + 1e-12
    if wanted is not None:
        assert found == pytest.approx(wanted, abs=1e-12)


def test_views_show_what_stands_in_front() -> None:
    """Two cubes, the second behind the first in y and half as high up in z."""
    cube, low, high = shapes.cube(0.02), np.zeros(3), np.array([0.1, 0.1, 0.1])
    places = ((0.05, 0.02, 0.01), (0.05, 0.06, 0.02))
    bodies = {k: Placed(cube, np.array(p), UPRIGHT) for k, p in enumerate(places)}
    bodies = views.surfaces_of(bodies)
    front = views.look(bodies, "front", low, high, 0.001).block
    assert (front == 1).sum() == 400 and (front == 2).sum() == 200
    assert (front[:20, 40:60] == 1).all() and (front[20:30, 40:60] == 2).all()
    side = views.look(bodies, "side", low, high, 0.001)
    assert (side.block[:, 10:30] == 1).sum() == 400 and (side.block[:, 50:70] == 2).sum() == 400
    top = views.look(bodies, "top", low, high, 0.001)
    assert (top.block == 1).sum() == (top.block == 2).sum() == 400
    assert top.depth[60, 50] == pytest.approx(0.03)


def test_lines_do_not_hide_small_blocks() -> None:
    """Cubes of 20 pixels have dark edges; the same of 8 pixels show their colour only."""
    cube, low, high = shapes.cube(0.02), np.zeros(3), np.array([0.1, 0.1, 0.1])
    bodies = views.surfaces_of({0: Placed(cube, np.array([0.05, 0.05, 0.05]), UPRIGHT)})
    for step, lines in ((0.001, 76), (0.0025, 0)):
        picture = views.paint(views.look(bodies, "top", low, high, step), {1: "#ff8000"})
        red = np.asarray(picture)[..., 0][np.asarray(picture)[..., 3] > 0]
        assert (red < 100).sum() == lines


def test_a_bed_is_an_outline_from_the_side() -> None:
    """A ramp from 0 to 0.1 m along x, a quarter of a square higher: of the squares of the front
    view those on and below the diagonal; all of the side view."""
    x, y = np.meshgrid([0.0, 0.1], [0.0, 0.1])
    p = np.stack([x, y, x + 0.00025], axis=-1).reshape(-1, 3)
    ramp = p[np.array([[0, 1, 3], [0, 3, 2]])]
    low, high = np.zeros(3), np.full(3, 0.1)
    shares = [
        (np.asarray(views.ground(ramp, view, low, high, 0.001))[..., 3] > 0).mean()
        for view in ("front", "side", "top")
    ]
    assert shares == pytest.approx([0.505, 1.0, 1.0])


def test_numbers_of_each_block(make_run) -> None:
    """One block, let go at 0 and at rest after 0.8 s, touching from half way on."""
    where = [(np.array([0.06, 0.05, 0.1]), UPRIGHT)]
    run = make_run(Motion(places=where, t_end=2.0, field_step=2.0))
    (found,) = block_numbers.of_blocks(run)
    speed = np.linalg.norm(run.bodies.velocity[:, 3], axis=1)
    assert (found.block, found.released) == (4, 0.0)
    assert found.fall_time == pytest.approx(0.4, abs=0.05) and found.fastest == speed.max()
    way = run.bodies.position[:, 3, :2] - run.bodies.position[0, 3, :2]
    assert found.drift == pytest.approx(np.linalg.norm(way[run.bodies.contacts[:, 3] > 0][0]))
    assert found.at_rest == pytest.approx(0.8, abs=0.05)
    assert found.impact_speed == pytest.approx(speed.max())
    force = np.linalg.norm(run.bodies.contact_force[:, 3], axis=1).max()
    assert found.contact_force == pytest.approx(force)
    assert found.weight == pytest.approx(56e-6 * 2300 * 9.81)
    for name, n in (("max", 2), ("peak", 3)):
        size = n * np.linalg.norm(run.bodies.contact_force, axis=2)
        change(run.folder, f"bodies/contact_force_{name}", data=size)
    change(run.folder, "bodies/release_time", data=np.array([0.0, 0, 0, 1.5]))
    came = {"entry_time": np.zeros(4), "status": np.full(4, 2.0), "raised": np.zeros(4)}
    for name, values in came.items():
        change(run.folder, f"bodies/{name}", data=values)
    (lowered,) = block_numbers.of_blocks(Run(run.folder))  # it touched before it was let go
    assert (lowered.contact_force, lowered.peak_force) == pytest.approx((2 * force, 3 * force))
    assert found.turned == pytest.approx(0.0, abs=1e-6)


def test_what_differs_from_the_defaults(make_run) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0))
    assert run_words.differing(run) == []
    more = "&contact friction = 0.25 restitution = 0.3 /\n"
    run = reword(run.folder, lambda text: text + more)
    assert run_words.differing(run) == [("contact.friction", "0.25", "0.6")]


def test_blocks_still_to_come_have_no_curves(make_run) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0))  # too late for the third
    text = run_page.page(run)
    assert "After 2 s four blocks are still to come and two blocks were let go" in text
    assert 'd="M"' not in text and 'd=""' not in text
    assert [k.block for k in block_numbers.of_blocks(run)] == [4, 5]


def test_the_lead_counts_blocks_that_move(make_run) -> None:
    """Three blocks that come to rest after 0.8, 1.8 and 2.8 s, looked at before and after."""
    places = [(np.array([x, 0.05, 0.12]), UPRIGHT) for x in (0.06, 0.15, 0.24)]
    motion = Motion(places=places, field_step=2.4, cells=(12, 4, 8))
    words = {2.4: "After 2.4 s one of three free blocks still moves;",
             4.8: "After 2.78 s three free blocks lie still;"}  # fmt: skip
    for end, said in words.items():
        text = run_page.page(make_run(replace(motion, t_end=end)))
        lead = text.split('class="lead">')[1].split("</p>")[0].replace("\u00a0", " ")
        assert lead.startswith(said) and "above the floor under it" in lead


def test_a_dry_run_without_fields_has_a_page(make_run) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0))
    (run.folder / "fields.vtkhdf").unlink()
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/fluid_force"][:] = np.nan
        h5["series/liquid_volume_drift"][:] = np.nan
    run = reword(run.folder, lambda text: text.replace("&run", "&run physics = 'dry'"))
    text = run_page.page(run)
    assert (
        "and is dry" in text
        and '"water":null' in text
        and not re.search(r"\bnan", text.lower().split("<style")[1].split("</style>")[1])
    )


@pytest.mark.parametrize("width", [360, 700, 1100])
def test_no_text_leaves_its_tile(browser: Browser, report: Path, width: int) -> None:
    browser.open(report, width)
    assert browser.run("document.querySelectorAll('.facts div').length") == 9
    assert browser.out_of(".facts div") == []


def test_the_page_plays(browser: Browser, report: Path) -> None:
    browser.open(report)
    assert browser.run("document.title") == TITLE
    assert browser.run("document.querySelector('h1').textContent") == TITLE
    assert browser.run("document.querySelectorAll('h1 *').length") == 0
    start = browser.run("runPlayer.stage.time")
    browser.run("document.querySelector('.play').click()")
    until(lambda: browser.run(f"runPlayer.stage.time > {start} + 0.1"))
    browser.run("document.querySelector('.play').click()")
    at = browser.run("runPlayer.stage.time")
    browser.settle()
    assert browser.run("runPlayer.stage.time") == at
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith("data:")] == [report.as_uri()]


def test_the_slider_moves_the_blocks(browser: Browser, report: Path, loose_pile: Run) -> None:
    browser.open(report)
    seen = []
    for moment in (0.5, 7.0):
        browser.choose("slider", moment, "input")
        place = browser.run("runPlayer.stage.pose(3).place")
        row = loose_pile.bodies.row(moment)
        assert place == pytest.approx(loose_pile.bodies.position[row, 3].tolist(), abs=1e-3)
        seen.append(browser.picture())
    assert seen[0] != seen[1]
    assert browser.run("document.querySelector('.clock').textContent") == "7.00 s"
    marks = browser.run(
        "[...document.querySelectorAll('.now')].every(m => !m.hasAttribute('hidden'))"
    )
    assert marks


def test_keys_and_mouse_turn_and_zoom(browser: Browser, report: Path) -> None:
    browser.open(report)
    browser.run("document.querySelector('.stage').focus()")
    yaw, far = browser.run("[runPlayer.stage.yaw, runPlayer.stage.fit]")
    browser.key("ArrowRight")
    browser.key("+")
    assert browser.run("runPlayer.stage.yaw") != yaw
    assert browser.run("runPlayer.stage.distance") < 0.95 * far
    yaw = browser.run("runPlayer.stage.yaw")
    x, y = browser.corner()
    browser.drag((x + 100, y + 100), (x + 180, y + 100))
    assert browser.run("runPlayer.stage.yaw") == pytest.approx(yaw - 0.5)
    browser.choose("follow", 5)
    assert browser.run("runPlayer.stage.followed") == 5
    for colouring in ("speed", "contacts", "block"):
        browser.choose("colouring", colouring)
    browser.run("document.querySelector('.stage').focus()")
    browser.key(" ")
    assert browser.run("runPlayer.playing") is True


def test_paper_has_pictures_and_no_buttons(browser: Browser, report: Path) -> None:
    browser.open(report)
    browser.look(794, 1123, media="print")
    hidden = "getComputedStyle(document.querySelector('{}')).display === 'none'"
    assert browser.run(hidden.format(".player")) and not browser.run(hidden.format(".views"))
    assert browser.run("getComputedStyle(document.documentElement).filter") == "none"  # colours
    assert browser.call("Page.printToPDF", preferCSSPageSize=True)["data"]


DROPS = tomllib.loads(Path(__file__).with_name("drops.toml").read_text())


@pytest.mark.parametrize("words", DROPS)
def test_drops_in_words(words: str) -> None:
    how = DROPS[words]
    groups = [{"shape": "tetrapod"} | drop for drop in how["groups"]]
    shape = {"name": "tetrapod", "kind": how.get("kind", "tetrapod")}
    run: Any = SimpleNamespace(parameters={"drop": groups, "shape": [shape]})
    found = run_words.drops(run, LABORATORY if how.get("small") else SITE)
    assert "; ".join(found).replace("\u00a0", " ") == words


def test_the_whole_case(make_run) -> None:
    run: Run = make_run(Motion(t_end=8.0, field_step=8.0, cells=(12, 4, 8)))
    found = [text.replace("\u00a0", " ") for text in run_words.case(run, LABORATORY)]
    assert found[0] == (
        "Three fixed blocks. 6 hexapods, one every 1 s, dropped at x = 150, y = 50, z = 160 mm."
    )
    assert "measures 60 x 60 x 60 mm, has a volume of 56 cm³ and a mass of 0.129 kg" in found[1]
    assert found[2].startswith(
        "The tank measures 300 x 100 x 200 mm, its water stands 150 mm above"
    )
    late = np.array(run.bodies.entry_time)
    late[-1] = 6.5
    object.__setattr__(run.bodies, "entry_time", late)
    words = run_words.blocks(run, LABORATORY)
    assert words.endswith("Blocks waited for room: the last came at t = 6.5 s.")


def test_stones_of_a_family_are_one_sentence() -> None:
    """Not one for each of them; a block of its own keeps its sentence."""
    stones = {f"rock-{k}": shapes.cube(0.8 + 0.2 * k, density=2500.0) for k in (1, 2)}
    door = {"door": shapes.cube(3.0)}
    groups = [{"name": "rock", "kind": "rock"}, {"name": "door", "kind": "cube"}]
    bodies = SimpleNamespace(shape=["door", "rock-1", "rock-2", "rock-1"])
    known = {"shapes": stones | door, "parameters": {"shape": groups}}
    run: Any = SimpleNamespace(bodies=bodies, **known)
    found = [text.replace("\u00a0", " ") for text in run_words.shapes(run, SITE)]
    assert found[0] == (
        "2 stones of 'rock' have masses of 2.5 to 4.32 t and are 1 to 1.2 m long (2500 kg/m³)."
    )
    assert len(found) == 2 and found[1].startswith("A block 'door' (cube) measures 3 x 3 x 3 m")
