"""Plain geometry of tetrahedra, triangles, edges and attitudes; every array is in metres."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


def rotation_matrix(q: Array) -> Array:
    """Rotations (..., 3, 3) from body axes to space of quaternions `q` (..., 4) = w, x, y, z."""
    w, x, y, z = np.moveaxis(
        np.asarray(q, float) / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0
    )
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_product(a: Array, b: Array) -> Array:
    """Hamilton product of two quaternions w, x, y, z: the rotation b, then the rotation a."""
    v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], v])


def quaternion_from_axis(axis: Array, angle_deg: float) -> Array:
    """Quaternion w, x, y, z of a turn by `angle_deg` about `axis`."""
    half = np.radians(angle_deg) / 2
    return np.concatenate([[np.cos(half)], np.sin(half) * axis / np.linalg.norm(axis)])


def attitude_change_deg(q: Array, q0: Array) -> Array:
    """Angle in degrees of the rotation from `q0` (4) to each of `q` (..., 4)."""
    vector = np.linalg.norm(
        q0[0] * q[..., 1:] - q[..., :1] * q0[1:] + np.cross(q[..., 1:], q0[1:]), axis=-1
    )
    return np.asarray(np.degrees(2 * np.arctan2(vector, np.abs(q @ q0))))


def turns(q: Array) -> Array:
    """Rotation from each of the attitudes `q` (n, 4) to the next one as a vector (n - 1, 3) along
    its axis [rad], the shorter way round."""
    one, two = q[:-1], q[1:]
    vector = one[:, :1] * two[:, 1:] - two[:, :1] * one[:, 1:] + np.cross(one[:, 1:], two[:, 1:])
    sign = np.sign((one * two).sum(axis=1, keepdims=True))
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arcsin(np.minimum(length, 1.0))
    return np.asarray(sign * vector * angle / np.where(length > 0, length, 1.0))


def place(points: Array, position: Array, q: Array) -> Array:
    """Points (n, 3) in body axes as points in space, for a body at `position` with attitude `q`."""
    return np.asarray(points @ rotation_matrix(q).T + position)


def normals(triangle: Array) -> Array:
    """Unit normals (m, 3) of triangles (m, 3, 3), by the order of their corners."""
    found = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def tet_volumes(corner: Array) -> Array:
    """Signed volumes of tetrahedra `corner` (k, 4, 3) [m3]."""
    a = corner[:, 1:] - corner[:, :1]
    return np.asarray(np.einsum("ki,ki->k", a[:, 0], np.cross(a[:, 1], a[:, 2])) / 6)


def inside_tets(points: Array, corner: Array, tolerance: float = 1e-12) -> NDArray[np.bool_]:
    """Which of `points` (n, 3) lie in any of the tetrahedra `corner` (k, 4, 3)."""
    inside = np.zeros(len(points), bool)
    if not len(corner):
        return inside
    low, high = corner.min(axis=1), corner.max(axis=1)
    near = np.all((points >= low.min(axis=0)) & (points <= high.max(axis=0)), axis=1)
    left = np.flatnonzero(near)
    if not left.size:
        return inside
    bounds = points[left].min(axis=0), points[left].max(axis=0)
    reached = np.flatnonzero(np.all((low <= bounds[1]) & (high >= bounds[0]), axis=1))
    corner, low, high = corner[reached], low[reached], high[reached]
    inverse = np.linalg.inv(np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2))
    for k in range(len(corner)):
        here = points[left]
        boxed = np.flatnonzero(np.all((here >= low[k]) & (here <= high[k]), axis=1))
        share = (here[boxed] - corner[k, 0]) @ inverse[k].T
        found = (share.min(axis=1, initial=1.0) >= -tolerance) & (
            share.sum(axis=1) <= 1 + tolerance
        )
        inside[left[boxed[found]]] = True
        left = np.delete(left, boxed[found])
    return inside


def distance_to_triangles(points: Array, triangle: Array) -> Array:
    """Distance [m] of each of `points` (n, 3) to the nearest of the triangles (m, 3, 3)."""
    result = np.empty(len(points))
    chunk = max(1, 400_000 // max(1, len(triangle)))
    for start in range(0, len(points), chunk):
        p = points[start : start + chunk, None, :]
        result[start : start + chunk] = np.sqrt(_squared_to_triangles(p, triangle).min(axis=1))
    return result


def _squared_to_triangles(p: Array, triangle: Array) -> Array:
    """Squared distances (n, m) of points (n, 1, 3) to triangles (m, 3, 3)."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    normal = normals(triangle)
    height = np.einsum("nmj,mj->nm", p - a, normal)
    in_prism = np.ones(height.shape, bool)
    squared = np.full(height.shape, np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        in_prism &= np.einsum("nmj,mj->nm", p - start, np.cross(normal, side)) >= 0
        share = np.einsum("nmj,mj->nm", p - start, side) / np.einsum("mj,mj->m", side, side)
        foot = start + np.clip(share, 0, 1)[..., None] * side
        squared = np.minimum(squared, ((p - foot) ** 2).sum(axis=2))
    return np.where(in_prism, height**2, squared)


def distance_between_segments(first: Array, second: Array) -> float:
    """Least distance [m] between any segment of `first` (n, 2, 3) and any of `second` (m, 2, 3)."""
    p, u = first[:, None, 0], first[:, None, 1] - first[:, None, 0]
    q, v = second[None, :, 0], second[None, :, 1] - second[None, :, 0]
    r = p - q
    a, e, b = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    c, f = (u * r).sum(-1), (v * r).sum(-1)
    determinant = a * e - b * b
    skew = determinant > 1e-12 * a * e
    s = np.where(skew, np.clip((b * f - c * e) / np.where(skew, determinant, 1), 0, 1), 0.0)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    return float(np.sqrt(((r + s[..., None] * u - t[..., None] * v) ** 2).sum(-1).min()))


def below_plane(corner: Array, level: float) -> tuple[float, Array]:
    """Volume [m3] and first moment [m4] about the origin of the part of tets `corner` (k, 4, 3)
    below z = `level`; exact."""
    pieces = _below(corner, corner[..., 2] - level)
    volume = np.abs(tet_volumes(pieces))
    return float(volume.sum()), np.asarray(volume @ pieces.mean(axis=1))


def volume_in_box(corner: Array, low: Array, high: Array) -> float:
    """Volume [m3] of the part of tetrahedra `corner` (k, 4, 3) between `low` and `high` (3); a
    bound may be infinite. Exact: each side of the box cuts tetrahedra into tetrahedra."""
    for axis in range(3):
        corner = _below(corner, corner[..., axis] - high[axis])
        corner = _below(corner, low[axis] - corner[..., axis])
    return float(np.abs(tet_volumes(corner)).sum())


def _below(corner: Array, height: Array) -> Array:
    """Tetrahedra (m, 4, 3), of either sense, that fill the part of `corner` where the linear
    function `height` (k, 4), given at their corners, is below zero."""
    order = np.argsort(height, axis=1)
    height = np.take_along_axis(height, order, axis=1)
    corner = np.take_along_axis(corner, order[..., None], axis=1)
    low = (height < 0).sum(axis=1)
    found = [corner[low == 4]]
    for n in (1, 2, 3):  # corners below the plane
        x, h = corner[low == n], height[low == n]

        def cut(a: int, b: int, x: Array = x, h: Array = h) -> Array:
            share = h[:, a] / (h[:, a] - h[:, b])
            return np.asarray(x[:, a] + share[:, None] * (x[:, b] - x[:, a]))

        if n == 1:
            found.append(np.stack([x[:, 0], cut(0, 1), cut(0, 2), cut(0, 3)], axis=1))
        elif n == 2:
            found += _prism(x[:, 0], cut(0, 2), cut(0, 3), x[:, 1], cut(1, 2), cut(1, 3))
        else:
            found += _prism(x[:, 0], x[:, 1], x[:, 2], cut(0, 3), cut(1, 3), cut(2, 3))
    return np.concatenate(found)


def _prism(*corner: Array) -> list[Array]:
    """Three tetrahedra (k, 4, 3) of prisms; corners 0, 1, 2 of one end lie along 3, 4, 5."""
    return [np.stack([corner[m] for m in c], 1) for c in ((0, 1, 2, 5), (0, 1, 5, 4), (0, 3, 4, 5))]


def feature_edges(points: Array, triangles: IntArray, cosine: float = 0.9999) -> IntArray:
    """Edges (m, 2) of a surface whose two triangles do not lie in one plane."""
    normal = normals(points[triangles])
    owners: dict[tuple[int, int], list[int]] = {}
    for t, triangle in enumerate(triangles):
        for k in range(3):
            i, j = sorted((int(triangle[k]), int(triangle[(k + 1) % 3])))
            owners.setdefault((i, j), []).append(t)
    kept = [
        edge
        for edge, faces in owners.items()
        if len(faces) != 2 or normal[faces[0]] @ normal[faces[1]] < cosine
    ]
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


def surface_samples(triangles: Array, spacing: float) -> Array:
    """Points (n, 3) on triangles (m, 3, 3), no farther apart than `spacing` [m], corners and edges
    included; what triangles share comes once for each of them."""
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    n = max(1, int(np.ceil(sides.max(initial=0.0) / spacing)))
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    keep = i + j <= n
    weight = np.stack([i[keep], j[keep], n - i[keep] - j[keep]], axis=1) / n
    return np.asarray(np.einsum("wk,mkj->mwj", weight, triangles).reshape(-1, 3))
