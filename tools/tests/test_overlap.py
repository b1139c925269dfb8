"""Gaps and depths of true shapes at places where they are known."""

import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from micstools.reading import overlap
from micstools.reading.overlap import Placed, apart, bed_gap, depth, gap, near_pairs, wall_gaps
from micstools.shapes.geometry import (
    distance_to_triangles,
    inside_tets,
    quaternion_from_axis,
    surface_samples,
)
from micstools.shapes.shape import cube, hexapod

UPRIGHT = np.array([1.0, 0, 0, 0])
WALLS = {f"{axis}_{end}": "no_slip" for axis in "xyz" for end in ("min", "max")}


def at(shape, x: float, y: float, z: float, q=UPRIGHT) -> Placed:
    return Placed(shape, np.array([x, y, z]), q)


def test_gap_of_two_faces_two_edges_and_a_corner() -> None:
    d, c = 0.02, cube(0.02)
    assert gap(at(c, 0, 0, 0), at(c, 0, 0.004, d + 1e-4)) == pytest.approx(1e-4, rel=1e-9)
    on_edge = quaternion_from_axis(np.array([1.0, 0, 0]), 45.0)
    across = quaternion_from_axis(np.array([0.0, 1, 0]), 45.0)
    half = d / np.sqrt(2)
    found = gap(at(c, 0, 0, 0, on_edge), at(c, 0.003, 0.002, 2 * half + 3e-4, across))
    assert found == pytest.approx(3e-4, rel=1e-9)
    turn = np.degrees(np.arccos(1 / np.sqrt(3)))
    on_corner = quaternion_from_axis(np.array([1.0, -1, 0]), turn)
    found = gap(at(c, 0, 0, 0), at(c, 0.001, 0, d / 2 + np.sqrt(3) / 2 * d + 2e-4, on_corner))
    assert found == pytest.approx(2e-4, rel=1e-9)


def test_gap_to_a_bed_face_ridge_and_peak() -> None:
    """Over one large facet, across a ridge along x, above a peak, and far from all of them."""
    c, reach = cube(0.02), 1e-3
    flat = np.array([[(-1.0, -1, 0), (2, -1, 0), (-1, 2, 0)]])
    on_edge = quaternion_from_axis(np.array([0.0, 1, 0]), 45.0)
    assert bed_gap(at(c, 0, 0, 0.0102), flat, reach) == pytest.approx(2e-4, rel=1e-9)
    half = 0.02 / np.sqrt(2)
    ridge = np.array([[(-1.0, 0, 0), (1, 0, 0), (0, y, -1)] for y in (-1.0, 1.0)])
    assert bed_gap(at(c, 0, 0.003, half + 3e-4, on_edge), ridge, reach) == pytest.approx(3e-4)
    peak = np.array([[(0.003, 0.002, 0), (1.0, 0, -1), (0, 1, -1)]])
    assert bed_gap(at(c, 0, 0, 0.0104), peak, reach) == pytest.approx(4e-4, rel=1e-9)
    assert bed_gap(at(c, 0, 0, 0.05), flat, reach) == float("inf")


def test_depth_of_faces_and_of_a_leg() -> None:
    c, h = cube(0.02), hexapod(0.02)
    assert depth(at(c, 0, 0, 0), at(c, 0.001, 0.002, 0.0197)) == pytest.approx(3e-4)
    assert depth(at(h, 0, 0, 0), at(h, 0, 0.05999, 0)) == pytest.approx(1e-5)
    assert depth(at(h, 0, 0, 0), at(h, 0, 0.0601, 0)) == 0.0


def test_depth_of_a_corner_and_of_blocks_anywhere() -> None:
    """A corner is sampled itself: exact; elsewhere as with every surface point of either block."""
    c, h, d = cube(0.02), hexapod(0.02), 0.02
    turn = np.degrees(np.arccos(1 / np.sqrt(3)))
    on_corner = quaternion_from_axis(np.array([1.0, -1, 0]), turn)
    lowest = d / 2 + np.sqrt(3) / 2 * d
    found = depth(at(c, 0, 0, 0), at(c, 0.001, 0.002, lowest - 2e-4, on_corner))
    assert found == pytest.approx(2e-4, rel=1e-9)
    chance = np.random.default_rng(5)
    for _ in range(6):
        q = chance.normal(size=4)
        a, b = at(h, 0, 0, 0), at(h, *chance.uniform(-0.03, 0.03, 3), q / np.linalg.norm(q))
        deepest = 0.0
        for one, other in ((a, b), (b, a)):
            points = surface_samples(one.triangles, h.radius / 30)
            inside = points[inside_tets(points, other.tets)]
            deepest = max(deepest, distance_to_triangles(inside, other.triangles).max(initial=0.0))
        assert depth(a, b) == pytest.approx(deepest, rel=1e-12)


def test_hexapods_lying_in_one_anothers_notches_are_apart() -> None:
    h = hexapod(0.02)
    beside = at(h, 0.0201, 0.0201, 0.0201)  # every leg in a notch of the other
    assert depth(at(h, 0, 0, 0), beside) == 0.0
    assert gap(at(h, 0, 0, 0), beside) == pytest.approx(1e-4, rel=1e-6)


def test_shadows_bound_the_gap() -> None:
    """Exactly between faces; never more than the gap of hexapods in any attitude."""
    c, h, rng = cube(0.02), hexapod(0.02), np.random.default_rng(4)
    assert apart(at(c, 0, 0, 0), at(c, 0, 0.004, 0.0201)) == pytest.approx(1e-4, rel=1e-5)
    for _ in range(20):
        q = rng.normal(size=(2, 4))
        way = rng.normal(size=3)
        way *= 0.07 / np.linalg.norm(way)
        one, other = at(h, 0, 0, 0, q[0]), at(h, *way, q[1])
        assert apart(one, other) <= gap(one, other) + 1e-9


def test_contacts_of_a_thousand_cubes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four layers of 250 cubes 5 % of an edge apart; the two lower ones touch."""
    c, n, count = cube(1.0), 16, 0
    bodies = {}
    for level in (0.5, 1.505, 2.55, 3.6):
        for k in range(250):
            bodies[count] = at(c, 1.05 * (k % n), 1.05 * (k // n), level)
            count += 1
    monkeypatch.setattr(overlap, "present_bodies", lambda run, row: bodies)
    monkeypatch.setattr(overlap.scales, "reach", lambda run: 1 / 120)
    sides = dict.fromkeys(WALLS, "open") | {"z_min": "no_slip"}
    run: Any = Mock(  # unlike a namespace it has a hash
        period=np.zeros(3), periodic=(False,) * 3, sides=sides,
        grid=SimpleNamespace(low=np.zeros(3), high=np.full(3, 20.0)),
        parameters={}, value=lambda group, name: "surface",
        bed=(np.zeros((0, 3)), np.zeros((0, 3), int)),
    )  # fmt: skip
    start = time.process_time()
    found = overlap.find_contacts(run, -1)
    assert time.process_time() - start < 4.0, "CPU seconds; 45 with a gap and a depth of each pair"
    assert sorted(found.blocks) == [(k, k + 250) for k in range(250)]
    assert list(found.blocks.values()) == pytest.approx([0.005] * 250)
    assert len(found.walls) == 250


def test_pairs_are_near_through_periodic_sides_too() -> None:
    """Against all pairs and all images, 60 cubes in a tank that is periodic in x."""
    c, rng, reach = cube(0.02), np.random.default_rng(3), 1e-3
    run: Any = SimpleNamespace(period=np.array([0.2, 0.0, 0.0]))
    bodies = {k: at(c, *rng.uniform(0, 0.2, 3)) for k in range(0, 120, 2)}
    wanted = {
        (i, j)
        for i in bodies
        for j in bodies
        if i < j
        and min(
            np.linalg.norm(bodies[i].position - bodies[j].position + [way, 0, 0])
            for way in (-0.2, 0.0, 0.2)
        )
        < 2 * c.radius + reach + (0.01 if 4 in (i, j) else 0.0)
    }
    found = list(near_pairs(run, bodies, reach, {4: 0.01}))
    assert set(found) == wanted and len(found) == len(wanted) > 20


def test_walls_give_signed_gaps_and_open_sides_none() -> None:
    low, high = np.zeros(3), np.array([0.3, 0.1, 0.2])
    body = at(hexapod(0.02), 0.15, 0.029, 0.0305)
    gaps = wall_gaps(body, low, high, WALLS | {"z_max": "open", "x_max": "periodic"})
    assert gaps == pytest.approx({"x_min": 0.12, "y_min": -1e-3, "y_max": 0.041, "z_min": 5e-4})


def test_gap_is_exact_up_to_its_reach() -> None:
    """Of hexapods at random attitudes beside one another: the same with and without, else more."""
    draw, h = np.random.default_rng(3), hexapod(0.02)
    within = 0
    for _ in range(60):
        turns = draw.normal(size=(2, 4))
        one, other = (q / np.linalg.norm(q) for q in turns)
        way = draw.normal(size=3)
        a, b = at(h, 0, 0, 0, one), at(h, *(0.064 * way / np.linalg.norm(way)), other)
        exact, found = gap(a, b), gap(a, b, 5e-3)
        within += exact <= 5e-3
        assert found == exact if exact <= 5e-3 else found > 5e-3
    assert 5 < within < 55
