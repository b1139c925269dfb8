"""How near the true shapes of blocks and walls come to one another, and how deep they overlap.

The contact model of a run plays no part here: distances and depths are those of the tetrahedra
and their surface triangles. All lengths in metres.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from micstools.geometry import (
    Array,
    distance_between_segments,
    distance_to_triangles,
    inside_tets,
    place,
)
from micstools.reader import Run
from micstools.shapes import Shape

WALL_KINDS = ("no_slip", "slip")


@dataclass(frozen=True)
class Placed:
    """A block at its place in space."""

    shape: Shape
    position: Array  # (3) [m]
    quaternion: Array  # (4) w, x, y, z

    @property
    def points(self) -> Array:
        """Corners (n, 3) [m]."""
        return place(self.shape.points, self.position, self.quaternion)

    @property
    def tets(self) -> Array:
        """Corners of the tetrahedra (k, 4, 3) [m]."""
        return self.points[self.shape.tets]

    @property
    def triangles(self) -> Array:
        """Corners of the surface triangles (m, 3, 3) [m]."""
        return self.points[self.shape.triangles]

    @property
    def samples(self) -> Array:
        """Many points of the surface (n, 3) [m]."""
        return place(self.shape.samples, self.position, self.quaternion)


def present_bodies(run: Run, row: int) -> dict[int, Placed]:
    """The released bodies of a run at a row, by their number."""
    b = run.bodies
    return {
        int(k): Placed(run.shapes[b.shape[k]], b.position[row, k], b.quaternion[row, k])
        for k in np.flatnonzero(b.present(row))
    }


def near(a: Placed, b: Placed, margin: float = 0.0) -> bool:
    """Whether the spheres around two blocks come nearer than `margin` [m]."""
    reach = a.shape.radius + b.shape.radius + margin
    return bool(np.linalg.norm(a.position - b.position) < reach)


def gap(a: Placed, b: Placed) -> float:
    """Least distance between the surfaces of two blocks [m]; exact where they do not overlap.

    Between two polyhedra that do not overlap the nearest points are a corner and a face or two
    edges, and only corners and edges at which the surface bends count.
    """
    pa, pb = a.points, b.points
    corners_a, corners_b = np.unique(a.shape.edges), np.unique(b.shape.edges)
    return min(
        float(distance_to_triangles(pa[corners_a], b.triangles).min()),
        float(distance_to_triangles(pb[corners_b], a.triangles).min()),
        distance_between_segments(pa[a.shape.edges], pb[b.shape.edges]),
    )


def depth(a: Placed, b: Placed) -> float:
    """Depth of two blocks in one another [m]: the deepest surface point of one below the surface
    of the other; zero where none of the sample points lies inside."""
    deepest = 0.0
    for one, other in ((a, b), (b, a)):
        samples = one.samples
        inside = samples[inside_tets(samples, other.tets)]
        if len(inside):
            deepest = max(deepest, float(distance_to_triangles(inside, other.triangles).max()))
    return deepest


def wall_gaps(body: Placed, low: Array, high: Array, sides: dict[str, str]) -> dict[str, float]:
    """Distance of a block to each side that is a contact wall [m]; negative: depth in the wall."""
    points = body.points
    gaps = {}
    for axis, name in enumerate("xyz"):
        if sides[f"{name}_min"] in WALL_KINDS:
            gaps[f"{name}_min"] = float(points[:, axis].min() - low[axis])
        if sides[f"{name}_max"] in WALL_KINDS:
            gaps[f"{name}_max"] = float(high[axis] - points[:, axis].max())
    return gaps


def bed_gap(body: Placed, facets: Array, reach: float) -> float:
    """Least distance between the surfaces of a block and of a bed (n, 3, 3) [m]; infinite where no
    facet comes within `reach` of the sphere around the block."""
    margin = body.shape.radius + reach
    low, high = body.position - margin, body.position + margin
    beside = (facets.min(axis=1) <= high) & (facets.max(axis=1) >= low)
    facets = facets[beside.all(axis=1)]
    if not len(facets):
        return float("inf")
    points = body.points
    edges = facets[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    return min(
        float(distance_to_triangles(points[np.unique(body.shape.edges)], facets).min()),
        float(distance_to_triangles(facets.reshape(-1, 3), body.triangles).min()),
        distance_between_segments(points[body.shape.edges], edges),
    )


@dataclass(frozen=True)
class Touches:
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


def touches(run: Run, row: int, reach: float = 5e-4) -> Touches:
    """What is within `reach` [m]: pairs of released blocks, and they and walls or the bed."""
    bodies = present_bodies(run, row)
    blocks = {}
    for i, j in combinations(bodies, 2):
        a, b = bodies[i], bodies[j]
        if near(a, b, reach):
            distance = gap(a, b)
            if distance > reach and depth(a, b) > 0:
                distance = 0.0
            if distance <= reach:
                blocks[i, j] = distance
    gaps = _all_wall_gaps(run, bodies)
    walls = {key: g for key, g in gaps.items() if g <= reach}
    corners, facets = run.bed
    beds = {k: bed_gap(body, corners[facets], reach) for k, body in bodies.items()}
    return Touches(blocks, walls, {k: g for k, g in beds.items() if g <= reach})


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
    for i, j in combinations(bodies, 2):
        if near(bodies[i], bodies[j]):
            found = depth(bodies[i], bodies[j])
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
