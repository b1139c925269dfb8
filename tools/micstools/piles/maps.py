"""Heights of blocks and bed above the squares of a plan, of the true shapes."""

import numpy as np

from micstools.reading.overlap import Placed, images, present_bodies, without_machines
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray


def usual_step(run: Run) -> float:
    """Size of the squares of a map where none is asked for, a 300th of the tank [m]."""
    return float((run.grid.high - run.grid.low)[:2].max()) / 300


def top_of(run: Run, step: float, row: int = -1) -> Array:
    """Height map of the pile of a run at a row, as the tank shows it, without machines."""
    blocks = images(run, without_machines(run, present_bodies(run, row)).values())
    return height_map(blocks, run.grid.low, run.grid.high, step)


def height_map(bodies: list[Placed], low: Array, high: Array, step: float) -> Array:
    """Top of the blocks (ny, nx) [m] above the middle of each square; nan where there is none."""
    n = np.maximum(1, np.round((high[:2] - low[:2]) / step).astype(int))
    top = np.full((n[1], n[0]), -np.inf)
    if bodies:
        triangles = np.concatenate([body.triangles for body in bodies])
        # Those (m, 3, 3) of a closed surface that are seen from above
        u, v = (triangles[:, k, :2] - triangles[:, 0, :2] for k in (1, 2))
        _raise(top, np.asarray(triangles[u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0]]), low, step)
    return np.where(np.isfinite(top), top, np.nan)


def _raise(top: Array, triangles: Array, low: Array, step: float) -> None:
    """Raise a map (ny, nx) to triangles (m, 3, 3) where these are higher."""
    square, height, _ = under(triangles, low, step, top.shape)
    np.maximum.at(top.reshape(-1), square, height)


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
    triangles: Array, low: Array, step: float, shape: tuple[int, ...]
) -> tuple[IntArray, Array, IntArray]:
    """What lies below or above triangles (m, 3, 3), of the squares of `step` [m] from the corner
    `low`, `shape` rows and columns of them: for each triangle and square whose middle it covers the
    number of the square, the height of the triangle [m] and its number. Upright ones cover none."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    first = np.ceil((triangles[..., :2].min(axis=1) - low[:2]) / step - 0.5).astype(int)
    last = np.floor((triangles[..., :2].max(axis=1) - low[:2]) / step - 0.5).astype(int)
    first, last = np.maximum(first, 0), np.minimum(last, np.array(shape)[::-1] - 1)
    covers = np.flatnonzero((area != 0) & (last >= first).all(axis=1))
    size = last[covers] - first[covers] + 1
    found: list[tuple[Array, ...]] = [(np.empty(0, int), np.empty(0), np.empty(0, int))]
    for wide, high in np.unique(size, axis=0):
        alike = covers[(size == (wide, high)).all(axis=1)]
        per = max(1, 2_000_000 // int(wide * high))
        for k in (alike[start : start + per] for start in range(0, len(alike), per)):
            column = first[k, 0, None, None] + np.arange(wide)
            row = first[k, 1, None, None] + np.arange(high)[:, None]
            x = low[0] + (column + 0.5) * step - a[k, 0, None, None]
            y = low[1] + (row + 0.5) * step - a[k, 1, None, None]
            (ux, uy, uz), (vx, vy, vz) = u[k].T[..., None, None], v[k].T[..., None, None]
            s, t = (x * vy - y * vx) / area[k, None, None], (y * ux - x * uy) / area[k, None, None]
            inside = (s >= -1e-12) & (t >= -1e-12) & (s + t <= 1 + 1e-12)
            height = a[k, 2, None, None] + s * uz + t * vz
            which = np.broadcast_to(k[:, None, None], inside.shape)
            found.append(((row * shape[1] + column)[inside], height[inside], which[inside]))
    square, height, which = (np.concatenate(part) for part in zip(*found, strict=True))
    return square, height, which
