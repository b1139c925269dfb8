"""Heights of blocks and bed above the squares of a plan, of the true shapes."""

import numpy as np

from micstools.reading.overlap import Placed, images, present_bodies
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array


def usual_step(run: Run) -> float:
    """Size of the squares of a map where none is asked for, a 300th of the tank [m]."""
    return float((run.grid.high - run.grid.low)[:2].max()) / 300


def top_of(run: Run, step: float, row: int = -1) -> Array:
    """Height map of the pile of a run at a row, as the tank shows it."""
    blocks = images(run, present_bodies(run, row).values())
    return height_map(blocks, run.grid.low, run.grid.high, step)


def height_map(bodies: list[Placed], low: Array, high: Array, step: float) -> Array:
    """Top of the blocks (ny, nx) [m] above the middle of each square; nan where there is none."""
    n = np.maximum(1, np.round((high[:2] - low[:2]) / step).astype(int))
    top = np.full((n[1], n[0]), -np.inf)
    for body in bodies:
        _raise(top, _facing_up(body.triangles), low, step)
    return np.where(np.isfinite(top), top, np.nan)


def _facing_up(triangles: Array) -> Array:
    """Those (m, 3, 3) of a closed surface that are seen from above."""
    u, v = (triangles[:, k, :2] - triangles[:, 0, :2] for k in (1, 2))
    return np.asarray(triangles[u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0]])


def _raise(top: Array, triangles: Array, low: Array, step: float) -> None:
    """Raise a map (ny, nx) to triangles (m, 3, 3) where these are higher."""
    high = low[:2] + step * np.array(top.shape[::-1])
    over = (triangles[..., :2].max(axis=1) >= low[:2]) & (triangles[..., :2].min(axis=1) <= high)
    for triangle in triangles[over.all(axis=1)]:
        patch = under(triangle, low, step, top.shape)
        if patch is not None:
            rows, columns, heights = patch
            np.maximum(top[rows, columns], heights, out=top[rows, columns])


def ground_map(run: Run, low: Array, high: Array, step: float) -> Array:
    """Height (ny, nx) [m] of the bed above the middle of each square of `step` [m] between the
    corners, of the floor of the tank where there is none."""
    n = np.maximum(1, np.round((high[:2] - low[:2]) / step).astype(int))
    ground = np.full((n[1], n[0]), float(run.grid.low[2]))
    points, triangles = run.bed
    if len(triangles):
        _raise(ground, points[triangles], low, step)
    return ground


def bed_volume(run: Run, low: Array, high: Array, step: float) -> float:
    """Volume [m3] of the bed in a box, from its heights on squares of about `step` [m]."""
    if not len(run.bed[1]):
        return 0.0
    step = min(step, float((high - low)[:2].min()))
    ground = ground_map(run, low, high, step)
    inside = np.clip(ground, low[2], high[2]) - low[2]
    return float(inside.mean() * np.prod((high - low)[:2]))


def under(
    triangle: Array, low: Array, step: float, shape: tuple[int, ...]
) -> tuple[slice, slice, Array] | None:
    """Rows and columns of the squares of `step` [m] from the corner `low` whose middles lie below
    or above a triangle (3, 3), and its height above each; -inf beside it, None for an upright
    one."""
    a, u, v = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
    area = u[0] * v[1] - u[1] * v[0]
    if area == 0:
        return None
    first = np.ceil((triangle[:, :2].min(axis=0) - low[:2]) / step - 0.5).astype(int)
    last = np.floor((triangle[:, :2].max(axis=0) - low[:2]) / step - 0.5).astype(int)
    first, last = np.maximum(first, 0), np.minimum(last, np.array(shape)[::-1] - 1)
    if (last < first).any():
        return None
    x = low[0] + (np.arange(first[0], last[0] + 1) + 0.5) * step - a[0]
    y = low[1] + (np.arange(first[1], last[1] + 1) + 0.5)[:, None] * step - a[1]
    s, t = (x * v[1] - y * v[0]) / area, (y * u[0] - x * u[1]) / area
    inside = (s >= -1e-12) & (t >= -1e-12) & (s + t <= 1 + 1e-12)
    heights = np.where(inside, a[2] + s * u[2] + t * v[2], -np.inf)
    return slice(first[1], last[1] + 1), slice(first[0], last[0] + 1), heights
