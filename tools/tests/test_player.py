"""The player of a page: flat views to measure in, blocks that nothing hides, no flicker, numbers,
paths, paces, and the speed of the water."""

import base64
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from browser import Browser
from micstools.pages import motion, parts, run_page
from micstools.piles.options import Options
from micstools.reading.reader import Run
from synthetic import UPRIGHT, Motion, with_bed, write_run

FLAT = ("front", "side", "top")


def save(run: Run, path: Path, north: float | None = None) -> Path:
    """The page of a run in a file."""
    path.write_text(run_page.page(run, Options(north=north)))
    return path


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_a_bed_has_sides_down_to_the_floor(tmp_path: Path) -> None:
    """A slope that rises to 0.1 m at the far end of the tank in x: of its sides the front and the
    back are triangles, the far one is a rectangle."""
    folder = write_run(tmp_path / "run", Motion(t_end=0.1))
    run = with_bed(folder, lambda x, y: np.clip(x, 0, None) / 3)
    points, triangles = motion.bed(run)
    corners = points[triangles[len(run.bed[1]) :]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = {
        (d, side): np.abs(normal[normal[:, d] * side > 1e-9][:, d]).sum()
        for d in (0, 1)
        for side in (-1, 1)
    }
    assert area[1, -1] == pytest.approx(0.015, rel=1e-3)
    assert area[1, 1] == pytest.approx(0.015, rel=1e-3)
    assert area[0, 1] == pytest.approx(0.01, rel=1e-3) and area[0, -1] < 1e-6
    inside = (corners >= -1e-6) & (corners <= [0.3 + 1e-6, 0.1 + 1e-6, 0.1 + 1e-6])
    assert inside.all()


def test_the_speed_of_the_water_is_that_of_the_fields(loose_pile: Run) -> None:
    water = motion.water(loose_pile)
    assert water is not None
    found, fields = water["speed"], loose_pile.fields_at(2.0)
    frame = list(unpacked(found["times"], "<f4")).index(2.0)
    speed = np.linalg.norm(fields.velocity, axis=3)
    speed[(fields.liquid <= 0.5) | (fields.solid >= 0.5)] = 0.0
    for name, wanted in (("front", speed.max(axis=1)), ("side", speed.max(axis=2))):
        part = found[name]
        share = unpacked(part["values"], "u1").reshape(-1, part["ny"], part["nx"])[frame] / 255
        assert share.shape == wanted.shape
        got = found["fastest"] * share**2
        assert got == pytest.approx(wanted.clip(0, found["fastest"]), abs=0.01 * found["fastest"])
    plan = found["plan"]
    assert (plan["nx"], plan["ny"]) == (60, 20)
    assert motion.water(Run(loose_pile.folder))["speed"]["fastest"] > 0.05


def test_long_fixed_bodies_are_walls(make_run) -> None:
    run = make_run(Motion(t_end=0.1))
    assert motion.walls_of(run) == set()
    shape = run.shapes["hexapod"]
    long = replace(shape, points=5 * shape.points)
    run.shapes["quay"] = long
    run.bodies.shape[1] = "quay"
    assert motion.walls_of(run) == {1}
    assert [body["wall"] for body in motion.scene(run)["bodies"][:3]] == [False, True, False]


def test_contacts_that_come_and_go_stay() -> None:
    time = np.arange(0, 1, 0.01)
    contacts = (np.arange(100)[:, None] % 4 == 0).astype(int)
    assert (motion._steady(time, contacts, np.arange(10, 90, 3)) == 1).all()
    contacts[50:] = 0
    assert motion._steady(time, contacts, np.array([40, 60, 70]))[:, 0].tolist() == [1, 0, 0]


def test_north_is_given_or_said_to_be_y(make_run, capsys) -> None:
    run = make_run(Motion(t_end=0.1))
    assert parts.NORTH_IS_Y in run_page.page(run)
    page = run_page.page(run, Options(north=30.0))
    assert parts.NORTH_IS_Y not in page and '"north":30.0' in page


@pytest.fixture(scope="module")
def page(loose_pile: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(loose_pile, tmp_path_factory.mktemp("player") / "page.html", north=90.0)


def view(browser: Browser, name: str) -> None:
    browser.run(f"document.querySelector('[data-view={name}]').click()")
    browser.settle()


def at(browser: Browser, point: list[float]) -> tuple[float, float]:
    """Where a point is seen, in pixels of the picture from its upper left."""
    found = browser.run(
        f"(p => [p.x, p.y])(runPlayer.stage.overlay.at({[float(v) for v in point]}))"
    )
    return found[0], found[1]


def pixels(browser: Browser, *places: tuple[float, float]) -> np.ndarray:
    """The colours (n, 3) of the window at places of the picture."""
    left, top = browser.corner()
    with Image.open(io.BytesIO(browser.picture())) as picture:
        window = np.asarray(picture.convert("RGB")).astype(int)
    return np.array([window[round(top + y), round(left + x)] for x, y in places])


def test_flat_views_are_to_scale(browser: Browser, page: Path) -> None:
    browser.open(page)
    one, (x, y, z) = np.array([0.1, 0.03, 0.05]), np.eye(3)
    for name, across, up, behind in (("front", x, z, y), ("side", y, z, x), ("top", x, y, z)):
        view(browser, name)
        points = one, one + 0.03 * across + 0.04 * up, one + 0.05 * behind
        p, q, r = (at(browser, list(point)) for point in points)
        assert r == pytest.approx(p, abs=1e-3)  # no perspective
        scale = browser.run("(b => b.pixels / b.length)(runPlayer.stage.overlay.bar)")
        assert q[0] - p[0] == pytest.approx(0.03 * scale, rel=1e-4)
        assert p[1] - q[1] == pytest.approx(0.04 * scale, rel=1e-4)


def test_a_length_is_measured(browser: Browser, page: Path) -> None:
    browser.open(page)
    view(browser, "top")
    box = browser.corner()
    p, q = (
        [place + edge for place, edge in zip(at(browser, point), box, strict=True)]
        for point in ([0.05, 0.02, 0.0], [0.20, 0.08, 0.0])
    )
    yaw = browser.run("runPlayer.stage.yaw")
    browser.drag(p, q)
    told = browser.run("runPlayer.stage.overlay.told")
    length = float(told.split(" mm")[0])
    assert length == pytest.approx(161.6, abs=1.0) and "Δx" in told and "Δy" in told
    assert browser.run("runPlayer.stage.yaw") == yaw
    view(browser, "corner")
    assert browser.run("runPlayer.stage.measured") is None
    browser.mouse("mouseMoved", *p)
    browser.settle()


def test_places_are_those_of_a_survey(browser: Browser, tmp_path: Path) -> None:
    """What is pointed at is told to the centimetre, where single precision knows half a metre."""
    corner = np.array([354200.0, 5621080.0, -12.0])
    folder = write_run(tmp_path / "far", Motion(t_end=0.1, scale=100 / 3, origin=tuple(corner)))
    browser.open(save(Run(folder), tmp_path / "far.html"))
    view(browser, "top")
    box = browser.corner()
    seen = [p + edge for p, edge in zip(at(browser, [5.0, 2.0, 0.0]), box, strict=True)]
    browser.mouse("mouseMoved", *seen)
    browser.settle()
    x, y = (float(v.split()[1]) for v in browser.run("runPlayer.stage.overlay.told").split(","))
    pixel = browser.run("2 * runPlayer.stage.half / runPlayer.stage.canvas.clientHeight")
    assert abs(x - 354205) < pixel and abs(y - 5621082) < pixel


def test_lengths_have_the_unit_of_the_page(browser: Browser, page: Path) -> None:
    """What is below a metre is told in m beside blocks of metres, as all else on the page."""
    browser.open(page)
    assert browser.run("inWords(0.4, runPlayer.stage.scene.unit)") == "400 mm"
    assert browser.run("inWords(0.4, { name: 'm', size: 1 })") == "0.4 m"


def in_red_and_green(browser: Browser, point: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """The colour at a point while the fourth body is red, and while it is green."""
    seen = []
    for colour in ("#ff0000", "#00ff00"):
        browser.run(f"runPlayer.stage.scene.bodies[3].colour = '{colour}'")
        browser.run("runPlayer.stage.draw()")
        browser.settle()
        seen.append(pixels(browser, at(browser, point))[0])
    return seen[0], seen[1]


def lying(folder: Path, *place: float) -> Path:
    """A run of one block that lies at a place after 2 s."""
    places = [(np.array(place), UPRIGHT)]
    return write_run(folder, Motion(places=places, t_end=2.0, field_step=2.0, cells=(12, 4, 8)))


def bare(browser: Browser) -> None:
    """The end of a run without water and numbers."""
    browser.run("runPlayer.show(2)")
    browser.choose("wet", "none")
    browser.run("document.querySelector('.numbers').click()")


def test_no_bed_hides_a_block(browser: Browser, tmp_path: Path) -> None:
    """The block lies in a hole of the bed, and a roof of the bed is over it."""
    folder = lying(tmp_path / "run", 0.15, 0.05, 0.05)
    deep = with_bed(folder, lambda x, y: 0.09 + 0.02 * np.sin(50 * x))
    browser.open(save(deep, tmp_path / "page.html"))
    bare(browser)
    for name in ("corner", *FLAT):
        view(browser, name)
        red, green = in_red_and_green(browser, [0.15, 0.05, 0.05])
        assert red[0] > red[1] + 40 and green[1] > green[0] + 40, (name, red, green)


def test_no_wall_hides_a_block(browser: Browser, tmp_path: Path) -> None:
    """A fixed body before a block hides it, unless it is a wall."""
    run = Run(lying(tmp_path / "run", 0.09, 0.08, 0.0288675))
    browser.open(save(run, tmp_path / "page.html"))
    bare(browser)
    view(browser, "front")
    for wall in (False, True):
        browser.run(f"runPlayer.stage.scene.bodies[0].wall = {str(wall).lower()}")
        red, green = in_red_and_green(browser, [0.093, 0.08, 0.033])
        assert bool(np.abs(red - green).max() > 60) is wall


def test_a_moment_always_looks_the_same(browser: Browser, page: Path) -> None:
    """Edges of blocks and tank neither come and go nor move."""
    browser.open(page)
    browser.run("runPlayer.show(3.3)")
    for name in ("corner", *FLAT):
        view(browser, name)
        seen = set()
        for _ in range(4):
            browser.run("runPlayer.stage.draw()")
            browser.settle()
            seen.add(browser.picture())
        assert len(seen) == 1, name


def test_a_floor_under_a_bed_does_not_flicker(browser: Browser, tmp_path: Path) -> None:
    """A bed at the height of the floor is drawn whole from wherever one looks."""
    folder = write_run(tmp_path / "run", Motion(t_end=0.1))
    flat = with_bed(folder, lambda x, y: 0 * x)
    browser.open(save(flat, tmp_path / "page.html"))
    browser.choose("wet", "none")
    for yaw in (-0.5, -0.493, -0.31, 0.2, 0.7):
        browser.run(f"runPlayer.stage.yaw = {yaw}; runPlayer.stage.pitch = 0.4")
        browser.run("runPlayer.stage.scene.bodies.forEach(body => { body.release = null; })")
        browser.run("runPlayer.stage.draw()")
        browser.settle()
        places = [at(browser, [x, 0.01, 0.0]) for x in np.linspace(0.02, 0.28, 40)]
        colours = pixels(browser, *places)
        assert np.ptp(colours, axis=0).max() <= 2, yaw


def test_what_plays_on_after_a_load_keeps_its_pace(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("for (let k = 0; k < 9; k++) { runPlayer.play(); runPlayer.pause(); }")
    now = "runPlayer.stage.time - performance.now() / 1000 * +runPlayer.pace.value"
    wait = "new Promise(done => setTimeout(done, 600))"
    gained = browser.run(f"runPlayer.play(); start = {now}; {wait}.then(() => {now} - start)")
    assert gained < 0.3 * browser.run("+runPlayer.pace.value")


def test_a_block_crosses_a_periodic_side(browser: Browser, page: Path) -> None:
    """Between two frames it does not fly back through the tank."""
    browser.open(page)
    found = browser.run(
        "(s => { s.scene.period = [0.3, 0, 0]; s.place[3 * 3] = 0.29;"
        "s.place[3 * s.scene.bodies.length + 3 * 3] = 0.02;"
        "return [0.25, 0.5, 0.75].map(share => s.pose(3, [0, 1, share]).place[0]); })"
        "(runPlayer.stage)"
    )
    assert found == pytest.approx([0.2975, 0.005, 0.0125], abs=1e-6)


def test_numbers_stand_on_their_blocks(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("runPlayer.show(8)")
    for name in ("corner", *FLAT):
        view(browser, name)
        labels = browser.run("runPlayer.stage.overlay.labels")
        assert len(labels) >= 6
        assert len({number for number, *_ in labels}) == len(labels)
        for number, x, y, _ in labels:
            on = browser.run(
                "((s, x, y) => s.seen.at(Math.floor(x / s.overlay.wide * s.seen.w),"
                " Math.floor(y / s.overlay.high * s.seen.h)))"
                f"(runPlayer.stage, {x}, {y})"
            )
            assert on == number
    browser.run("document.querySelector('.numbers').click()")
    browser.settle()
    assert browser.run("runPlayer.stage.seen") is None


INK = """(() => {
  const c = document.querySelector('.over'), copy = document.createElement('canvas');
  [copy.width, copy.height] = [c.width, c.height];
  const pen = copy.getContext('2d', { willReadFrequently: true });
  pen.drawImage(c, 0, 0);
  return pen.getImageData(0, 0, c.width, c.height).data.filter((v, i) => i % 4 == 3 && v).length;
})()"""


def test_a_path_is_drawn(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("runPlayer.show(6)")
    browser.choose("follow", 5)
    browser.run("document.querySelector('.numbers').click()")
    browser.settle()
    bare = browser.run(INK)
    browser.run("document.querySelector('.paths').click()")
    browser.settle()
    one = browser.run(INK)
    browser.choose("follow", "")
    assert one > bare + 50 and browser.run(INK) > bare + 50


def test_the_whole_run_passes_in_ten_seconds(browser: Browser, page: Path, tmp_path: Path) -> None:
    paces = "[...document.querySelector('.pace').options].map(o => +o.value)"
    browser.open(page)
    assert browser.run(paces) == [0.1, 0.25, 0.5, 1]
    assert browser.run("document.querySelector('.pace').value") == "0.5"
    slow = Motion(t_end=110.0, history_step=0.5, field_step=110.0)
    browser.open(save(Run(write_run(tmp_path / "run", slow)), tmp_path / "page.html"))
    assert browser.run(paces) == pytest.approx([0.1, 0.25, 0.5, 1, 2, 5, 10, 11])
    assert "all in 10 s" in browser.run("document.querySelector('.pace').textContent")


def test_the_water_is_coloured_by_its_speed(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("runPlayer.show(2.1)")
    seen = {}
    for water in ("none", "clear", "speed"):
        browser.choose("wet", water)
        for name in FLAT:
            view(browser, name)
            seen[water, name] = pixels(browser, at(browser, [0.05, 0.05, 0.14]))[0]
        legend = browser.run("document.querySelector('.legend').textContent")
        assert ("water:" in legend and "m/s" in legend) is (water == "speed")
    for name in FLAT:
        assert np.abs(seen["none", name] - seen["clear", name]).max() > 10
        assert np.abs(seen["speed", name] - seen["clear", name]).max() > 10, name


def test_north_is_where_it_was_said_to_be(browser: Browser, page: Path) -> None:
    browser.open(page)
    assert browser.run("runPlayer.stage.overlay.north") == pytest.approx([1, 0, 0], abs=1e-12)


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("name", ["corner", *FLAT])
def test_it_fits_a_phone(browser: Browser, page: Path, name: str, dark: bool) -> None:
    browser.open(page, 360, 740, dark)
    view(browser, name)
    assert browser.run("document.documentElement.scrollWidth") <= 360
    light = browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert light is not dark
    assert browser.run("runPlayer.stage.overlay.canvas.width") == browser.run(
        "runPlayer.stage.canvas.width"
    )
