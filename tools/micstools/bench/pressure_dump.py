"""One pressure system that every solver can read: a tank with waves and nine blocks.

A file holds, little endian and without gaps, `POIS7P01`; the cells nx, ny, nz (int64); the
edges of a cell dx, dy, dz [m]; the coefficients of the lower faces, x first, then y, z:
`cx[nz][ny][nx + 1]`, `cy[nz][ny + 1][nx]`, `cz[nz + 1][ny][nx]`, and `b[nz][ny][nx]` (float64).
In each cell the sum over its faces of c (phi of the cell - phi of the neighbour) is b, where
c = 1/(rho h^2) with the mean density of both, 0 at walls and floor, and 2/(rho h^2) at the top,
outside which phi is 0.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from micstools.shapes.geometry import Array

LENGTH = np.array([0.3, 0.1, 0.2])  # of the tank [m]
EDGE = 0.02  # of a cube of a block [m]
SOLID, WATER, AIR = 2300.0, 1000.0, 1.2  # [kg/m3]
BLOCKS = np.array(  # centres [m] and turns about x, y, z [rad]
    [
        (0.05, 0.05, 0.030, 0.0, 0.0, 0.0),
        (0.15, 0.05, 0.030, 0.0, 0.0, 0.4),
        (0.25, 0.05, 0.030, 0.0, 0.0, 0.9),
        (0.10, 0.04, 0.065, 0.5, 0.3, 0.1),
        (0.20, 0.06, 0.068, 1.1, 0.7, 0.2),
        (0.15, 0.05, 0.098, 0.2, 1.0, 0.6),
        (0.07, 0.06, 0.110, 0.9, 0.2, 1.3),
        (0.23, 0.045, 0.125, 0.4, 0.5, 0.8),
        (0.15, 0.05, 0.160, 0.7, 0.6, 0.5),
    ]
)


def write(path: Path, cells: tuple[int, int, int]) -> Path:
    """Write the system on so many cells."""
    n = np.array(cells)
    h = LENGTH / n
    rho = density(cells)
    with path.open("wb") as file:
        file.write(b"POIS7P01")
        file.write(n.astype("<i8").tobytes())
        file.write(h.astype("<f8").tobytes())
        for axis in range(3):
            file.write(_coefficients(rho, axis, h[axis]).astype("<f8").tobytes())
        file.write(right_side(cells).astype("<f8").tobytes())
    return path


def read(path: Path) -> tuple[list[int], list[Array], Array]:
    """Cells, coefficients of the lower faces across x, y, z and the right side of a file."""
    data = path.read_bytes()
    if data[:8] != b"POIS7P01":
        raise ValueError(f"{path} holds no pressure system")
    n = [int(v) for v in np.frombuffer(data, "<i8", 3, 8)]
    nx, ny, nz = n
    shapes = [(nz, ny, nx + 1), (nz, ny + 1, nx), (nz + 1, ny, nx), (nz, ny, nx)]
    start, found = 8 + 24 + 24, []
    for shape in shapes:
        count = int(np.prod(shape))
        found.append(np.frombuffer(data, "<f8", count, start).reshape(shape))
        start += 8 * count
    return n, found[:3], found[3]


def _coefficients(rho: Array, axis: int, h: float) -> Array:
    """1/(rho h^2) of the faces across an axis (0 is x), an array that runs z, y, x."""
    rho = np.moveaxis(rho, 2 - axis, 0)
    inner = 2 / (rho[1:] + rho[:-1])
    last = 2 / rho[-1:] if axis == 2 else 0 * rho[-1:]
    found = np.concatenate([0 * rho[:1], inner, last]) / h**2
    return np.moveaxis(found, 0, 2 - axis)


@cache
def density(cells: tuple[int, int, int]) -> Array:
    """Density (nz, ny, nx) [kg/m3] of water under waves, air and blocks, from 4 points per edge."""
    solid = _samples(cells, _in_a_block).mean(axis=-1)
    level = _samples((cells[0], cells[1], 1), _level)[0, :, :, :16]
    bottom = np.arange(cells[2])[:, None, None, None] * LENGTH[2] / cells[2]
    water = np.clip((level - bottom) * cells[2] / LENGTH[2], 0, 1).mean(axis=-1)
    return np.asarray(solid * SOLID + (1 - solid) * (water * WATER + (1 - water) * AIR))


def right_side(cells: tuple[int, int, int]) -> Array:
    """Twelve waves (nz, ny, nx)."""
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n for n in reversed(cells)), indexing="ij")
    found = np.zeros(cells[::-1])
    for m in range(12):
        a, b, c = (5 * m + 1) % 7, (3 * m + 2) % 5, (4 * m + 1) % 6
        waves = [
            np.cos(np.pi * f * s + p * m) for f, s, p in ((a, x, 0.7), (b, y, 1.3), (c, z, 0.4))
        ]
        found += waves[0] * waves[1] * waves[2] / (1 + 0.25 * m)
    return found


def _samples(cells: tuple[int, int, int], value: Callable[[Array], Array]) -> Array:
    """A value at 4 x 4 x 4 points of each cell (nz, ny, nx, 64), those of a layer first."""
    n = np.array(cells)
    inside = (np.stack(np.meshgrid(*3 * [np.arange(4)], indexing="ij")[::-1], -1) + 0.5) / 4
    found = np.empty((*cells[::-1], 64))
    for k in range(cells[2]):
        corner = np.stack(
            np.meshgrid([k], np.arange(n[1]), np.arange(n[0]), indexing="ij")[::-1], -1
        )
        points = (corner[..., None, :] + inside.reshape(64, 3)) / n * LENGTH
        found[k] = value(points)[0]
    return found


def _level(x: Array) -> Array:
    """Height of the water (...) [m] above points (..., 3)."""
    wave = 0.008 * np.sin(2 * np.pi * x[..., 0] / 0.15 + 0.3) * np.cos(np.pi * x[..., 1] / 0.1)
    return np.asarray(0.15 + wave + 0.004 * np.sin(2 * np.pi * x[..., 0] / 0.06 + 1.1))


def _in_a_block(x: Array) -> Array:
    """1 for points (..., 3) in one of the blocks, else 0."""
    found = np.zeros(x.shape[:-1], bool)
    for block in BLOCKS:
        near = np.linalg.norm(x - block[:3], axis=-1) <= np.sqrt(11 / 4) * EDGE
        seen = np.abs((x[near] - block[:3]) @ _turn(block[3:])) <= EDGE / 2
        beyond = np.abs((x[near] - block[:3]) @ _turn(block[3:])) <= 1.5 * EDGE
        found[near] |= beyond.all(axis=-1) & (seen.sum(axis=-1) >= 2)
    return found


def _turn(angles: Array) -> Array:
    """Matrix of the turns about x, then y, then z, the axes turning along."""
    (c1, c2, c3), (s1, s2, s3) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, c1, -s1], [0, s1, c1]])
    about_y = np.array([[c2, 0, s2], [0, 1, 0], [-s2, 0, c2]])
    about_z = np.array([[c3, -s3, 0], [s3, c3, 0], [0, 0, 1]])
    return np.asarray(about_x @ about_y @ about_z)
