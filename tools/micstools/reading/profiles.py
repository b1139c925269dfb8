"""Values of a field along a line."""

import numpy as np

from micstools.shapes.geometry import Array


def cubic(at: Array, x: Array, values: Array) -> Array:
    """Values at the places `at` (n) from those at `x` (m), the last axis of `values` (..., m), by
    the cubic through the four nearest points; m >= 4."""
    result = np.zeros((*values.shape[:-1], at.size))
    first = np.clip(np.searchsorted(x, at) - 2, 0, x.size - 4)
    for point in range(4):
        weight = np.ones(at.size)
        for other in range(4):
            if other != point:
                weight *= (at - x[first + other]) / (x[first + point] - x[first + other])
        result += weight * values[..., first + point]
    return result


def along_line(faces: tuple[Array, Array, Array], values: Array, points: Array) -> Array:
    """Values at points (n, 3) [m] from those of the cells (nz, ny, nx, ...), linear between the
    cell centres and constant beyond the outermost; `faces`: coordinates of the cell faces [m]."""
    corners = []
    for face, place in zip(faces, points.T, strict=True):
        centre = (face[1:] + face[:-1]) / 2
        index = np.interp(place, centre, np.arange(centre.size))
        low = np.floor(index).astype(int)
        corners.append((low, np.minimum(low + 1, centre.size - 1), index - low))
    result = np.zeros((len(points), *values.shape[3:]))
    for corner in np.ndindex(2, 2, 2):
        weight = np.ones(len(points))
        cell = []
        for side, (low, high, share) in zip(corner, corners, strict=True):
            weight *= share if side else 1 - share
            cell.append(high if side else low)
        part = values[cell[2], cell[1], cell[0]]
        result += weight.reshape(-1, *[1] * (part.ndim - 1)) * part
    return result


def with_ends(low: float, values: Array, high: float) -> Array:
    """Values at cell centres along the last axis with those on the two walls around them."""
    ends = [np.full((*values.shape[:-1], 1), value) for value in (low, high)]
    return np.concatenate([ends[0], values, ends[1]], axis=-1)
