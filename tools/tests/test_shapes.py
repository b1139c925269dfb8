"""Mass properties and surfaces of the built-in shapes against closed forms."""

import numpy as np
import pytest

from micstools.shapes.geometry import tet_volumes
from micstools.shapes.shape import box, hexapod


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
