"""Write the file of `&fluid initial_state`, and exact liquid shares of simple surfaces.

Arrays over cells run z, y, x, as in the result files; a velocity has x, y, z last.
"""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from micstools.shapes.geometry import Array

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


def write_initial_state(
    path: Path, liquid: Array | None = None, velocity: Array | None = None
) -> None:
    """Store liquid shares (nz, ny, nx) and velocities (nz, ny, nx, 3) [m/s], one or both."""
    with h5py.File(path, "w") as h5:
        if liquid is not None:
            h5["liquid"] = np.clip(liquid, 0.0, 1.0)
            h5["liquid"].attrs["units"] = "1"
        if velocity is not None:
            h5["velocity"] = velocity
            h5["velocity"].attrs["units"] = "m/s"


def below_surface(
    height: Callable[[Array], Array], x_faces: Array, z_faces: Array, parts: int = 8
) -> Array:
    """Shares (nz, 1, nx) of the cells below z = height(x), by Gauss points in parts of a cell.

    Exact to round-off in columns where the surface stays within one cell; where it crosses a face
    between two cells the kink leaves an error of the order of 1e-6 of the cell.
    """
    width = np.diff(x_faces) / parts
    starts = (x_faces[:-1] + np.outer(np.arange(parts), width)).ravel(order="F")
    half = 0.5 * np.repeat(width, parts)
    x = (starts + half)[:, None] + half[:, None] * GAUSS_POINTS
    top = height(x)
    low, high = z_faces[:-1, None, None], z_faces[1:, None, None]
    share = np.clip((top - low) / (high - low), 0.0, 1.0) @ (0.5 * GAUSS_WEIGHTS)
    mean: Array = share.reshape(len(z_faces) - 1, len(x_faces) - 1, parts).mean(axis=2)
    return mean[:, None, :]


def disc_shares(
    centre: tuple[float, float], radius: float, x_faces: Array, z_faces: Array
) -> Array:
    """Exact shares (nz, 1, nx) of the cells of a plane inside a disc."""
    corner = _disc_area(x_faces[None, :] - centre[0], z_faces[:, None] - centre[1], radius)
    area = np.diff(np.diff(corner, axis=0), axis=1)
    cell = np.diff(z_faces)[:, None] * np.diff(x_faces)
    return np.clip(area / cell, 0.0, 1.0)[:, None, :]


def ball_shares(
    centre: tuple[float, float, float],
    radius: float,
    faces: tuple[Array, Array, Array],
    parts: int = 8,
) -> Array:
    """Shares (nz, ny, nx) of the cells inside a ball: discs at Gauss points along z, to 1e-6."""
    x_faces, y_faces, z_faces = faces
    area = np.diff(y_faces)[:, None] * np.diff(x_faces)
    share = np.zeros((len(z_faces) - 1, len(y_faces) - 1, len(x_faces) - 1))
    for k, (low, high) in enumerate(zip(z_faces[:-1], z_faces[1:], strict=True)):
        edges = np.linspace(low, high, parts + 1)
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            for point, weight in zip(GAUSS_POINTS, GAUSS_WEIGHTS, strict=True):
                z = 0.5 * (a + b) + 0.5 * (b - a) * point
                rest = radius**2 - (z - centre[2]) ** 2
                if rest <= 0.0:
                    continue
                corner = _disc_area(
                    x_faces[None, :] - centre[0], y_faces[:, None] - centre[1], rest**0.5
                )
                section = np.diff(np.diff(corner, axis=0), axis=1) / area
                share[k] += 0.5 * weight * (b - a) / (high - low) * section
    return share


def _disc_area(x: Array, y: Array, radius: float) -> Array:
    """Area of the disc about the origin left of x and below y."""
    x, y = np.broadcast_arrays(np.clip(x, -radius, radius), np.clip(y, -radius, radius))
    half = np.sqrt(np.maximum(radius**2 - y**2, 0.0))  # the chord at y reaches from -half to half
    left, right = np.minimum(x, -half), np.minimum(x, half)
    # Outside the chord the section runs over the whole disc (y > 0) or over nothing (y < 0).
    outside = _half_disc(left, radius) - _half_disc(-radius, radius)
    outside = outside + np.where(
        x > half, _half_disc(x, radius) - _half_disc(np.minimum(half, x), radius), 0.0
    )
    inside = np.where(
        x > -half, _half_disc(right, radius) - _half_disc(-half, radius) + y * (right + half), 0.0
    )
    return np.where(y >= 0.0, 2.0 * outside, 0.0) + inside


def _half_disc(x: Array | float, radius: float) -> Array:
    """Integral of sqrt(radius^2 - x^2)."""
    s = np.clip(np.asarray(x) / radius, -1.0, 1.0)
    return 0.5 * radius**2 * (s * np.sqrt(1.0 - s**2) + np.arcsin(s))
