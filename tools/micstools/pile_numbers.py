"""Numbers of a pile, of the true shapes at one row of a run: lengths in m, speeds in m/s."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from micstools import block_numbers, pile_form
from micstools.geometry import Array
from micstools.overlap import Placed, images, present_bodies, touches
from micstools.pile import REACH
from micstools.reader import BadRun, Run


@dataclass(frozen=True)
class PileNumbers:
    """What is counted and measured of a pile."""

    blocks: int  # released
    on_floor: int  # of them, dropped and touching the floor or the bed
    plan_area: float  # covered, seen from above [m2]
    top: float  # highest point [m]
    coordination: float  # blocks that touch a block, on average
    centre: tuple[float, float, float]  # of mass [m]
    spread: tuple[float, float]  # standard deviation of the centroids in x and y [m]
    time_to_rest: float  # [s]; nan where the blocks still move
    impact_speed: float  # largest speed of a dropped block at its first touch [m/s]
    contact_force: float  # largest on a dropped block, a mean over a step [N]
    slopes: tuple[float, float, float, float]  # of the sides towards -x, +x, -y, +y [degrees]
    attitude_randomness: float  # of the free blocks of the commonest shape; 0 alike, 1 random
    porosity: float  # of the box; nan where a bed may fill part of it
    box: tuple[float, ...]  # its low and its high corner [m]


def numbers(
    run: Run, step: float, row: int = -1, box: tuple[Array, Array] | None = None
) -> PileNumbers:
    """The numbers of a pile; its plan area is counted on squares of `step` [m], its porosity in a
    `box`, by default that around the pile."""
    b = run.bodies
    if not b.n:
        raise BadRun(f"{run.folder} holds no blocks: there is no pile to look at")
    row = row % len(b.time)
    bodies, seen = present_bodies(run, row), touches(run, row, REACH)
    if not bodies:
        raise BadRun(f"{run.folder}: no block is let go at t = {b.time[row]:g} s: there is no pile")
    blocks = images(run, bodies.values())
    top = height_map(blocks, run.grid.low, run.grid.high, step)
    here = list(bodies)
    mass, place = b.mass[here], np.array([body.position for body in bodies.values()])
    x, y, z = (float(v) for v in (mass[:, None] * place).sum(axis=0) / mass.sum())
    low, high = box or pile_form.around(blocks, run.grid.low, run.grid.high)
    known = box is not None or not len(run.bed[1])
    forces = [k.contact_force for k in block_numbers.of_blocks(run)]
    return PileNumbers(
        blocks=len(bodies),
        on_floor=sum(seen.on_floor(int(k)) for k in b.dropped),
        plan_area=float(np.isfinite(top).sum() * step**2),
        top=max(float(body.points[:, 2].max()) for body in blocks),
        coordination=2 * len(seen.blocks) / len(bodies),
        centre=(x, y, z),
        spread=(float(place[:, 0].std()), float(place[:, 1].std())),
        time_to_rest=time_to_rest(run, block_numbers.REST_SPEED),
        impact_speed=impact_speed(run),
        contact_force=max(forces, default=float("nan")),
        slopes=pile_form.slopes(top, float(run.grid.low[2]), step),
        attitude_randomness=_randomness(run, row),
        porosity=pile_form.porosity(blocks, low, high) if known else float("nan"),
        box=tuple(float(v) for v in (*low, *high)),
    )


def _randomness(run: Run, row: int) -> float:
    """How differently the free blocks of the commonest shape lie."""
    b = run.bodies
    free = [int(k) for k in b.dropped if b.present(row)[k]]
    if not free:
        return float("nan")
    ((name, _),) = Counter(b.shape[k] for k in free).most_common(1)
    alike = [k for k in free if b.shape[k] == name]
    return pile_form.attitude_randomness(run.shapes[name], b.quaternion[row, alike])


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
        for triangle in body.triangles:
            patch = under(triangle, low, step, top.shape)
            if patch is not None:
                rows, columns, heights = patch
                np.maximum(top[rows, columns], heights, out=top[rows, columns])
    return np.where(np.isfinite(top), top, np.nan)


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


def time_to_rest(run: Run, rest_speed: float) -> float:
    """Time [s] after which no released block is faster than `rest_speed` [m/s]."""
    b = run.bodies
    fast = (np.linalg.norm(b.velocity[:, ~b.fixed], axis=2) >= rest_speed).any(axis=1)
    if fast[-1] or not b.present(-1).all():
        return float("nan")
    moving = np.flatnonzero(fast)
    return float(b.time[moving[-1] + 1]) if moving.size else float(b.time[0])


def impact_speed(run: Run) -> float:
    """Largest speed [m/s] of a dropped block in the row before its first touch; nan without one."""
    found = [block_numbers.impact_speed(run, int(k)) for k in run.bodies.dropped]
    return max((speed for speed in found if speed == speed), default=float("nan"))
