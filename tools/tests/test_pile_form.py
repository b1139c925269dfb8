"""Porosity, slopes and attitudes of arrangements that are known exactly."""

import numpy as np
import pytest

from micstools.piles import pile_form
from micstools.piles.maps import height_map
from micstools.reading.overlap import Placed
from micstools.shapes import shape as shapes
from micstools.shapes.geometry import quaternion_from_axis
from synthetic import UPRIGHT

EDGE, STEP = 0.02, 0.001


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
    areas = sorted(_area(line) for line in found)
    assert areas == pytest.approx([-(EDGE**2), EDGE**2, 9 * EDGE**2], abs=3 * STEP**2)
    everything = np.concatenate(found)
    assert everything.min(axis=0) == pytest.approx(low[:2] + 0.01, abs=1e-9)
    assert everything.max(axis=0) == pytest.approx(low[:2] + [0.11, 0.07], abs=1e-9)
    assert all((line[0] == line[-1]).all() for line in found)


def _area(line: np.ndarray) -> float:
    """Enclosed, positive when it lies to the left [m2]."""
    (x, y), (u, v) = line[:-1].T, line[1:].T
    return 0.5 * float((x * v - u * y).sum())


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
    found = pile_form.slopes(top, 0.5, STEP)
    assert found[:2] == pytest.approx((30, 45), abs=1e-9)
    assert np.isnan(found[2:]).all()


def test_a_tower_is_upright_and_a_bare_floor_has_no_slope() -> None:
    top = np.full((50, 50), np.nan)
    assert np.isnan(pile_form.slopes(top, 0.0, STEP)).all()
    top[20:30, 20:30] = 0.04
    assert pile_form.slopes(top, 0.0, STEP) == (90, 90, 90, 90)


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
