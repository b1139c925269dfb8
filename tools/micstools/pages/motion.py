"""What the player of a page needs: each shape once, and of each block place and attitude at every
frame, packed in base64."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from micstools.pages.views import block_colours
from micstools.piles import pile
from micstools.reading import units
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray

FRAMES_A_SECOND = 30
FEWEST, LONGEST = 60, 600  # frames of a run
POSES = 400_000  # places of blocks in a page: about 9 MB of it
SURFACE_BYTES = 400_000  # of the water
SPEED_BYTES = 400_000  # of its speed
FINEST = 80  # columns of the water along the tank
Columns = dict[float, Array]
"""Height of the water in each column of cells (ny, nx) [m] by the time [s]."""
WALL = 3.0  # lengths of the longest free block: a longer fixed body is a wall
STEADY = 0.05  # [s] before and after a frame in which contacts count: they come and go
FASTEST = 99.5  # per cent of the maps below the speed of the last colour: splashes are faster


def packed(values: ArrayLike, kind: str) -> str:
    """Numbers of a `kind` as f4, i2, u1, little end first, as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()


def frames(run: Run) -> IntArray:
    """Rows of the run to show, evenly in time, first and last among them."""
    time, n = run.bodies.time, max(1, run.bodies.n)
    usual = max(FEWEST, int(FRAMES_A_SECOND * (time[-1] - time[0])) + 2)
    wanted = min(LONGEST, usual, max(2, POSES // n))
    targets = np.linspace(time[0], time[-1], wanted)
    return np.unique(np.searchsorted(time, targets).clip(0, len(time) - 1))


def scene(run: Run, north: float | None = None) -> dict[str, Any]:
    """The fall of the blocks of a run, and the water; `north`: as of `tank`."""
    return tank(run, north) | blocks(run, frames(run)) | {"water": water(run)}


def moving(run: Run, seen: Columns) -> dict[str, Any]:
    """What has moved in a run that goes on, and the water without its speed; `seen`: of frames that
    were read before."""
    return blocks(run, frames(run)) | {"water": level(run, seen)}


def blocks(run: Run, rows: IntArray) -> dict[str, Any]:
    """Place, attitude, speed and contacts of the blocks at some rows."""
    b = run.bodies
    names = list(run.shapes)
    walls = walls_of(run)
    speed = np.linalg.norm(b.velocity[rows], axis=2)
    fastest = float(np.nanmax(speed, initial=0.0)) or 1.0
    colours = block_colours(b.dropped, b.n)
    # A block that is not there yet stands where it is first shown, not where it waits
    early = b.time[rows][:, None] < b.entry_time - 1e-12
    first = rows[early.sum(axis=0).clip(max=len(rows) - 1)]
    place = np.where(early[..., None], b.position[first, np.arange(b.n)], b.position[rows])
    return {
        "bodies": [
            {
                "number": b.name[k] or k + 1,
                "shape": names.index(b.shape[k]),
                "fixed": bool(b.fixed[k]),
                "wall": k in walls,
                "colour": colours[k + 1],
                "release": _known(b.entry_time[k]),
                "exit": _known(b.exit_time[k]),
            }
            for k in range(b.n)
        ],
        "times": packed(b.time[rows], "f4"),
        "place": packed(run.into_tank(place) - run.grid.low, "f4"),
        "turn": packed(np.round(32767 * unit(b.quaternion[rows])), "i2"),
        "speed": packed(np.round(255 * np.nan_to_num(speed) / fastest), "u1"),
        "fastest": fastest,
        "contacts": packed(_steady(b.time, b.contacts, rows).clip(0, 255), "u1"),
    }


def walls_of(run: Run) -> set[int]:
    """Numbers, from 0, of the fixed bodies that are so long that they are walls to the free
    ones."""
    b = run.bodies
    length = np.array([run.shapes[name].length for name in b.shape])
    if not (~b.fixed).any():
        return set()
    longest = length[~b.fixed].max()
    return {int(k) for k in np.flatnonzero(b.fixed & (length > WALL * longest))}


def _steady(time: Array, values: IntArray, rows: IntArray) -> IntArray:
    """The largest value (rows, n) within `STEADY` of each of the rows."""
    first = np.searchsorted(time, time[rows] - STEADY)
    last = np.searchsorted(time, time[rows] + STEADY, side="right")
    return np.array([values[a:b].max(axis=0) for a, b in zip(first, last, strict=True)])


def _known(release: float) -> float | None:
    """A release time; none for a block that never came in."""
    return float(release) if np.isfinite(release) else None


def unit(quaternion: Array) -> Array:
    """Quaternions (..., 4) of length one."""
    return np.asarray(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))


def tank(run: Run, north: float | None = None) -> dict[str, Any]:
    """What stands still: the tank, the bed, and the shapes. `north`: its direction in the plan,
    degrees from +y towards +x; +y where it is not known. Places count from the lower corner of the
    tank, the `origin`: single precision would not hold coordinates of a survey."""
    points, triangles = bed(run)
    used, low = units.of_run(run), run.grid.low
    return {
        "unit": vars(used.length) | {"decimals": used.place.decimals},
        "north": north or 0.0,
        "period": run.period.tolist(),
        "origin": low.tolist(),
        "size": (run.grid.high - low).tolist(),
        "shapes": [_surface_of(s.points, s.triangles, s.edges) for s in run.shapes.values()],
        "bed": _surface_of(points - low, triangles, triangles[:0]) if len(triangles) else None,
    }


def bed(run: Run) -> tuple[Array, IntArray]:
    """Corners (n, 3) [m] and triangles (m, 3) of the bed, with the sides that one sees where the
    tank cuts it, from its surface down to the floor."""
    points, triangles = run.bed
    if not len(triangles):
        return points, triangles
    low, high = run.grid.low, run.grid.high
    inside = 1e-6 * (high - low)  # a bed often ends at the wall
    sides = []
    for d in (0, 1):
        for at, outward in ((low[d] + inside[d], -1.0), (high[d] - inside[d], 1.0)):
            across = section(points[triangles], d, at)
            other = 1 - d
            kept = (across[:, :, other] >= low[other] - inside[other]).all(axis=1) & (
                across[:, :, other] <= high[other] + inside[other]
            ).all(axis=1)
            sides.append(_down_to(across[kept], low[2], d, outward))
    walls = np.concatenate(sides)
    corners = np.arange(3 * len(walls)).reshape(-1, 3) + len(points)
    return np.concatenate([points, walls.reshape(-1, 3)]), np.concatenate([triangles, corners])


def section(surface: Array, d: int, at: float) -> Array:
    """Lines (k, 2, 3) in which a plane, coordinate `d` = `at`, cuts triangles (m, 3, 3) [m]."""
    above = surface[:, :, d] > at
    cut = surface[above.any(axis=1) & ~above.all(axis=1)]
    found = np.empty((len(cut), 2, 3))
    filled = np.zeros(len(cut), dtype=int)
    for k in range(3):
        p, q = cut[:, k], cut[:, (k + 1) % 3]
        here = np.flatnonzero((p[:, d] > at) != (q[:, d] > at))
        share = (at - p[here, d]) / (q[here, d] - p[here, d])
        found[here, filled[here]] = p[here] + share[:, None] * (q[here] - p[here])
        filled[here] += 1
    return found


def _down_to(lines: Array, floor: float, d: int, outward: float) -> Array:
    """Triangles (2 k, 3, 3) from lines (k, 2, 3) down to a floor; they face along `d`."""
    p, q = lines[:, 0], lines[:, 1]
    below = [np.array(end) for end in (p, q)]
    for end in below:
        end[:, 2] = floor
    found = np.concatenate([np.stack([p, q, below[1]], 1), np.stack([p, below[1], below[0]], 1)])
    normal = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, d]
    turned = normal * outward < 0
    found[turned] = found[turned][:, ::-1]
    return found


def _surface_of(points: Array, triangles: IntArray, edges: IntArray) -> dict[str, str]:
    """Corners, triangles and the edges at which a surface bends."""
    return {
        "points": packed(points, "f4"),
        "triangles": packed(triangles, "u4"),
        "edges": packed(edges, "u4"),
    }


def water(run: Run) -> dict[str, Any] | None:
    """The surface and, with fields, the speed of the water; none in a dry run, a full one, or
    without a level."""
    found = level(run, {})
    if found is None or not run.field_times.size:
        return found
    return found | {"speed": speeds(run)}


def level(run: Run, seen: Columns) -> dict[str, Any] | None:
    """The surface: its height over the plan at the written times, a byte each; without fields, or
    where currents make it, a level. `seen`: of frames that were read before."""
    if pile.has_level(run):
        return _surface(run, seen)
    still = pile.still_level(run)
    return None if still is None else {"level": still - float(run.grid.low[2])}


def speeds(run: Run) -> dict[str, Any]:
    """Speed of the water at the written times, a byte each, which is the root of its share of the
    `fastest` [m/s]: in the plan that at the surface, seen from the front and the side the largest
    on the way across; in fewer frames and cells where the whole would be too much."""
    shape = np.array([len(faces) - 1 for faces in run.grid.faces])
    i, j, k = (slice(None, None, n) for n in np.maximum(1, np.ceil(shape / FINEST).astype(int)))
    first = _speed_maps(run, float(run.field_times[0]), (i, j, k))
    size = sum(values.size for values in first.values())
    every = max(1, int(np.ceil(run.field_times.size * size / SPEED_BYTES)))
    times = run.field_times[::every]
    maps = [first, *(_speed_maps(run, float(t), (i, j, k)) for t in times[1:])]
    whole = {name: np.array([found[name] for found in maps]) for name in first}
    moving = np.concatenate([values[values > 0] for values in whole.values()])
    fastest = float(np.percentile(moving, FASTEST)) if moving.size else 1.0
    return {"times": packed(times, "f4"), "fastest": fastest} | {
        name: {
            "nx": values.shape[2],
            "ny": values.shape[1],
            "values": packed(np.round(255 * np.sqrt((values / fastest).clip(0, 1))), "u1"),
        }
        for name, values in whole.items()
    }


def _speed_maps(run: Run, t: float, kept: tuple[slice, slice, slice]) -> dict[str, Array]:
    """Speeds [m/s]: plan (ny, nx), front (nz, nx), side (nz, ny), of the cells that are kept; 0
    where there is no water."""
    fields = run.fields_at(t)
    wet = (fields.liquid > 0.5) & (fields.solid < 0.5)
    speed = np.where(wet, np.linalg.norm(fields.velocity, axis=3), 0.0)
    top = len(wet) - 1 - np.argmax(wet[::-1], axis=0)
    i, j, k = kept
    plan = np.take_along_axis(speed, top[None], axis=0)[0]
    return {"plan": plan[j, i], "front": speed.max(axis=1)[k, i], "side": speed.max(axis=2)[k, j]}


def _surface(run: Run, seen: Columns) -> dict[str, Any]:
    """Mean height of the water in each column of cells, in fewer frames and columns where the
    whole would be too much."""
    grid = run.grid
    nx, ny = len(grid.x) - 1, len(grid.y) - 1
    coarse = max(1, int(np.ceil(max(nx, ny) / FINEST)))
    i, j = np.arange(0, nx, coarse), np.arange(0, ny, coarse)
    every = max(1, int(np.ceil(run.field_times.size * i.size * j.size / SURFACE_BYTES)))
    times = run.field_times[::every]
    for t in set(times.tolist()) - set(seen):
        # a block counts as the water around it
        seen[t] = (run.fields_at(t).liquid * np.diff(grid.z)[:, None, None]).sum(axis=0)
    height = np.array([seen[t][np.ix_(j, i)] for t in times.tolist()])
    low, high = float(height.min()), float(height.max())
    span = high - low or 1.0
    x, y, _ = grid.centres
    x, y = _to_ends(x[i], grid.x) - grid.x[0], _to_ends(y[j], grid.y) - grid.y[0]
    return {
        "times": packed(times, "f4"),
        "x": packed(x, "f4"),
        "y": packed(y, "f4"),
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
