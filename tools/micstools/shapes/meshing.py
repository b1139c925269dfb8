"""From a surface (STL, OBJ, STEP) to tetrahedra for a block of kind 'file'.

trimesh reads, checks and repairs the surface; Gmsh fills it with tetrahedra and keeps its facets. A
remeshed surface would change volume and weight of curved blocks by several per cent. Both packages
are imported when they are needed; Gmsh (GPL) runs as a tool of its own, the program does not
contain it.
"""

import codecs
import re
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from micstools.shapes import holes, solids
from micstools.shapes.geometry import Array, IntArray, tet_volumes
from micstools.shapes.shape import Shape, from_tets

STL_HEAD, STL_FACET = 84, 50
"""Bytes of a binary STL file."""
LARGEST_CHANGE = 0.01
"""Change of volume by repairs or by meshing that is refused."""
STEP_UNIT = 1.0e-3
"""Gmsh turns lengths of a STEP file, which tells its unit, into mm [m]."""
LONGEST = 20.0
"""Length of a block above which its file is taken to be in mm or cm [m]."""
LONG = 1.0
"""Length of a block above which its unit is asked after [m]."""
COARSE = 1e3
"""Steps of single precision along a surface that are too few [-]."""
FINE = 1e5
"""Steps with which rounding cannot have opened a surface [-]."""


class BadSurface(Exception):
    """The surface cannot become a block; the text says why and what to do."""


@dataclass
class Surface:
    """Triangles of a file, in its units, and what was found out and done about them."""

    points: Array  # (n, 3)
    triangles: IntArray  # (m, 3) seen from outside
    volume: float
    warnings: list[str] = field(default_factory=list)
    unit: float | None = None  # of the file [m], where it says so

    @property
    def length(self) -> float:
        """Largest extent."""
        return float(np.ptp(self.points, axis=0).max())


def load(path: Path, element: float = 0.0) -> Surface:
    """The closed surface of a file, repaired where it needs that; `element` [its units] is the edge
    length with which the curved faces of a STEP file are cut, 0 = a tenth of its length."""
    if not path.is_file():
        raise BadSurface(f"{path}: there is no such file")
    if path.suffix.lower() in (".step", ".stp"):
        points, triangles, volume, warnings = _step_surface(path, element)
        surface = closed(points, triangles, volume)
        surface.warnings[:0] = warnings
        surface.unit = STEP_UNIT
        return surface
    import trimesh

    try:
        kind = path.suffix.lower()[1:]
        data = path.read_bytes().removeprefix(codecs.BOM_UTF8)
        if kind == "stl":
            mesh = trimesh.load_mesh(BytesIO(_plain_stl(data)), file_type=kind)
        elif kind == "obj":
            mesh = trimesh.load_mesh(BytesIO(data), file_type=kind)
        else:
            mesh = trimesh.load_mesh(path)
        return _closed_near_zero(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64))
    except BadSurface:
        raise
    except Exception as error:  # the readers of trimesh raise what Python has
        raise BadSurface(f"{path}: cannot be read as a surface ({error})") from error


def _plain_stl(data: bytes) -> bytes:
    """An STL file as trimesh reads it: binary without what follows its last facet, as some writers
    leave bytes there; ASCII with `end solid` as one word."""
    if len(data) >= STL_HEAD:
        end = STL_HEAD + STL_FACET * int.from_bytes(data[STL_HEAD - 4 : STL_HEAD], "little")
        if end <= len(data) < end + STL_FACET:
            return data[:end]
    return re.sub(rb"(?im)^([ \t]*end)[ \t]+(solid|facet|loop)\b", rb"\1\2", data)


def _closed_near_zero(points: Array, triangles: IntArray) -> Surface:
    """`closed`, but a surface that single precision has spoiled is refused for that: coordinates of
    a survey round to halves of a metre, small triangles to lines."""
    if not len(points):
        return closed(points, triangles)
    far, length = float(np.abs(points).max()), float(np.ptp(points, axis=0).max())
    step = float(np.spacing(np.float32(far)))
    too_far = BadSurface(
        f"the surface lies too far from zero: coordinates of {far:.7g} are rounded to {step:.2g} "
        f"in single precision, and it is {length:.3g} long; move it near zero where it was drawn"
    )
    if length < COARSE * step and np.array_equal(points, points.astype(np.float32)):
        raise too_far
    try:
        return closed(points, triangles)
    except BadSurface as reason:
        if length < FINE * step:
            raise too_far from reason
        raise


def closed(points: Array, triangles: IntArray, volume: float | None = None) -> Surface:
    """A closed surface in one piece, seen from outside; warnings tell what was repaired. Parts that
    overlap are united.

    `volume` is that of the true form, if it is known. Only plane holes are filled: those have one
    filling, any other would guess the form of the block.
    """
    import trimesh

    mesh = trimesh.Trimesh(points, triangles, process=True)  # joins equal points
    mesh.update_faces(mesh.unique_faces() & mesh.nondegenerate_faces(height=0.0))
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) < 4:
        raise BadSurface("the file holds no closed surface")
    warnings = []
    if not mesh.is_watertight:
        _, count = np.unique(np.sort(mesh.edges, axis=1), axis=0, return_counts=True)
        open_edges = int((count != 2).sum())
        try:
            faces, n_holes = holes.fill(np.asarray(mesh.vertices, float), np.asarray(mesh.faces))
        except holes.NotPlane as reason:
            raise BadSurface(
                f"the surface is open: {open_edges} edges have not just two triangles, and what "
                f"is missing cannot be known ({reason}); repair it where it was drawn"
            ) from reason
        mesh = trimesh.Trimesh(mesh.vertices, faces, process=False)
        what = "1 plane hole was" if n_holes == 1 else f"{n_holes} plane holes were"
        warnings.append(f"the surface was open at {open_edges} edges; {what} filled")
    if len(parts := _parts(mesh)) > 1:
        try:
            surface = closed(*solids.united(parts))
        except solids.NotOne as reason:
            raise BadSurface(str(reason)) from reason
        before = sum(abs(solids.volume(part)) for part in parts)
        surface.warnings[:0] = [*warnings, solids.words(len(parts), before, surface.volume)]
        return surface
    if not mesh.is_winding_consistent or mesh.volume < 0:
        trimesh.repair.fix_normals(mesh, multibody=False)  # type: ignore[no-untyped-call]
        warnings.append("some or all triangles were seen from inside; they were turned")
        if not mesh.is_winding_consistent:
            raise BadSurface("the triangles cannot be turned to one side: no closed body")
    true = float(mesh.volume) if volume is None else volume
    if mesh.volume <= 0:
        raise BadSurface("the surface encloses no volume")
    if abs(mesh.volume / true - 1) > LARGEST_CHANGE:
        raise BadSurface(
            f"the triangles enclose {mesh.volume / true - 1:+.1%} of the volume of the form; "
            "give a smaller --element"
        )
    return Surface(
        np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64), true, warnings
    )


def simplified(surface: Surface, faces: int) -> Surface:
    """The surface with `faces` triangles at most; the change of volume is a warning."""
    if faces < 4:
        raise BadSurface(f"--simplify {faces}: a closed surface has 4 triangles at least")
    if len(surface.triangles) <= faces:
        return surface
    few = BadSurface(f"--simplify {faces}: with so few the surface does not stay closed")
    try:
        found = closed(*solids.coarser((surface.points, surface.triangles), faces))
    except BadSurface as reason:
        raise few from reason
    if found.warnings:  # something had to be repaired
        raise few
    said = (
        f"{len(surface.triangles)} triangles were simplified to {len(found.triangles)}: "
        f"{found.volume / surface.volume - 1:+.2%} of the volume"
    )
    found.warnings[:0] = [*surface.warnings, said]
    found.unit = surface.unit
    return found


def _parts(mesh: Any) -> list[tuple[Array, IntArray]]:
    """Points and triangles of the parts of a surface that share no edge."""
    from trimesh import graph

    nodes = np.arange(len(mesh.faces))
    found = graph.connected_components(mesh.face_adjacency, nodes=nodes, min_len=1)
    faces = np.asarray(mesh.faces, np.int64)
    return [(np.asarray(mesh.vertices, float), faces[part]) for part in found]


def scale_of(surface: Surface, size: float | None, scale: float | None) -> float:
    """Factor from the file's units to m: from the wanted length, as given, as the file says, or 1
    with a warning where the block then is a large one. What a file says holds for its lengths in
    mm; another scale than that is told."""
    if size is not None:
        return size / surface.length
    if scale is not None:
        if surface.unit is not None and abs(scale / surface.unit - 1) > 1e-9:
            surface.warnings.append(
                f"by its own unit the block is {surface.unit * surface.length:g} m long; "
                f"--scale {scale:g}, m for each mm of it, makes it {scale * surface.length:g} m"
            )
        return scale
    if surface.unit is not None:
        return surface.unit
    said = (
        f"read as m the block is {surface.length:g} m long; if the file is in mm give "
        "--scale 0.001, in cm --scale 0.01, or give the length in m with --size"
    )
    if surface.length > LONGEST:
        raise BadSurface(said)
    if surface.length > LONG:
        surface.warnings.append(said)
    return 1.0


def fill(surface: Surface, element: float = 0.0) -> Array:
    """Corners (k, 4, 3) of tetrahedra that fill a surface and keep its triangles; `element` > 0 is
    the largest edge wanted inside. Refuses a surface that meets itself."""
    with _gmsh() as gmsh:
        gmsh.option.setNumber("Mesh.MeshSizeMax", element if element > 0 else 1e22)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0 if element > 0 else 1)
        surface_tag = gmsh.model.addDiscreteEntity(2)
        tags = np.arange(1, len(surface.points) + 1)
        gmsh.model.mesh.addNodes(2, surface_tag, tags, surface.points.ravel())
        gmsh.model.mesh.addElementsByType(
            surface_tag, 2, [], (np.asarray(surface.triangles) + 1).ravel()
        )
        gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([surface_tag])])
        gmsh.model.geo.synchronize()
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:  # gmsh raises plain exceptions
            raise BadSurface(
                f"no tetrahedra fit the surface, it probably meets itself ({error})"
            ) from error
        node, x, _ = gmsh.model.mesh.getNodes()
        place = np.zeros(int(node.max()) + 1, np.int64)
        place[node.astype(np.int64)] = np.arange(len(node))
        _, corners = gmsh.model.mesh.getElementsByType(4)
    if len(corners) == 0:
        raise BadSurface("no tetrahedra fit the surface, it probably meets itself")
    nodes = np.asarray(x, float).reshape(-1, 3)
    tets: Array = nodes[place[corners.astype(np.int64)]].reshape(-1, 4, 3)
    total = float(np.abs(tet_volumes(tets)).sum())
    if abs(total / surface.volume - 1) > LARGEST_CHANGE:
        raise BadSurface(
            f"the tetrahedra hold {total:.4g}, the surface {surface.volume:.4g}: it meets itself "
            "or parts of it overlap; unite them where they were drawn"
        )
    return tets


def _step_surface(path: Path, element: float) -> tuple[Array, IntArray, float, list[str]]:
    """Triangles of a STEP file, the exact volume of its solids, united, and warnings."""
    with _gmsh() as gmsh:
        try:
            gmsh.model.occ.importShapes(str(path))
            gmsh.model.occ.synchronize()
        except Exception as error:  # gmsh raises plain exceptions
            raise BadSurface(f"{path}: cannot be read as STEP ({error})") from error
        found = gmsh.model.getEntities(3)
        warnings = []
        if len(found) > 1:
            n, before = len(found), sum(gmsh.model.occ.getMass(*solid) for solid in found)
            gmsh.model.occ.fuse(found[:1], found[1:])
            gmsh.model.occ.synchronize()
            found = gmsh.model.getEntities(3)
            after = sum(gmsh.model.occ.getMass(*solid) for solid in found)
            warnings = [solids.words(n, before, after)]
        if len(found) != 1:
            raise BadSurface(f"{path}: holds {len(found)} solids apart, a block is one")
        volume = gmsh.model.occ.getMass(*found[0])
        low, high = np.split(np.array(gmsh.model.getBoundingBox(*found[0])), 2)
        edge = element if element > 0 else float((high - low).max()) / 10
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 12)
        gmsh.model.mesh.generate(2)
        node, x, _ = gmsh.model.mesh.getNodes()
        place = np.zeros(int(node.max()) + 1, np.int64)
        place[node.astype(np.int64)] = np.arange(len(node))
        _, corners = gmsh.model.mesh.getElementsByType(2)
    triangles = place[corners.astype(np.int64)].reshape(-1, 3)
    return np.asarray(x).reshape(-1, 3), triangles, float(volume), warnings


class _gmsh:
    """Gmsh with its messages off, for a while."""

    def __enter__(self) -> Any:
        import gmsh

        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        self.gmsh = gmsh
        return gmsh

    def __exit__(self, *_: object) -> None:
        self.gmsh.finalize()


def block(name: str, tets: Array, density: float) -> tuple[Shape, Array]:
    """A block from loose tetrahedra [m], and its centroid in their axes."""
    volume = np.abs(tet_volumes(tets))
    centroid = (volume[:, None] * tets.mean(axis=1)).sum(axis=0) / volume.sum()
    return from_tets(name, tets, density), centroid


def shape_text(points: Array, tets: IntArray) -> str:
    """The program's own shape file, with all digits."""
    lines = ["mics-shape 1", f"points {len(points)}"]
    lines += [" ".join(repr(float(x)) for x in point) for point in points]
    lines += [f"tets {len(tets)}"]
    lines += [" ".join(str(int(corner) + 1) for corner in tet) for tet in tets]
    return "\n".join(lines) + "\n"


def report(shape: Shape, shift: Array) -> str:
    """Mass properties in lines to read; `shift` is the centroid in the file's coordinates [m]."""
    mass = shape.density * shape.volume
    rows = [
        ("extent", " x ".join(f"{x:.4g}" for x in np.ptp(shape.points, axis=0)) + " m"),
        ("volume", f"{shape.volume:.6g} m3"),
        ("mass", f"{mass:.6g} kg at {shape.density:g} kg/m3"),
        ("weight", f"{9.81 * mass:.6g} N"),
        ("centroid", ", ".join(f"{x:.6g}" for x in shift) + " m in the file's axes"),
        *[
            (f"inertia {axis}", "  ".join(f"{x:12.5e}" for x in row) + " kg m2")
            for axis, row in zip("xyz", shape.inertia, strict=True)
        ],
        ("tetrahedra", f"{len(shape.tets)}, {len(shape.triangles)} triangles at the surface"),
        ("contact spheres", f"{len(shape.sphere_radius)} of spheres = 'centroid'"),
    ]
    return "\n".join(f"{name:16}{text}" for name, text in rows)
