"""Numbers of a pile, of the true shapes at one row of a run: lengths in m, speeds in m/s."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from micstools.piles import pile_form
from micstools.reading import block_numbers, rest
from micstools.reading.overlap import Placed, images, present_bodies, touches
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import SI, Unit, Units, ascii_of
from micstools.shapes.geometry import Array


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
    porosity: float  # of the box, above the bed
    box: tuple[float, ...]  # its low and its high corner [m]
    height: float  # largest, of the top above the floor or the bed under it [m]
    layer_thickness: float  # mean of the same over the plan area [m], upright
    layer_porosity: float  # of the layer: plan area times thickness
    footprint: float  # the smallest convex plan that holds the pile [m2]


KINDS = {
    "plan_area": "area", "top": "length", "centre": "length", "spread": "length",
    "time_to_rest": "time", "impact_speed": "speed", "contact_force": "force", "slopes": "angle",
    "box": "length", "height": "length", "layer_thickness": "length", "footprint": "area",
}  # fmt: skip
"""What the numbers that have a unit are, as `Units` names it."""


def unit(units: Units, name: str) -> Unit:
    """The unit of a number by its name, as `top`, or of a part of it, as `box_x_min`."""
    kind = KINDS.get(name) or KINDS.get(name.split("_")[0], "number")
    return units.of_kind(kind)


def si_units(names: Iterable[str]) -> dict[str, str]:
    """The SI unit of each number that has one, as files hold it."""
    found = {name: ascii_of(unit(SI, name).name) for name in names}
    return {name: text for name, text in found.items() if text}


def words(units: Units, name: str, values: Iterable[float]) -> str:
    """A number by its name, or its parts, with its unit, in ASCII."""
    return ascii_of(unit(units, name).row(values, digits=5))


def numbers(
    run: Run, step: float, row: int = -1, box: tuple[Array, Array] | None = None
) -> PileNumbers:
    """The numbers of a pile; its plan area is counted on squares of `step` [m], its porosity in a
    `box`, by default that around the pile."""
    b = run.bodies
    if not b.n:
        raise BadRun(f"{run.folder} holds no blocks: there is no pile to look at")
    row = row % len(b.time)
    bodies, seen = present_bodies(run, row), touches(run, row)
    if not bodies:
        raise BadRun(f"{run.folder}: no block is let go at t = {b.time[row]:g} s: there is no pile")
    blocks = images(run, bodies.values())
    top = height_map(blocks, run.grid.low, run.grid.high, step)
    here = list(bodies)
    mass, place = b.mass[here], np.array([body.position for body in bodies.values()])
    x, y, z = (float(v) for v in (mass[:, None] * place).sum(axis=0) / mass.sum())
    low, high = box or pile_form.around(blocks, run.grid.low, run.grid.high)
    ground = ground_map(run, run.grid.low, run.grid.high, step)
    thickness, height = pile_form.layer(top, ground)
    highest = max(float(body.points[:, 2].max()) for body in blocks)
    if not len(run.bed[1]):
        height = highest - float(run.grid.low[2])  # exact
    area = float(np.isfinite(top).sum() * step**2)
    volume = sum(body.shape.volume for body in bodies.values())
    forces = [k.contact_force for k in block_numbers.of_blocks(run)]
    return PileNumbers(
        blocks=len(bodies),
        on_floor=sum(seen.on_floor(int(k)) for k in b.dropped),
        plan_area=area,
        top=highest,
        coordination=2 * len(seen.blocks) / len(bodies),
        centre=(x, y, z),
        spread=(float(place[:, 0].std()), float(place[:, 1].std())),
        time_to_rest=time_to_rest(run),
        impact_speed=impact_speed(run),
        contact_force=max(forces, default=float("nan")),
        slopes=pile_form.slopes(top, float(run.grid.low[2]), step),
        attitude_randomness=_randomness(run, row),
        porosity=pile_form.porosity(blocks, low, high, bed_volume(run, low, high, step)),
        box=tuple(float(v) for v in (*low, *high)),
        height=height,
        layer_thickness=thickness,
        layer_porosity=1 - volume / (area * thickness) if area * thickness > 0 else float("nan"),
        footprint=pile_form.footprint(top, step),
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
        _raise(top, body.triangles, low, step)
    return np.where(np.isfinite(top), top, np.nan)


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


def time_to_rest(run: Run) -> float:
    """Time [s] after which every free block stays; nan where one moves or is still to come."""
    b = run.bodies
    if not b.present(-1).all():
        return float("nan")
    return max((found.time for found in rest.of_blocks(run)), key=_nan_last, default=0.0)


def _nan_last(value: float) -> float:
    return np.inf if value != value else value


def impact_speed(run: Run) -> float:
    """Largest speed [m/s] of a dropped block in the row before its first touch; nan without one."""
    found = [block_numbers.impact_speed(run, int(k)) for k in run.bodies.dropped]
    return max((speed for speed in found if speed == speed), default=float("nan"))
