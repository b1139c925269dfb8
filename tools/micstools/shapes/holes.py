"""Plane holes of a surface, closed exactly by triangles between the points on their border."""

import numpy as np

from micstools.shapes.geometry import Array, IntArray

FLAT = 1e-5
"""How far the border of a plane hole may lie from its plane, over the length of the surface; single
precision of an STL file moves points by less."""


class NotPlane(Exception):
    """A hole has no one exact filling; the text says why."""


def fill(points: Array, triangles: IntArray) -> tuple[IntArray, int]:
    """Triangles (m, 3) with those that close all holes, and the number of holes; triangles that
    turn all the same way stay so. A hole that is not plane, or touches another, is refused."""
    loops = _borders(triangles)
    length = float(np.ptp(points, axis=0).max())
    new = [_closed(points, loop, FLAT * length) for loop in loops]
    return np.concatenate([triangles, *new]), len(loops)


def _borders(triangles: IntArray) -> list[list[int]]:
    """Points around each hole, in the sense in which triangles that fill it turn."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    sorted_edges = np.sort(edges, axis=1)
    _, place, count = np.unique(sorted_edges, axis=0, return_inverse=True, return_counts=True)
    single = edges[count[place.ravel()] == 1]
    if count.max() > 2:
        raise NotPlane("more than two triangles meet at an edge")
    beside: dict[int, list[int]] = {}
    for a, b in single.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    if any(len(ends) != 2 for ends in beside.values()):
        raise NotPlane("two holes meet at a point")
    loops, seen = [], set()
    for a, b in single.tolist():
        if a in seen:
            continue
        loop = [b, a]  # against the triangle on the other side of the edge
        while (following := sum(beside[loop[-1]]) - loop[-2]) != b:
            loop.append(following)
        seen.update(loop)
        loops.append(loop)
    return loops


def _closed(points: Array, loop: list[int], flat: float) -> IntArray:
    """Triangles (n - 2, 3) between the n points around a plane hole."""
    import manifold3d

    corner = points[loop] - points[loop].mean(axis=0)
    axes = np.linalg.svd(corner)[2]
    if np.abs(corner @ axes[2]).max() > flat:
        raise NotPlane(f"the hole between {len(loop)} edges is not plane")
    plan = corner @ axes[:2].T
    if _area(plan) < 0:
        plan[:, 1] *= -1
    found = np.asarray(manifold3d.triangulate([plan]), np.int64)
    area = np.array([_area(plan[triangle]) for triangle in found])
    if len(found) != len(loop) - 2 or area.min() <= 0:
        raise NotPlane(f"the border of the hole between {len(loop)} edges crosses itself")
    return np.array(loop)[found]


def _area(corner: Array) -> float:
    """Twice the area of a polygon (n, 2), positive counter-clockwise."""
    x, y = corner.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
