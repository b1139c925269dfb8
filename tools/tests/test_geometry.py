"""Exact identities of tets, planes, distances and rotations; mass properties and surfaces of the
built-in shapes against closed forms."""

import numpy as np
import pytest

from micstools.shapes import geometry as g
from micstools.shapes.geometry import tet_volumes
from micstools.shapes.shape import box, from_tets, hexapod

TILTED = g.quaternion_from_axis(np.array([0.3, -0.5, 0.8]), 37.0)


def test_rotation_turns_x_into_y() -> None:
    q = g.quaternion_from_axis(np.array([0.0, 0.0, 1.0]), 90.0)
    assert np.allclose(g.rotation_matrix(q) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_product_is_composition_of_rotations() -> None:
    other = g.quaternion_from_axis(np.array([1.0, 0.2, 0.1]), -71.0)
    both = g.rotation_matrix(g.quaternion_product(TILTED, other))
    assert np.allclose(both, g.rotation_matrix(TILTED) @ g.rotation_matrix(other), atol=1e-15)


@pytest.mark.parametrize("angle", [1e-6, 3.0, -100.0])
def test_turns_are_vectors_along_their_axes(angle: float) -> None:
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    turned = g.quaternion_product(g.quaternion_from_axis(axis, angle), TILTED)
    for sign in (1, -1):  # both are the same attitude
        found = g.turns(np.array([TILTED, sign * turned, sign * turned]))
        assert found[0] == pytest.approx(np.radians(angle) * axis, rel=1e-9)
        assert found[1] == pytest.approx(np.zeros(3), abs=1e-15)


@pytest.mark.parametrize("angle", [1e-6, 0.01, 5.0, 120.0, 180.0])
def test_attitude_change_is_the_angle_turned(angle: float) -> None:
    turned = g.quaternion_product(g.quaternion_from_axis(np.array([1.0, 2, 3]), angle), TILTED)
    found = g.attitude_change_deg(np.stack([turned, -turned]), TILTED)
    assert found == pytest.approx([angle, angle], rel=1e-9)


def test_volume_and_centroid_below_a_plane_match_a_box() -> None:
    shape = box((0.03, 0.02, 0.05), refinement=2)
    volume, moment = g.below_plane(shape.points[shape.tets], 0.0137)
    depth = 0.025 + 0.0137
    assert volume == pytest.approx(0.03 * 0.02 * depth, rel=1e-13)
    assert moment / volume == pytest.approx([0, 0, -0.025 + depth / 2], abs=1e-15)


@pytest.mark.parametrize("level", [-0.03, -0.011, 0.0, 0.004, 0.02])
def test_parts_below_and_above_a_plane_make_the_whole(level: float) -> None:
    shape = hexapod(0.02)
    corner = g.place(shape.points, np.zeros(3), TILTED)[shape.tets]
    mirrored = (corner * [1, 1, -1])[:, [0, 2, 1, 3]]
    below, moment_below = g.below_plane(corner, level)
    above, moment_above = g.below_plane(mirrored, -level)
    assert below + above == pytest.approx(shape.volume, rel=1e-13)
    assert moment_below + moment_above * [1, 1, -1] == pytest.approx(np.zeros(3), abs=1e-18)


def test_volume_in_a_box_is_that_of_a_smaller_box() -> None:
    shape = box((0.03, 0.02, 0.05), refinement=2)
    low, high = np.array([-0.004, -1.0, -0.0137]), np.array([0.0071, 0.003, np.inf])
    found = g.volume_in_box(shape.points[shape.tets], low, high)
    assert found == pytest.approx(0.0111 * 0.013 * 0.0387, rel=1e-13)


def test_boxes_that_fill_space_hold_the_whole_and_agree_with_planes() -> None:
    shape = hexapod(0.02)
    corner = g.place(shape.points, np.zeros(3), TILTED)[shape.tets]
    cuts = np.array([-np.inf, -0.011, 0.004, np.inf])
    cells = np.array(list(np.ndindex(3, 3, 3)))
    parts = np.array([g.volume_in_box(corner, cuts[c], cuts[c + 1]) for c in cells]).reshape(9, 3)
    below = g.below_plane(corner, -0.011)[0]
    assert parts.sum() == pytest.approx(shape.volume, rel=1e-13)
    assert parts[:, 0].sum() == pytest.approx(below, rel=1e-13)


def test_inside_agrees_with_the_three_boxes_of_a_hexapod() -> None:
    shape, rng = hexapod(0.02), np.random.default_rng(3)
    points = rng.uniform(-0.032, 0.032, (4000, 3))
    legs = np.sort(np.abs(points), axis=1)
    expected = (legs[:, 1] < 0.01) & (legs[:, 2] < 0.03)
    assert np.array_equal(g.inside_tets(points, shape.points[shape.tets]), expected)


def test_distance_to_the_surface_of_a_cube() -> None:
    shape = box((2.0, 2.0, 2.0), refinement=1)
    points = np.array([[0, 0, 0.4], [0, 0, 1.5], [2, 2, 2], [0.9, 0, 0], [2, 2, 0]], float)
    found = g.distance_to_triangles(points, shape.points[shape.triangles])
    assert found == pytest.approx([0.6, 0.5, np.sqrt(3), 0.1, np.sqrt(2)], rel=1e-14)


def test_distance_between_segments() -> None:
    cross = g.distance_between_segments(
        np.array([[[0.0, 0, 0], [1, 0, 0]]]), np.array([[[0.5, -1, 0.2], [0.5, 1, 0.2]]])
    )
    parallel = g.distance_between_segments(
        np.array([[[0.0, 0, 0], [1, 0, 0]]]), np.array([[[3.0, 0, 0], [2, 0, 0]]])
    )
    assert (cross, parallel) == pytest.approx((0.2, 1.0), rel=1e-14)


def test_samples_are_dense_and_on_the_surface() -> None:
    shape = box((0.03, 0.02, 0.05))
    triangles = shape.points[shape.triangles]
    samples = g.surface_samples(triangles, 1.5e-3)
    assert np.abs(g.distance_to_triangles(samples, triangles)).max() < 1e-15
    probe = np.array([[0.0151, y, z] for y in (-0.0061, 0.0033) for z in (-0.02, 0.0111)])
    nearest = np.linalg.norm(probe[:, None] - samples[None], axis=2).min(axis=1)
    assert nearest.max() < 1.5e-3


@pytest.mark.parametrize("refinement", [1, 2, 3])
def test_hexapod_has_the_closed_form_mass_and_inertia(refinement: int) -> None:
    shape, d = hexapod(0.02, refinement), 0.02
    assert shape.volume == pytest.approx(7 * d**3, rel=1e-13)
    expected = 31 / 6 * 2300 * d**5 * np.eye(3)
    assert shape.inertia == pytest.approx(expected, rel=1e-12, abs=1e-18)


def test_box_has_the_closed_form_inertia() -> None:
    a, b, c = 0.03, 0.02, 0.05
    shape = box((a, b, c), density=1000.0)
    mass = 1000 * a * b * c
    expected = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * mass / 12
    assert shape.inertia == pytest.approx(expected, rel=1e-12, abs=1e-18)


@pytest.mark.parametrize("shape", [hexapod(0.02), box((0.03, 0.02, 0.05), 3)])
def test_surface_is_closed_and_points_outwards(shape) -> None:
    corner = shape.points[shape.triangles]
    cones = np.concatenate([np.zeros((len(corner), 1, 3)), corner], axis=1)
    assert tet_volumes(cones).sum() == pytest.approx(shape.volume, rel=1e-13)
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.abs(normals.sum(axis=0)).max() < 1e-16


def test_contact_spheres_have_the_volume_of_the_surface_tets() -> None:
    shape = hexapod(0.02, 2)
    assert len(shape.sphere_radius) == 192
    expected = 2 * np.cbrt(3 * 0.01**3 / 6 / (4 * np.pi))
    assert 2 * shape.sphere_radius == pytest.approx(np.full(192, expected), rel=1e-12)


def test_feature_edges_of_a_hexapod() -> None:
    shape = hexapod(0.02, 2)
    length = np.linalg.norm(np.diff(shape.points[shape.edges], axis=1), axis=2).sum()
    assert length == pytest.approx(60 * 0.02, rel=1e-12)


def test_inertia_turns_with_the_body() -> None:
    brick, turn = box((0.03, 0.02, 0.05), density=1000.0), g.rotation_matrix(TILTED)
    turned = from_tets("b", brick.points[brick.tets] @ turn.T, 1000.0)
    assert turned.inertia == pytest.approx(turn @ brick.inertia @ turn.T, rel=1e-9, abs=1e-15)
