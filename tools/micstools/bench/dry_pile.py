"""A dry pile of hexapods: how it starts, its case, and what the pile is like."""

import itertools
from pathlib import Path

import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, place

EDGE, DENSITY, BOX = 0.02, 2300.0, 0.3  # of a cube [m], [kg/m3], side of the tank [m]
REACH = EDGE * float(np.sqrt(2.75))  # of a corner from the centroid
PITCH = 0.07  # of the grid of the start [m]
LOWEST = 0.04  # height of the first layer [m]


def start(n: int, box: float, seed: int) -> tuple[Array, Array]:
    """Positions (n, 3) and quaternions w, x, y, z (n, 4): layers of a square grid, shifted at
    random by nine tenths of what keeps the surrounding spheres apart, any attitude alike."""
    random = np.random.default_rng(seed)
    side = int(box / PITCH)
    cell = box / side
    number = np.arange(n)
    layer, place_in_layer = np.divmod(number, side * side)
    row, column = np.divmod(place_in_layer, side)
    position = np.stack([(column + 0.5) * cell, (row + 0.5) * cell, LOWEST + PITCH * layer], axis=1)
    free = 0.9 * (0.5 * cell - REACH)
    position[:, :2] += random.uniform(-free, free, (n, 2))
    quaternion = random.normal(size=(n, 4))
    return position, quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)


def case(
    n: int, output: Path, seconds: float = 2.0, dt: float = 0.1, contact_time: float = 0.008,
    sleep: bool = False, box: float = BOX, seed: int = 1,
) -> str:  # fmt: skip
    """The case file of n blocks."""
    position, quaternion = start(n, box, seed)
    top = position[:, 2].max() + 0.1
    lines = [
        f"&run physics = 'dry'  t_end = {seconds!r}  dt = {dt!r}  output = '{output}'",
        "  field_interval = 0  restart_interval = 0 /",
        f"&grid cells = 60, 60, 60  length = {box!r}, {box!r}, {float(top)!r} /",
        f"&contact contact_time = {contact_time!r}  friction = 0.5",
        f"  restitution = 0.3  wall_friction = 0.5  sleep = {'T' if sleep else 'F'} /",
        f"&shape name = 'hexapod'  kind = 'hexapod'  size = {EDGE}  density = {DENSITY}",
        "  refinement = 1 /",
    ]
    for x, q in zip(position, quaternion, strict=True):
        where, turned = (", ".join(f"{value:.16g}" for value in values) for values in (x, q))
        lines.append(f"&body shape = 'hexapod'  position = {where}  quaternion = {turned} /")
    return "\n".join(lines) + "\n"


def cubes() -> Array:
    """Centres of the seven cubes (7, 3) [m]."""
    ends = [sign * EDGE * np.eye(3)[axis] for axis in range(3) for sign in (-1, 1)]
    return np.array([np.zeros(3), *ends])


def surface_points(parts: int = 8) -> Array:
    """Points on all faces, edges and corners of a hexapod, in body axes (m, 3) [m]."""
    line = np.linspace(-0.5, 0.5, parts + 1) * EDGE
    found = set()
    for centre, axis, sign in itertools.product(cubes(), range(3), (-0.5, 0.5)):
        first, second = np.meshgrid(line, line)
        face = np.empty((first.size, 3))
        face[:, axis] = sign * EDGE
        face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = first.ravel(), second.ravel()
        found |= {tuple(point) for point in np.round(centre + face, 9)}
    points = np.array(sorted(found))
    return points[depth_inside(points) < 1e-8]


def depth_inside(points: Array) -> Array:
    """How deep points in body axes are inside the hexapod, taken as three bars of 3 x 1 x 1 cubes:
    distance from the nearest side of a bar; negative outside [m]."""
    half = 0.5 * EDGE * (np.ones((3, 3)) + 2.0 * np.eye(3))
    return np.asarray((half[:, None, :] - np.abs(points)[None]).min(axis=2).max(axis=0))


def true_depth(position: Array, quaternion: Array) -> float:
    """Largest depth of a surface point of one block inside another [m]."""
    points, worst = surface_points(), 0.0
    world = [place(points, x, q) for x, q in zip(position, quaternion, strict=True)]
    for i, j in itertools.permutations(range(len(position)), 2):
        if np.linalg.norm(position[i] - position[j]) < 2.0 * REACH:
            back = quaternion[j] * [1.0, -1.0, -1.0, -1.0]
            inside = place(world[i] - position[j], np.zeros(3), back)
            worst = max(worst, float(depth_inside(inside).max()))
    return worst


def packing(position: Array, quaternion: Array, box: float, height: float) -> float:
    """Share of solid below a height; each cube counted by the height of its centre."""
    solid = 0.0
    for x, q in zip(position, quaternion, strict=True):
        bottoms = place(cubes(), x, q)[:, 2] - 0.5 * EDGE
        solid += float(np.clip((height - bottoms) / EDGE, 0.0, 1.0).sum()) * EDGE**3
    return solid / (box * box * height)


def measure(run: Run, box: float = BOX, every: int = 1) -> dict[str, float]:
    """What the pile is like; depths at every so many rows of the last half second."""
    b = run.bodies
    x, q = b.position[-1], b.quaternion[-1]
    inside = ((x > 0.0) & (x < [box, box, np.inf])).all(axis=1)
    height = float(np.percentile(x[:, 2], 80))
    late = np.flatnonzero(b.time > b.time[-1] - 0.5)
    depths = [true_depth(b.position[row], b.quaternion[row]) for row in late[::-1][::every]]
    return {
        "mean_z": float(x[:, 2].mean()),
        "max_z": float(x[:, 2].max()),
        "packing80": packing(x, q, box, height),
        "pen_max_mm": 1e3 * depths[0],
        "pen_late_mm": 1e3 * max(depths),
        "escaped": int((~inside).sum()),
    }
