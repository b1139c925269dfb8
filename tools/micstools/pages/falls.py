"""How the blocks of a set-up will fall, before anything is computed: heights, depths, speeds.

In air a block falls freely, v^2 = v_0^2 + 2 g h. Under water its speed after the way z is an
estimate: weight, buoyancy and a drag coefficient C on the mean projected area A, with the added
mass of a sphere,

    v^2 = v_t^2 + (v_0^2 - v_t^2) exp(-C A z / ((s + 0.5) V)),   v_t^2 = 2 (s - 1) g V / (C A),

s the density over that of the liquid. C = 0.42 10^(0.4 (-log10 f)^0.2) with the sphericity f:
A. Hoelzer, M. Sommerfeld (2008), Powder Technology 184, 361, for high Reynolds numbers; resolved
falls of armour units are within 20 % of it in drag (verification/cases/settling_units). In 'light'
C is `drag_coefficient` and A a third of the surface.
"""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray, place
from micstools.shapes.shape import Shape

Lines = list[tuple[str, list[str]]]
"""A name and what is said of it."""

_MOST = 20  # groups &drop that are told
_POINTS = 128  # of the raster of a shadow, in each direction
_DIRECTIONS = [d for d in product((-1, 0, 1), repeat=3) if d > (0, 0, 0)]


def mean_shadow(shape: Shape) -> float:
    """Area of the shadow of a shape, the mean over thirteen directions [m2]."""
    return float(np.mean([_shadow(shape, np.array(d, float)) for d in _DIRECTIONS]))


def _shadow(shape: Shape, direction: Array) -> float:
    """Area of the shadow along a direction, on a raster [m2]."""
    direction = direction / np.linalg.norm(direction)
    u = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    u /= np.linalg.norm(u)
    flat = shape.points @ np.stack([u, np.cross(direction, u)], axis=1)
    step = 2 * shape.radius / _POINTS
    at = (np.arange(_POINTS) + 0.5) * step - shape.radius
    dark = np.zeros((_POINTS, _POINTS), bool)
    for corner in flat[shape.triangles]:
        low, high = np.searchsorted(at, corner.min(axis=0)), np.searchsorted(at, corner.max(axis=0))
        x, y = at[low[0] : high[0], None], at[None, low[1] : high[1]]
        sides = [
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
            for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True)
        ]
        inside = np.all(np.array(sides) >= 0, axis=0) | np.all(np.array(sides) <= 0, axis=0)
        dark[low[0] : high[0], low[1] : high[1]] |= inside
    return float(dark.sum() * step**2)


def surface(shape: Shape) -> float:
    """Area of the surface of a shape [m2]."""
    a, b, c = (shape.points[shape.triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def drag_coefficient(volume: float, area: float) -> float:
    """Of a block with this surface [m2], on its mean projected area: Hoelzer and Sommerfeld."""
    sphericity = min(1.0, (np.pi * (6 * volume) ** 2) ** (1 / 3) / area)
    return float(0.42 * 10 ** (0.4 * max(0.0, -np.log10(sphericity)) ** 0.2))


def terminal_speed(s: float, volume: float, drag_area: float, g: float) -> float:
    """At which weight, buoyancy and drag are in balance [m/s]; s > 1."""
    return float(np.sqrt(2 * (s - 1) * volume * g / drag_area))


def speed_after_air(start: float, g: float, height: float) -> float:
    """After a free fall [m/s]."""
    return float(np.sqrt(start**2 + 2 * g * height))


def speed_after_water(
    s: float, volume: float, drag_area: float, g: float, start: float, way: float
) -> float:
    """After a way [m] down through still liquid [m/s]."""
    end = terminal_speed(s, volume, drag_area, g)
    return float(
        np.sqrt(end**2 + (start**2 - end**2) * np.exp(-drag_area * way / ((s + 0.5) * volume)))
    )


def ground_below(run: Run, at: Array) -> float | None:
    """Height of the bed, where it looks up, or of the floor below a place [m]; None: no floor."""
    points, triangles = run.bed
    floor = float(run.grid.low[2])
    if not len(triangles):
        return floor if run.sides["z_min"] in ("no_slip", "slip") else None
    x, y, _ = run.into_tank(at)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    whole = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        p = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / whole
        q = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / whole
        z = a[:, 2] + p * (b - a)[:, 2] + q * (c - a)[:, 2]
    over = (whole > 0) & (p >= -1e-9) & (q >= -1e-9) & (p + q <= 1 + 1e-9) & (z <= at[2])
    return float(max([floor, *z[over]]))


def level_of(run: Run) -> float | None:
    """Of the liquid at the start [m]; None: it has none."""
    fluid = run.parameters["fluid"][0]
    if run.physics == "dry" or (run.physics != "light" and fluid["initial_state"].strip()):
        return None
    if fluid["single_phase"]:
        return float(run.grid.high[2])
    found = fluid.get("water_level")
    return None if found is None else min(float(found), float(run.grid.high[2]))


@dataclass(frozen=True)
class _Drag:
    coefficient: float
    area: float  # to which it belongs [m2]


def _is_sphere(run: Run, shape: Shape) -> bool:
    return any(
        str(group["name"]).strip() == shape.name and str(group["kind"]).strip() == "sphere"
        for group in run.parameters["shape"]
    )


def _drag(run: Run, shape: Shape) -> _Drag:
    if run.physics == "light":
        input_of = {str(group["name"]).strip(): group for group in run.parameters["shape"]}
        family = shape.name if shape.name in input_of else shape.name.rpartition("-")[0]
        return _Drag(input_of[family]["drag_coefficient"], surface(shape) / 3)
    if _is_sphere(run, shape):
        return _Drag(0.42, np.pi * shape.sphere_radius[0] ** 2)
    return _Drag(drag_coefficient(shape.volume, surface(shape)), mean_shadow(shape))


def lowest(run: Run, body: int) -> float:
    """Height of the lowest point of a block at the start [m]."""
    b = run.bodies
    shape = run.shapes[b.shape[body]]
    if _is_sphere(run, shape):
        return float(b.position[0, body, 2] - shape.sphere_radius[0])
    return float(place(shape.points, b.position[0, body], b.quaternion[0, body])[:, 2].min())


def fall(run: Run, body: int) -> list[str]:
    """What to expect of a block that is let go."""
    bottom = lowest(run, body)
    ground, level = ground_below(run, run.bodies.position[0, body]), level_of(run)
    name = "bed" if len(run.bed[1]) and ground != run.grid.low[2] else "floor"
    lower = run.grid.low[2] if ground is None else ground
    said = f"lowest point at {bottom:.4g} m"
    if ground is not None:
        said = f"lowest point {bottom - ground:.3g} m above the {name}"
    if level is not None and level > lower:
        over, depth = bottom - level, level - lower
        said += f", {abs(over):.3g} m " + ("above the water" if over > 0 else "under water")
        said += f"; water {depth:.3g} m deep there, {depth / run.grid.spacing[2]:.3g} cells"
    else:
        level = None
    x, y, g = run.gravity * (1, 1, -1)
    if x or y or g <= 0:
        return [said]
    return [said, *_speeds(run, body, bottom, ground, level, float(g), name)]


def _speeds(run: Run, body: int, bottom: float, ground: float | None, level: float | None,
            g: float, name: str) -> list[str]:  # fmt: skip
    """Speeds of a fall, under gravity g."""
    shape = run.shapes[run.bodies.shape[body]]
    start, said = -float(run.bodies.velocity[0, body, 2]), []
    way = " m/s, if no block is in its way"
    if level is None:
        if ground is None or (run.physics != "dry" and run.parameters["fluid"][0]["initial_state"]):
            return []
        speed = speed_after_air(start, g, max(0.0, bottom - ground))
        return [f"meets the {name} at {speed:.3g}{way}"]
    if bottom > level:
        start = speed_after_air(start, g, bottom - level)
        said.append(f"meets the water at {start:.3g} m/s")
    s, drag = shape.density / run.value("fluid", "liquid_density"), _drag(run, shape)
    if s <= 1:
        return [*said, "is lighter than the liquid and floats"]
    pull = drag.coefficient * drag.area
    if ground is not None:
        depth = max(0.0, min(bottom, level) - ground)
        speed = speed_after_water(s, shape.volume, pull, g, max(0.0, start), depth)
        said.append(f"meets the {name} at about {speed:.2g}{way}")
    end = terminal_speed(s, shape.volume, pull, g)
    return [*said, f"a long fall in water ends at about {end:.2g} m/s, C = {drag.coefficient:.2g}"]


def falls(run: Run, line: IntArray) -> Lines:
    """The free body that starts highest, and the first block of each drop; `line`: of each body
    in the case."""
    b = run.bodies
    placed = len(run.parameters.get("body", []))
    free = [k for k in range(placed) if not b.fixed[k]]
    said: Lines = []
    if free:
        highest = max(free, key=lambda k: b.position[0, k, 2])
        said.append((f"&body on line {line[highest]}", fall(run, highest)))
    first, drops = placed, run.parameters.get("drop", [])
    for drop in drops[:_MOST]:
        n = int(drop.get("count") or (line[first:] == line[first]).sum())
        lowered = float(drop["lowering_speed"]) > 0
        words = [f"{n} by crane"] if lowered else fall(run, first)
        if str(drop.get("file", "")).strip() and np.isclose(lowest(run, first), run.grid.high[2]):
            words = ["is set on what lies there"]  # a row of a table without a height
        if n > 1 and not lowered:
            words[0] = f"the first of {n}: {words[0]}"
        words += _handled(drop, n, int(b.fixed[first : first + n].sum()))
        said.append((f"&drop on line {line[first]}", words))
        first += n
    if len(drops) > _MOST:
        said.append(("", [f"and of {len(drops) - _MOST} more groups &drop"]))
    return said


def _handled(drop: dict[str, Any], n: int, fixed: int) -> list[str]:
    """What a crane does with the blocks of a drop, and the table that they come from."""
    said = []
    if table := str(drop.get("file", "")).strip():
        said.append(f"places from {table}: {n} rows, {fixed} fixed")
    if drop["lowering_speed"]:
        until = {
            "touch": "where it touches what lies below",
            "set_down": "set down, when its sling is slack",
            "height": f"{drop.get('release_height', 0):.4g} m over what lies below",
        }.get(str(drop["release"]).strip(), "at its place, from the water level or the top of "
              "the tank")  # fmt: skip
        said.append(f"lowered at {drop['lowering_speed']:.4g} m/s, let go {until}")
    taken = {"raise": "raised above what lies there", "skip": "left out"}
    if what := taken.get(str(drop["if_blocked"]).strip()):
        said.append(f"where a place is taken, {what}")
    return said
