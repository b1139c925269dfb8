"""Numbers of a pile, porosity, slopes and attitudes on arrangements that are known exactly."""

import json
import re
from dataclasses import replace

import h5py
import numpy as np
import pytest

from calls import mics_tools
from micstools.pages import run_page
from micstools.piles import layer, maps, pile_form, pile_numbers, placing
from micstools.piles.handover import Handover
from micstools.piles.maps import height_map
from micstools.piles.options import Options
from micstools.reading import block_numbers
from micstools.reading.overlap import Placed, find_contacts, present_bodies, sphere_gap
from micstools.reading.reader import BadRun, Run
from micstools.shapes import shape as shapes
from micstools.shapes.geometry import quaternion_from_axis
from synthetic import UPRIGHT, Motion, change, reword, with_bed

EDGE = 0.02
WHOLE, SHORT = Motion(history_step=0.05), Motion(t_end=3.0, field_step=3.0, cells=(12, 4, 8))


def cubes(*places: tuple[float, float, float], motion: Motion = WHOLE) -> Motion:
    """Cubes that come to lie in some places; the fixed blocks are cubes, too."""
    ends = [(np.array(place), UPRIGHT) for place in places]
    return replace(motion, shape=shapes.cube(EDGE), places=ends)


def test_stacked_cubes(make_run) -> None:
    """Two towers of cubes on the floor, three and one high."""
    half = EDGE / 2
    towers = [(0.03, half), (0.03, 3 * half), (0.03, 5 * half), (0.27, half)]
    run = make_run(cubes(*((x, 0.03, z) for x, z in towers)))
    found = pile_numbers.numbers(run, step=0.001)
    assert found.blocks == 7
    assert found.on_floor == 2
    assert found.top == pytest.approx(max(0.06, run.points(0, -1)[:, 2].max()))
    assert found.coordination == pytest.approx(2 * 2 / 7)
    assert found.centre[2] == pytest.approx((0.10 + 3 * run.bodies.position[0, 0, 2]) / 7)
    assert found.spread[0] == pytest.approx(np.std([0.03] * 3 + [0.27, 0.09, 0.15, 0.21]))
    assert 3.5 < found.time_to_rest < 4.0  # the last is dropped at 3 s and takes 0.8 s
    area = np.linspace(0, 0.8, 17)
    assert 0 < found.impact_speed < 1.5 * 0.2 / area[-1]
    assert found.attitude_randomness == pytest.approx(0.0, abs=1e-9)
    forces = np.linalg.norm(run.bodies.contact_force[:, 3:], axis=2)
    assert found.contact_force == found.peak_force == pytest.approx(forces.max())
    low, high = np.array(found.box[:3]), np.array(found.box[3:])
    assert low == pytest.approx((0.02, 0.02, 0.0))
    assert found.porosity == pytest.approx(1 - 7 * EDGE**3 / np.prod(high - low))


def test_a_door_is_no_part_of_the_pile(make_run) -> None:
    """One of the fixed cubes is moved by a table and hangs high: neither pile nor ground."""
    run = make_run(cubes((0.2, 0.03, EDGE / 2)))
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/position"][:, 1] = (0.2, 0.03, 0.15)
    second = re.compile(r"(?s)^(.*?fixed.*?fixed = \.true\.)")
    run = reword(run.folder, lambda text: second.sub(r"\1 motion = 'd.csv'", text))
    found = pile_numbers.numbers(run, step=0.001)
    assert (found.blocks, found.height) == (3, pytest.approx(run.points(0, -1)[:, 2].max()))
    units, ground = layer.parted(run)
    assert (sorted(units), ground) == ([0, 2, 3], {})
    assert "0.0552\u00a0kg in all" in run_page.page(run)  # of three cubes


def test_blocks_on_a_bed_lie_on_the_floor(make_run) -> None:
    """A tower of two cubes on a bed 1 cm high, and a cube that hangs above it."""
    run = make_run(cubes((0.03, 0.03, 0.02), (0.03, 0.03, 0.04), (0.27, 0.03, 0.021)))
    assert pile_numbers.numbers(run, step=0.001).on_floor == 0
    run = with_bed(run.folder, lambda x, y: 0 * x + 0.01)
    assert pile_numbers.numbers(run, step=0.001).on_floor == 1


def test_slopes_rise_from_the_bed(make_run) -> None:
    """Of two cubes on one another and one beside them, 0.16 m above the floor as on it."""
    found = []
    for z in (0.01, 0.17):
        run = make_run(cubes((0.05, 0.05, z), (0.07, 0.05, z), (0.07, 0.05, z + 0.02)))
        change(run.folder, "bodies/release_time", data=np.array([1e9, 1e9, 1e9, 0.0, 1.0, 2.0]))
        run = with_bed(run.folder, lambda x, y, z=z: 0 * x + z - 0.01)
        found.append(pile_numbers.numbers(run, step=0.001).slopes)
    assert found[0] == pytest.approx((45, 90, 90, 90), abs=3) and found[1] == found[0]


def test_layer_and_porosity_on_a_slope(make_run) -> None:
    """Cubes on a slope of 1:5 along x: the height of each over the bed, and a box less the bed in
    it."""
    run = make_run(cubes(*((x, 0.03, 0.0101 + 0.2 * (x + 0.01)) for x in (0.03, 0.25))))
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/position"][:, :3, 0] = 0.14  # the fixed ones, all at one place above the bed
        h5["bodies/position"][:, :3, 2] = 0.2 * 0.14 + 0.05
    run = with_bed(run.folder, lambda x, y: 0.2 * x)
    found = pile_numbers.numbers(run, step=0.001)
    lowest = run.points(0, -1)[:, 2].max() - 0.2 * 0.14
    assert found.height == pytest.approx(lowest, abs=0.005)
    assert 0 < found.porosity < 1
    volume = maps.bed_volume(run, np.zeros(3), np.array([0.3, 0.1, 0.2]), 0.001)
    assert volume == pytest.approx(0.5 * 0.3 * 0.06 * 0.1, rel=1e-3)
    box = (np.array([0.24, 0.02, 0.0]), np.array([0.26, 0.04, 0.1]))
    inside = pile_numbers.numbers(run, step=0.001, box=box).porosity
    assert inside == pytest.approx(1 - EDGE**3 / (EDGE**2 * (0.1 - 0.2 * 0.25)), rel=1e-3)
    bare = Run(run.folder)
    bare.__dict__["bed"] = (np.empty((0, 3)), np.empty((0, 3), int))
    flat = pile_numbers.numbers(bare, step=0.001)
    assert flat.layer_thickness - found.layer_thickness == pytest.approx(0.028, abs=2e-3)


def test_height_map_of_a_cube_and_a_tilted_one() -> None:
    cube = shapes.cube(EDGE)
    low, high = np.zeros(3), np.array([0.1, 0.1, 0.1])
    upright = Placed(cube, np.array([0.03, 0.05, 0.01]), UPRIGHT)
    turned = np.array([np.cos(np.pi / 8), 0.0, np.sin(np.pi / 8), 0.0])  # 45 degrees about y
    edge_up = Placed(cube, np.array([0.07, 0.05, 0.03]), turned)
    one = maps.height_map([upright], low, high, 0.001)
    assert np.isfinite(one).sum() == 400 and np.nanmax(one) == np.nanmin(one) == EDGE
    both = maps.height_map([upright, edge_up], low, high, 0.001)
    x = (np.arange(100) + 0.5) * 0.001
    roof = 0.03 + EDGE / np.sqrt(2) - np.abs(x - 0.07)
    seen = np.isfinite(both[50]) & (x > 0.05)
    assert seen.sum() == np.sum(np.abs(x - 0.07) < EDGE / np.sqrt(2))
    assert both[50, seen] == pytest.approx(roof[seen])


def test_terminal_speed() -> None:
    """Of v = 2 tanh(t/0.5), once it has settled; none of its first half second."""
    time = np.linspace(0, 10, 201)
    height = 20 - np.log(np.cosh(time / 0.5))
    assert block_numbers.terminal_speed(time, height, 1.0) == pytest.approx(2.0, rel=1e-3)
    assert np.isnan(block_numbers.terminal_speed(time[:11], height[:11], 0.1))
    assert np.isnan(block_numbers.terminal_speed(time, height, 20.0))


def test_the_command_writes_outline_and_height_map(make_run, capsys) -> None:
    """One cube beside the three fixed ones: four outlines, and its top in the map."""
    run = make_run(cubes((0.03, 0.03, 0.05)))
    assert mics_tools(["pile", str(run.folder)]) == 0
    content = json.loads((run.folder / "pile.json").read_text())
    assert content["units"] == {"plan_area": "m2", "top": "m", "centre": "m", "spread": "m",
        "time_to_rest": "s", "fall_time": "s", "fall_speed": "m/s", "fall_drift": "m",
        "terminal_speed": "m/s",
        "impact_speed": "m/s", "contact_force": "N", "peak_force": "N", "slopes": "deg",
        "box": "m", "height": "m", "layer_thickness": "m", "thickness_ball": "m",
        "footprint": "m2"}  # fmt: skip
    corners = np.concatenate(content["outline"])
    assert len(content["outline"]) == 4
    assert corners[:, 0].min() == pytest.approx(0.02, abs=1e-9)
    with h5py.File(run.folder / "pile_maps.h5") as h5:
        x, y, top = (h5[name][:] for name in ("x", "y", "top"))
        assert h5["top"].attrs["units"] == "m"
    assert top[np.abs(y - 0.03).argmin(), np.abs(x - 0.03).argmin()] == pytest.approx(0.06)
    assert np.isfinite(top).sum() * 1e-6 == pytest.approx(content["plan_area"])


def test_the_command_prints_units_by_the_size_of_the_blocks(make_run, capsys) -> None:
    """A cube of 0.67 m: m, m2 and kN, and limits that are as large; plain ASCII."""
    run = make_run(cubes((0.03, 0.03, 0.05), motion=replace(SHORT, scale=100 / 3)))
    mics_tools(["pile", str(run.folder)])
    said = capsys.readouterr().out
    rows = dict(line.split(None, 1) for line in said.splitlines() if line.startswith("     "))
    assert said.isascii()
    assert rows["top"].split()[1] == rows["height"].split()[1] == "m"
    assert rows["plan_area"].endswith(" m2") and rows["contact_force"].endswith(" kN")
    assert rows["time_to_rest"].endswith(" s") and rows["impact_speed"].endswith(" m/s")
    assert rows["box"].count(",") == 5 and rows["box"].endswith(" m")
    assert rows["porosity"].endswith(", of the box above the bed")
    assert "overlap of the pile below 0.00667 m" in said
    assert json.loads((run.folder / "pile.json").read_text())["units"]["contact_force"] == "N"


def test_blocks_touch_and_cover_through_a_periodic_side(make_run, capsys) -> None:
    """Two cubes side by side, one at x_max, one a period on: the pile is that of a closed box moved
    along."""
    periodic = replace(SHORT, more="&boundary x_min = 'periodic' x_max = 'periodic' /\n")
    run = make_run(cubes((0.295, 0.05, 0.01), (0.615, 0.05, 0.01), motion=periodic))
    assert run.period.tolist() == pytest.approx([0.3, 0.0, 0.0])
    seen = find_contacts(run, -1)
    assert (3, 4) in seen.blocks and set(seen.blocks) == {(3, 4)}
    bodies = present_bodies(run, -1)
    assert [float(bodies[k].position[0]) for k in (3, 4)] == pytest.approx([0.295, 0.015])
    bare = pile_numbers.numbers(make_run(cubes(motion=SHORT)), 0.001)
    found = pile_numbers.numbers(run, 0.001)
    assert found.plan_area - bare.plan_area == pytest.approx(2 * 0.02**2, rel=0.06)
    assert 0.0 < found.porosity < 1.0
    beside = make_run(cubes((0.295, 0.05, 0.01), (0.315, 0.05, 0.01), motion=periodic))
    assert placing.ends(beside)[:, 0] == pytest.approx([0.295, 0.315])  # not at both ends
    change(beside.folder, "bodies/release_time", data=np.array([1e9, 1e9, 1e9, 0.0, 1.0]))
    alone = pile_numbers.numbers(Run(beside.folder), 0.001)
    assert (alone.centre[0], alone.spread[0]) == pytest.approx((0.005, 0.01))
    assert alone.footprint == pytest.approx(0.04 * 0.02, rel=0.1)
    assert Handover(Run(beside.folder), Options()).bodies[4].position[0] == pytest.approx(0.315)


def test_contact_spheres_touch_where_they_are(make_run) -> None:
    """A cube on contact spheres that stick out stands above the floor, and touches it."""
    cube = shapes.cube(0.02)
    lowest = float((cube.sphere_centre[:, 2] - cube.sphere_radius).min())
    out = -lowest - 0.01
    assert out > 6e-4  # more than counts as a touch
    standing = Placed(cube, np.array([0.04, 0.05, -lowest]), UPRIGHT)
    ways = np.arange(0.0195, 0.025, 1e-5)
    gaps = [sphere_gap(standing, standing.moved(np.array([way, 0, 0]))) for way in ways]
    way = float(ways[np.flatnonzero(np.array(gaps) >= 0.0)[0]])  # spheres just touch
    assert way > 0.0206
    both = cubes((0.04, 0.05, -lowest), (0.04 + way, 0.05, -lowest), motion=SHORT)
    spheres, surface = (
        find_contacts(make_run(replace(both, more=f"&contact model = '{model}' /\n")), -1)
        for model in ("spheres", "surface")
    )
    assert spheres.on_floor(3) and spheres.on_floor(4) and (3, 4) in spheres.blocks
    assert not surface.on_floor(3) and (3, 4) not in surface.blocks


def test_nothing_to_tell_before_the_first_block(make_run, capsys) -> None:
    run = make_run(SHORT)
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/release_time"][:] = 5.0
    run.refresh()
    with pytest.raises(BadRun, match="no block is let go at t = 3 s"):
        pile_numbers.numbers(run, 0.001)
    for command in ("pile", "report"):
        assert mics_tools([command, str(run.folder)]) == 2
        assert "no block is let go" in capsys.readouterr().err


def test_results_without_a_row_are_one_line(make_run, capsys) -> None:
    run = make_run(SHORT)
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        rows = len(h5["bodies/time"])
        for group in ("bodies", "series"):
            for name, data in list(h5[group].items()):
                if len(data) == rows:
                    values = data[:0]
                    del h5[group][name]
                    h5[group][name] = values
    run.refresh()
    assert "rows    0, none yet" in str(run)
    for command in ("pile", "report"):
        assert mics_tools([command, str(run.folder)]) == 2
        assert "no row of results yet" in capsys.readouterr().err


STEP = 0.001


def cube_at(x: float, y: float, z: float) -> Placed:
    return Placed(shapes.cube(EDGE), np.array([x, y, z]), UPRIGHT)


def test_porosity_of_two_stacked_cubes() -> None:
    stack = [cube_at(0.05, 0.05, 0.01), cube_at(0.05, 0.05, 0.03)]
    low, high = pile_form.around(stack, np.zeros(3), np.full(3, 0.1))
    assert np.concatenate([low, high]) == pytest.approx([0.04, 0.04, 0, 0.06, 0.06, 0.04])
    assert pile_form.porosity(stack, low, high) == pytest.approx(0.0, abs=1e-12)
    wide = np.array([0.03, 0.04, 0.0]), np.array([0.07, 0.06, 0.04])
    assert pile_form.porosity(stack, *wide) == pytest.approx(0.5)
    half = np.array([0.05, 0.04, 0.0]), np.array([0.07, 0.06, 0.08])
    assert pile_form.porosity(stack, *half) == pytest.approx(0.75)


def test_the_box_around_a_pile_ends_at_the_tank() -> None:
    low, high = pile_form.around([cube_at(0.005, 0.05, 0.01)], np.zeros(3), np.full(3, 0.1))
    assert low[0] == 0.0 and high[0] == pytest.approx(0.015)


def test_outline_of_a_ring_of_cubes() -> None:
    """Eight cubes around a hole, and one apart."""
    low = np.array([-0.1, 0.2, 0.0])
    places = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)] + [(4, 0)]
    blocks = [cube_at(low[0] + 0.02 + EDGE * i, low[1] + 0.02 + EDGE * j, 0.01) for i, j in places]
    top = height_map(blocks, low, low + [0.15, 0.1, 0.1], STEP)
    found = pile_form.outline(top, low, STEP)
    sums = (a[:-1, 0] * a[1:, 1] - a[:-1, 1] * a[1:, 0] for a in found)  # positive on the left
    areas = sorted(0.5 * float(one.sum()) for one in sums)
    assert areas == pytest.approx([-(EDGE**2), EDGE**2, 9 * EDGE**2], abs=3 * STEP**2)
    everything = np.concatenate(found)
    assert everything.min(axis=0) == pytest.approx(low[:2] + 0.01, abs=1e-9)
    assert everything.max(axis=0) == pytest.approx(low[:2] + [0.11, 0.07], abs=1e-9)
    assert all((line[0] == line[-1]).all() for line in found)


def test_footprint_and_layer() -> None:
    """Cubes in three corners of a square of three cubes' sides: half of the square and the bands
    beside its diagonal; two of them on a step of 5 mm, one stacked double."""
    low = np.zeros(3)
    blocks = [cube_at(0.03, 0.03, 0.01), cube_at(0.07, 0.03, 0.015), cube_at(0.03, 0.07, 0.015),
              cube_at(0.03, 0.07, 0.035)]  # fmt: skip
    top = height_map(blocks, low, low + 0.1, STEP)
    assert pile_form.footprint(top, STEP) == pytest.approx(0.06**2 - 0.04**2 / 2)
    ground = np.zeros(top.shape)
    ground[:, 50:], ground[50:] = 0.005, 0.005
    mean, most = pile_form.layer(top, ground)
    assert mean == pytest.approx((0.02 + 0.02 + 0.04) / 3) and most == pytest.approx(0.04)
    bare = np.full((5, 5), np.nan)
    assert pile_form.footprint(bare, STEP) == 0.0
    assert np.isnan(pile_form.layer(bare, np.zeros((5, 5)))).all()


def test_porosity_above_a_bed() -> None:
    """A cube in a box of twice its volume, of which the bed fills a quarter."""
    low, high = np.array([0.04, 0.04, 0.0]), np.array([0.06, 0.06, 0.04])
    cube = [cube_at(0.05, 0.05, 0.03)]
    bed = 0.25 * 2 * EDGE**3
    assert pile_form.porosity(cube, low, high, bed) == pytest.approx(1 - 1 / 1.5)
    assert np.isnan(pile_form.porosity(cube, low, high, 2 * EDGE**3))


def test_slopes_of_a_roof() -> None:
    """30 degrees towards -x, 45 towards +x; both ends of y lie against the map."""
    x = (np.arange(200) + 0.5) * STEP
    profile = np.minimum((x - 0.02) * np.tan(np.radians(30)), (0.12 - x))
    top = np.tile(np.where(profile > 0, 0.5 + profile, np.nan), (50, 1))
    found = pile_form.slopes(top - 0.5, STEP)
    assert found[:2] == pytest.approx((30, 45), abs=1e-9)
    assert np.isnan(found[2:]).all()


def test_a_tower_is_upright_and_a_bare_floor_has_no_slope() -> None:
    top = np.full((50, 50), np.nan)
    assert np.isnan(pile_form.slopes(top, STEP)).all()
    top[20:30, 20:30] = 0.04
    assert pile_form.slopes(top, STEP) == (90, 90, 90, 90)


@pytest.mark.parametrize(
    ("shape", "turns"),
    [(shapes.cube(EDGE), 24), (shapes.hexapod(EDGE), 24), (shapes.box((0.01, 0.02, 0.03)), 4),
     (shapes.box((0.01, 0.01, 0.03)), 8)],
)  # fmt: skip
def test_turns_that_leave_a_shape_as_it_is(shape: shapes.Shape, turns: int) -> None:
    assert len(pile_form.symmetries(shape)) == turns


def test_attitudes_alike_and_at_random() -> None:
    cube, brick = shapes.cube(EDGE), shapes.box((0.01, 0.02, 0.03))
    quarter = quaternion_from_axis(np.array([0.0, 0, 1]), 90)
    both = np.array([UPRIGHT, quarter])
    assert pile_form.attitude_randomness(cube, both) == pytest.approx(0.0, abs=1e-6)
    assert pile_form.attitude_randomness(brick, both) > 0.5
    draws = np.random.default_rng(7).normal(size=(150, 4))
    for shape in (cube, brick):
        assert pile_form.attitude_randomness(shape, draws) == pytest.approx(1.0, abs=0.02)
    assert np.isnan(pile_form.attitude_randomness(cube, both[:1]))


def test_random_cubes_differ_by_the_known_angle() -> None:
    """40.74 degrees on average: Mackenzie, Second paper on statistics (1958)."""
    tilt = quaternion_from_axis(np.array([1.0, 2, 3]), 30)
    found = pile_form.attitude_randomness(shapes.cube(EDGE), np.array([UPRIGHT, tilt]))
    assert found == pytest.approx(30 / 40.74, rel=0.01)
