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
    """Triangles (n - 2, 3) between the n points around a plane hole, ear by ear."""
    corner = points[loop] - points[loop].mean(axis=0)
    axes = np.linalg.svd(corner)[2]
    if np.abs(corner @ axes[2]).max() > flat:
        raise NotPlane(f"the hole between {len(loop)} edges is not plane")
    flat_corner = corner @ axes[:2].T
    if _area(*flat_corner.T) < 0:
        flat_corner[:, 1] *= -1
    left, found = list(range(len(loop))), []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(flat_corner, left, k)), None)
        if ear is None:
            raise NotPlane(f"the border of the hole between {len(loop)} edges crosses itself")
        found.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.asarray(np.array(loop)[np.array([*found, left])])


def _area(x: Array, y: Array) -> float:
    """Twice the area of a polygon, positive counter-clockwise."""
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _is_ear(corner: Array, left: list[int], k: int) -> bool:
    """Can the corner number k of the polygon `left` be cut off?"""
    ends = [left[k - 1], left[k], left[(k + 1) % len(left)]]
    ear = corner[ends]
    area = _area(*ear.T)
    if area <= 1e-12 * float(np.ptp(corner, axis=0).max()) ** 2:
        return False
    others = corner[[m for m in left if m not in ends]]
    sides = [
        (ear[n - 2, 0] - ear[n, 0]) * (others[:, 1] - ear[n, 1])
        - (ear[n - 2, 1] - ear[n, 1]) * (others[:, 0] - ear[n, 0])
        for n in range(3)
    ]
    return not bool((np.min(sides, axis=0) >= -1e-12 * area).any())
