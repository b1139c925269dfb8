"""What the player of a page needs: each shape once, and of each block place and attitude at every
frame, packed in base64."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from micstools import pile
from micstools.geometry import Array, IntArray
from micstools.page.views import block_colours
from micstools.reader import Run

FRAMES_A_SECOND = 30
LONGEST = 600  # frames of a run
POSES = 400_000  # places of blocks in a page: about 9 MB of it
SURFACE_BYTES = 400_000  # of the water


def packed(values: ArrayLike, kind: str) -> str:
    """Numbers of a `kind` as f4, i2, u1, little end first, as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()


def frames(run: Run) -> IntArray:
    """Rows of the run to show, evenly in time, first and last among them."""
    time, n = run.bodies.time, max(1, run.bodies.n)
    wanted = min(LONGEST, int(FRAMES_A_SECOND * (time[-1] - time[0])) + 2, max(2, POSES // n))
    targets = np.linspace(time[0], time[-1], wanted)
    return np.unique(np.searchsorted(time, targets).clip(0, len(time) - 1))


def scene(run: Run) -> dict[str, Any]:
    """The fall of the blocks of a run, and the water."""
    return tank(run) | blocks(run, frames(run)) | {"water": water(run)}


def blocks(run: Run, rows: IntArray) -> dict[str, Any]:
    """Place, attitude, speed and contacts of the blocks at some rows."""
    b = run.bodies
    names = list(run.shapes)
    speed = np.linalg.norm(b.velocity[rows], axis=2)
    fastest = float(np.nanmax(speed, initial=0.0)) or 1.0
    colours = block_colours(b.dropped, b.n)
    return {
        "bodies": [
            {
                "number": k + 1,
                "shape": names.index(b.shape[k]),
                "fixed": bool(b.fixed[k]),
                "colour": colours[k + 1],
                "release": _known(b.release_time[k]),
            }
            for k in range(b.n)
        ],
        "times": packed(b.time[rows], "f4"),
        "place": packed(run.into_tank(b.position[rows]), "f4"),
        "turn": packed(np.round(32767 * unit(b.quaternion[rows])), "i2"),
        "speed": packed(np.round(255 * np.nan_to_num(speed) / fastest), "u1"),
        "fastest": fastest,
        "contacts": packed(b.contacts[rows].clip(0, 255), "u1"),
    }


def _known(release: float) -> float | None:
    """A release time; none for a block that never came in."""
    return float(release) if np.isfinite(release) else None


def unit(quaternion: Array) -> Array:
    """Quaternions (..., 4) of length one."""
    return np.asarray(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))


def tank(run: Run) -> dict[str, Any]:
    """What stands still: the tank, the bed, and the shapes."""
    points, triangles = run.bed
    return {
        "low": run.grid.low.tolist(),
        "high": run.grid.high.tolist(),
        "shapes": [_surface_of(s.points, s.triangles, s.edges) for s in run.shapes.values()],
        "bed": _surface_of(points, triangles, triangles[:0]) if len(triangles) else None,
    }


def _surface_of(points: Array, triangles: IntArray, edges: IntArray) -> dict[str, str]:
    """Corners, triangles and the edges at which a surface bends."""
    return {
        "points": packed(points, "f4"),
        "triangles": packed(triangles, "u4"),
        "edges": packed(edges, "u4"),
    }


def water(run: Run) -> dict[str, Any] | None:
    """The surface: its height over the plan at the written times, a byte each; without fields, or
    where currents make it, a level; none in a dry run, a full one, or without a level."""
    if pile.has_level(run):
        return _surface(run)
    level = pile.still_level(run)
    return None if level is None else {"level": level}


def _surface(run: Run) -> dict[str, Any]:
    """Mean height of the water in each column of cells, in fewer frames and columns where the
    whole would be too much."""
    grid = run.grid
    nx, ny = len(grid.x) - 1, len(grid.y) - 1
    coarse = max(1, int(np.ceil(max(nx, ny) / 80)))
    i, j = np.arange(0, nx, coarse), np.arange(0, ny, coarse)
    every = max(1, int(np.ceil(run.field_times.size * i.size * j.size / SURFACE_BYTES)))
    times = run.field_times[::every]
    height = np.array([_columns(run, float(t))[np.ix_(j, i)] for t in times])
    low, high = float(height.min()), float(height.max())
    span = high - low or 1.0
    x, y, _ = grid.centres
    return {
        "times": packed(times, "f4"),
        "x": packed(_to_ends(x[i], grid.x), "f4"),
        "y": packed(_to_ends(y[j], grid.y), "f4"),
        "height": packed(np.round(255 * (height - low) / span), "u1"),
        "low": low,
        "span": span,
    }


def _to_ends(centres: Array, faces: Array) -> Array:
    """Centres of cells, the first and last moved to the walls, so that the surface reaches them."""
    found = np.array(centres)
    if len(found) > 1:
        found[0], found[-1] = faces[0], faces[-1]
    return found


def _columns(run: Run, t: float) -> Array:
    """Height (ny, nx) [m] at which the water of each column would stand; a block counts as the
    water around it."""
    height = np.diff(run.grid.z)[:, None, None]
    return np.asarray(run.grid.z[0] + (run.fields(t).liquid * height).sum(axis=0))
