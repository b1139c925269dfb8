"""How near the true shapes of blocks and walls come to one another, and how deep they overlap.

Distances and depths are those of the tetrahedra and their surface triangles, whatever the contact
model of a run; but blocks that collide by spheres, which reach beyond their surface, touch where
these do. All lengths in metres.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from micstools.reading import scales
from micstools.reading.reader import Run
from micstools.shapes.geometry import (
    Array,
    distance_between_segments,
    distance_to_triangles,
    inside_tets,
    place,
    rotation_matrix,
    surface_samples,
)
from micstools.shapes.shape import Shape

WALL_KINDS = ("no_slip", "slip")


@dataclass(frozen=True)
class Placed:
    """A block at its place in space."""

    shape: Shape
    position: Array  # (3) [m]
    quaternion: Array  # (4) w, x, y, z

    def moved(self, way: Array) -> "Placed":
        """The block moved by `way` (3) [m]."""
        return replace(self, position=self.position + way)

    @cached_property
    def points(self) -> Array:
        """Corners (n, 3) [m]."""
        return place(self.shape.points, self.position, self.quaternion)

    @cached_property
    def tets(self) -> Array:
        """Corners of the tetrahedra (k, 4, 3) [m]."""
        return self.points[self.shape.tets]

    @cached_property
    def triangles(self) -> Array:
        """Corners of the surface triangles (m, 3, 3) [m]."""
        return self.points[self.shape.triangles]

    @cached_property
    def sphere_centres(self) -> Array:
        """Centres of the contact spheres (s, 3) [m]."""
        return place(self.shape.sphere_centre, self.position, self.quaternion)

    @cached_property
    def normals(self) -> Array:
        """Directions (m, 3) across its faces."""
        return np.asarray(self.shape.normals @ rotation_matrix(self.quaternion).T)


def present_bodies(run: Run, row: int, held: bool = False) -> dict[int, Placed]:
    """The released bodies of a run at a row, by their number, `held`: those on a crane, too; with
    their centroids in the tank where a direction is periodic."""
    b = run.bodies
    position = run.into_tank(b.position[row])
    return {
        int(k): Placed(run.shapes[b.shape[k]], position[k], b.quaternion[row, k])
        for k in np.flatnonzero(b.there(row) if held else b.present(row))
    }


def without_machines(run: Run, bodies: dict[int, Any]) -> dict[int, Any]:
    """Bodies without those that a table moves: doors, pushers, paddles. They are no part of a pile,
    nor of the ground."""
    groups = run.parameters.get("body", [])
    moved = {k for k, group in enumerate(groups) if str(group.get("motion") or "").strip()}
    return {k: body for k, body in bodies.items() if k not in moved}


def images(run: Run, bodies: Iterable[Placed]) -> list[Placed]:
    """Bodies as the tank shows them: with the images of those that cross a periodic side."""
    found = list(bodies)
    for d in np.flatnonzero(run.period):
        for body in list(found):
            for side in (-1.0, 1.0):
                moved = body.moved(side * run.period[d] * np.eye(3)[d])
                reach = moved.position[d] + np.array([-1.0, 1.0]) * body.shape.radius
                if reach[1] > run.grid.low[d] and reach[0] < run.grid.high[d]:
                    found.append(moved)
    return found


def nearest(run: Run, body: Placed, to: Placed) -> Placed:
    """The periodic image of a body that is nearest to another one."""
    if not any(run.periodic):
        return body
    way = np.zeros(3)
    for d in np.flatnonzero(run.period):
        periods = np.round((body.position[d] - to.position[d]) / run.period[d])
        way[d] = -periods * run.period[d]
    return body.moved(way)


def near_pairs(
    run: Run, bodies: dict[int, Placed], reach: float = 0.0, out: dict[int, float] | None = None
) -> Iterator[tuple[int, int]]:
    """Pairs of blocks, the lower number first, whose spheres around them come nearer than `reach`
    [m], through periodic sides, too; `out` is how much farther than that some of them stick out."""
    numbers = list(bodies)
    place = np.array([body.position for body in bodies.values()])
    radius = np.array([body.shape.radius + (out or {}).get(k, 0.0) for k, body in bodies.items()])
    period = np.where(run.period > 0, run.period, np.inf)
    for n, i in enumerate(numbers):
        way = place[n + 1 :] - place[n]
        way -= run.period * np.round(way / period)
        close = np.linalg.norm(way, axis=1) < radius[n] + radius[n + 1 :] + reach
        for k in np.flatnonzero(close):
            yield i, numbers[n + 1 + int(k)]


def apart(a: Placed, b: Placed) -> float:
    """A bound of the distance of two blocks from below [m]: the widest gap between their shadows on
    the normals of their faces; negative where there is none."""
    normal = np.concatenate([a.normals, b.normals])
    one, other = a.points @ normal.T, b.points @ normal.T
    gaps = np.maximum(other.min(axis=0) - one.max(axis=0), one.min(axis=0) - other.max(axis=0))
    return float(gaps.max())


def gap(a: Placed, b: Placed, reach: float = np.inf) -> float:
    """Least distance between the surfaces of two blocks [m], exact up to `reach` where they do not
    overlap; beyond it the distance or more.

    Between two polyhedra that do not overlap the nearest points are a corner and a face or two
    edges, and only corners and edges at which the surface bends count. What lies within `reach` of
    the other block meets a box.
    """
    low = np.maximum(a.points.min(axis=0), b.points.min(axis=0)) - reach
    high = np.minimum(a.points.max(axis=0), b.points.max(axis=0)) + reach

    def in_box(parts: Array) -> Array:
        """The points, edges or triangles (n, corners, 3) that may meet the box."""
        meets = (parts.min(axis=1) <= high) & (parts.max(axis=1) >= low)
        return np.asarray(parts[meets.all(axis=1)])

    found = [np.inf]
    for one, other in ((a, b), (b, a)):
        corners = in_box(one.points[one.shape.corners][:, None])
        triangles = in_box(other.triangles)
        if len(corners) and len(triangles):
            found.append(float(distance_to_triangles(corners[:, 0], triangles).min()))
    edges = [in_box(body.points[body.shape.edges]) for body in (a, b)]
    if len(edges[0]) and len(edges[1]):
        found.append(distance_between_segments(*edges))
    return min(found)


def depth(a: Placed, b: Placed) -> float:
    """Depth of two blocks in one another [m]: the deepest surface point of one below the surface
    of the other; zero where no sample, a thirtieth of the radius apart, lies inside."""
    deepest = 0.0
    for one, other in ((a, b), (b, a)):
        triangles, tets = _meeting(one.triangles, other.tets)
        samples = surface_samples(triangles, one.shape.radius / 30)
        inside = samples[inside_tets(samples, tets)]
        if len(inside):
            deepest = max(deepest, float(distance_to_triangles(inside, other.triangles).max()))
    return deepest


def _meeting(triangles: Array, tets: Array) -> tuple[Array, Array]:
    """Of triangles (m, 3, 3) and tetrahedra (k, 4, 3) those that neither their boxes nor a face of
    the tetrahedron keeps apart from all of the others."""
    meet = np.ones((len(triangles), len(tets)), bool)
    for d in range(3):
        one, other = triangles[..., d], tets[..., d]
        meet &= one.min(axis=1)[:, None] <= other.max(axis=1)
        meet &= one.max(axis=1)[:, None] >= other.min(axis=1)
    t, k = np.nonzero(meet)
    inverse = np.linalg.inv(tets[k, 1:] - tets[k, :1])
    share = (triangles[t] - tets[k, :1]) @ inverse
    first = 1 - share.sum(axis=2)
    beside = (share.max(axis=1).min(axis=1) < 0) | (first.max(axis=1) < 0)
    return triangles[np.unique(t[~beside])], tets[np.unique(k[~beside])]


def sphere_gap(a: Placed, b: Placed) -> float:
    """Least distance between the contact spheres of two blocks [m]; negative: depth."""
    apart = np.linalg.norm(a.sphere_centres[:, None] - b.sphere_centres[None], axis=2)
    return float((apart - a.shape.sphere_radius[:, None] - b.shape.sphere_radius).min())


def wall_gaps(
    body: Placed, low: Array, high: Array, sides: dict[str, str], spheres: bool = False
) -> dict[str, float]:
    """Distance of a block, or of its contact `spheres`, to each side that is a contact wall [m];
    negative: depth in the wall."""
    points = body.sphere_centres if spheres else body.points
    radius: Array | float = body.shape.sphere_radius if spheres else 0.0
    gaps = {}
    for axis, name in enumerate("xyz"):
        if sides[f"{name}_min"] in WALL_KINDS:
            gaps[f"{name}_min"] = float((points[:, axis] - radius).min() - low[axis])
        if sides[f"{name}_max"] in WALL_KINDS:
            gaps[f"{name}_max"] = float(high[axis] - (points[:, axis] + radius).max())
    return gaps


def bed_gap(body: Placed, facets: Array, reach: float, spheres: bool = False) -> float:
    """Least distance between the surface of a block, or its contact `spheres`, and a bed (n, 3, 3)
    [m]; infinite where no facet comes within `reach` of the sphere around the block."""
    margin = body.shape.radius + reach + (body.shape.sphere_radius.max() if spheres else 0.0)
    low, high = body.position - margin, body.position + margin
    beside = (facets.min(axis=1) <= high) & (facets.max(axis=1) >= low)
    facets = facets[beside.all(axis=1)]
    if not len(facets):
        return float("inf")
    if spheres:
        distance = distance_to_triangles(body.sphere_centres, facets)
        return float((distance - body.shape.sphere_radius).min())
    points = body.points
    edges = facets[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    return min(
        float(distance_to_triangles(points[body.shape.corners], facets).min()),
        float(distance_to_triangles(facets.reshape(-1, 3), body.triangles).min()),
        distance_between_segments(points[body.shape.edges], edges),
    )


@dataclass(frozen=True)
class Contacts:
    """What touches what at one row, by the true shapes."""

    blocks: dict[tuple[int, int], float]  # gap of each touching pair, first number the lower [m]
    walls: dict[tuple[int, str], float]  # gap of each touching block and side [m]
    bed: dict[int, float]  # gap of each block that touches the bed [m]

    def of(self, body: int) -> list[int]:
        """Blocks that touch a block."""
        return [j if i == body else i for i, j in self.blocks if body in (i, j)]

    def walls_of(self, body: int) -> list[str]:
        """Sides that touch a block."""
        return [side for k, side in self.walls if k == body]

    def on_floor(self, body: int) -> bool:
        """Whether a block touches the floor of the tank or the bed."""
        return body in self.bed or (body, "z_min") in self.walls


@lru_cache(maxsize=2)
def find_contacts(run: Run, row: int) -> Contacts:
    """What is within the reach of `scales` of each other: pairs of released blocks, and they and
    walls or the bed."""
    reach = scales.reach(run)
    bodies = present_bodies(run, row)
    # By how much contact spheres stick out of the sphere around a block [m], of those that collide
    # by them, or as the ball that they are
    spheres = run.value("contact", "model") == "spheres"
    kinds = {s.get("name"): str(s.get("kind")).strip() for s in run.parameters.get("shape", [])}
    balls: dict[int, float] = {}
    for k, body in bodies.items():
        if spheres or kinds.get(body.shape.name) == "sphere":
            far = np.linalg.norm(body.shape.sphere_centre, axis=1) + body.shape.sphere_radius
            balls[k] = max(0.0, float(far.max()) - body.shape.radius)
    blocks = {}
    for i, j in near_pairs(run, bodies, reach, balls):
        a = bodies[i]
        b = nearest(run, bodies[j], a)
        between = apart(a, b)
        distance = between if between > reach else gap(a, b, reach)
        if between <= reach < distance and depth(a, b) > 0:
            distance = 0.0
        if distance > reach and i in balls and j in balls:
            distance = sphere_gap(a, b)
        if distance <= reach:
            blocks[i, j] = distance
    gaps = _all_wall_gaps(run, bodies)
    corners, facets = run.bed
    beds = {k: bed_gap(body, corners[facets], reach) for k, body in bodies.items()}
    for k in balls:
        around = wall_gaps(bodies[k], run.grid.low, run.grid.high, run.sides, spheres=True)
        gaps |= {(k, side): min(g, gaps[k, side]) for side, g in around.items()}
        beds[k] = min(beds[k], bed_gap(bodies[k], corners[facets], reach, spheres=True))
    walls = {key: g for key, g in gaps.items() if g <= reach}
    return Contacts(blocks, walls, {k: g for k, g in beds.items() if g <= reach})


@dataclass(frozen=True)
class Overlap:
    """Depth of true shapes in one another at one row [m]."""

    blocks: dict[tuple[int, int], float]  # each overlapping pair
    walls: dict[tuple[int, str], float]  # each block that is in a wall

    @property
    def largest(self) -> float:
        """The largest depth [m]."""
        return max([0.0, *self.blocks.values(), *self.walls.values()])


def overlap(run: Run, row: int = -1) -> Overlap:
    """True overlap of all released blocks at a row."""
    bodies = present_bodies(run, row)
    blocks = {}
    for i, j in near_pairs(run, bodies):
        other = nearest(run, bodies[j], bodies[i])
        found = 0.0 if apart(bodies[i], other) > 0 else depth(bodies[i], other)
        if found > 0:
            blocks[i, j] = found
    gaps = _all_wall_gaps(run, bodies)
    return Overlap(blocks, {key: -g for key, g in gaps.items() if g < 0})


def _all_wall_gaps(run: Run, bodies: dict[int, Placed]) -> dict[tuple[int, str], float]:
    low, high, sides = run.grid.low, run.grid.high, run.sides
    return {
        (k, side): g
        for k, body in bodies.items()
        for side, g in wall_gaps(body, low, high, sides).items()
    }
