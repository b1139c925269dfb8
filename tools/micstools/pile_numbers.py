"""Numbers of a pile, of the true shapes at one row of a run: lengths in m, speeds in m/s."""

from dataclasses import dataclass

import numpy as np

from micstools import block_numbers
from micstools.geometry import Array
from micstools.overlap import Placed, present_bodies, touches
from micstools.pile import REACH
from micstools.reader import BadRun, Run


@dataclass(frozen=True)
class PileNumbers:
    """What is counted and measured of a pile."""

    blocks: int  # released
    on_floor: int  # of them, dropped and touching the floor
    plan_area: float  # covered, seen from above [m2]
    top: float  # highest point [m]
    coordination: float  # blocks that touch a block, on average
    centre: tuple[float, float, float]  # of mass [m]
    spread: tuple[float, float]  # standard deviation of the centroids in x and y [m]
    time_to_rest: float  # [s]; nan where the blocks still move
    impact_speed: float  # largest speed of a dropped block at its first touch [m/s]


def numbers(
    run: Run, step: float, row: int = -1, rest_speed: float = block_numbers.REST_SPEED
) -> PileNumbers:
    """The numbers of a pile; its plan area is counted on squares of `step` [m]."""
    b = run.bodies
    if not b.n:
        raise BadRun(f"{run.folder} holds no blocks: there is no pile to look at")
    row = row % len(b.time)
    bodies, seen = present_bodies(run, row), touches(run, row, REACH)
    covered = np.isfinite(height_map(list(bodies.values()), run.grid.low, run.grid.high, step))
    here = list(bodies)
    mass, place = b.mass[here], b.position[row, here]
    spread = place[:, :2].std(axis=0)
    centre = (mass[:, None] * place).sum(axis=0) / mass.sum()
    return PileNumbers(
        blocks=len(bodies),
        on_floor=sum("z_min" in seen.walls_of(int(k)) for k in b.dropped if int(k) in bodies),
        plan_area=float(covered.sum() * step**2),
        top=max(float(body.points[:, 2].max()) for body in bodies.values()),
        coordination=2 * len(seen.blocks) / len(bodies),
        centre=(float(centre[0]), float(centre[1]), float(centre[2])),
        spread=(float(spread[0]), float(spread[1])),
        time_to_rest=time_to_rest(run, rest_speed),
        impact_speed=impact_speed(run),
    )


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
