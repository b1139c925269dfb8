"""A block of the T-type model, and the hexapod, cube and box built without the program.

The built-in copies exist to draw a shape before any run and to test the tools; what a run used is
always read from its `run.h5`.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np

from micstools.shapes.geometry import Array, IntArray, feature_edges, normals, tet_volumes


@dataclass(frozen=True)
class Shape:
    """Tetrahedra, surface and contact spheres of a block; coordinates relative to its centroid."""

    name: str
    points: Array  # (n, 3) [m]
    triangles: IntArray  # (m, 3) surface, counter-clockwise from outside
    tets: IntArray  # (k, 4)
    sphere_centre: Array  # (s, 3) [m]
    sphere_radius: Array  # (s) [m]
    volume: float  # [m3]
    inertia: Array  # (3, 3) in body axes [kg m2]
    density: float  # [kg/m3]

    @cached_property
    def edges(self) -> IntArray:
        """Edges (m, 2) at which the surface bends."""
        return feature_edges(self.points, self.triangles)

    @cached_property
    def corners(self) -> IntArray:
        """Points (n) at which these meet."""
        return np.unique(self.edges)

    @cached_property
    def normals(self) -> Array:
        """Directions (m, 3) across its faces, each once, of either sense."""
        normal = normals(self.points[self.triangles])
        first = np.abs(np.round(normal, 6)) > 0
        sign = np.sign(np.take_along_axis(normal, first.argmax(axis=1)[:, None], axis=1))
        return np.asarray(np.unique(np.round(sign * normal, 6), axis=0))

    @cached_property
    def radius(self) -> float:
        """Radius of the sphere about the centroid that holds the block [m]."""
        return float(np.linalg.norm(self.points, axis=1).max())

    @cached_property
    def length(self) -> float:
        """The longest edge of the box around it in body axes [m]."""
        return float(np.ptp(self.points, axis=0).max())


def hexapod(edge: float = 0.02, refinement: int = 2, density: float = 2300.0) -> Shape:
    """The paper's block: a cube of the given edge [m] with an equal cube on each of its faces."""
    legs = np.concatenate([np.eye(3), -np.eye(3)])
    centres = np.concatenate([np.zeros((1, 3)), legs]) * edge
    return from_boxes("hexapod", centres, np.full(3, edge), refinement, density)


def box(edges: tuple[float, float, float], refinement: int = 2, density: float = 2300.0) -> Shape:
    """A box with the given three edges [m]."""
    return from_boxes("box", np.zeros((1, 3)), np.array(edges), refinement, density)


def cube(edge: float, refinement: int = 2, density: float = 2300.0) -> Shape:
    """A cube with the given edge [m]."""
    return from_boxes("cube", np.zeros((1, 3)), np.full(3, edge), refinement, density)


def from_boxes(name: str, centres: Array, edges: Array, refinement: int, density: float) -> Shape:
    """A block of equal boxes joined face to face, each cut into refinement^3 times 6 tetrahedra."""
    n = refinement
    steps = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = [
        np.cumsum(np.concatenate([np.zeros((1, 3)), np.eye(3)[list(order)]]), axis=0)
        for order in permutations(range(3))
    ]
    unit = np.array(corner)  # the six tetrahedra of a cube along its diagonal, (6, 4, 3)
    cells = (steps[:, None, None, :] + unit[None]).reshape(-1, 4, 3) / n - 0.5
    tets = (centres[:, None, None, :] + cells[None] * edges).reshape(-1, 4, 3)
    return from_tets(name, tets, density)


def from_tets(name: str, corner: Array, density: float) -> Shape:
    """A block from loose tetrahedra (k, 4, 3) [m]: joins equal points, finds the surface, the mass
    properties and the paper's contact spheres."""
    negative = tet_volumes(corner) < 0
    corner = np.where(negative[:, None, None], corner[:, [0, 2, 1, 3]], corner)
    volumes = tet_volumes(corner)
    centre = (volumes[:, None] * corner.mean(axis=1)).sum(axis=0) / volumes.sum()
    corner = corner - centre
    scale = 1e-9 * float(np.abs(corner).max())
    _, first, number = np.unique(
        np.round(corner.reshape(-1, 3) / scale), axis=0, return_index=True, return_inverse=True
    )
    points = corner.reshape(-1, 3)[first]
    tets = number.reshape(-1, 4).astype(np.int64)
    triangles, owner = surface_of(tets)
    at_surface = np.unique(owner)
    return Shape(
        name=name,
        points=points,
        triangles=triangles,
        tets=tets,
        sphere_centre=corner[at_surface].mean(axis=1),
        sphere_radius=np.cbrt(3 * volumes[at_surface] / (4 * np.pi)),
        volume=float(volumes.sum()),
        inertia=density * second_moments(corner),
        density=density,
    )


def surface_of(tets: IntArray) -> tuple[IntArray, IntArray]:
    """Faces (m, 3) that belong to one tetrahedron only, seen from outside, and that tetrahedron."""
    faces = tets[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = np.sort(first[count == 1])
    return faces[outer], outer // 4


def second_moments(corner: Array) -> Array:
    """Inertia tensor per unit density of tetrahedra (k, 4, 3) about the origin [m5]."""
    total = corner.sum(axis=1)
    outer = np.einsum("kai,kaj->kij", corner, corner) + np.einsum("ki,kj->kij", total, total)
    second = np.einsum("k,kij->ij", tet_volumes(corner) / 20, outer)
    return np.asarray(np.trace(second) * np.eye(3) - second)
