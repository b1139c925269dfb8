"""Blocks, bed and water of a run as pyvista objects, for pictures, exports and the reader.

pyvista is imported when the first of them is made: it takes a second that most callers never need.
"""

from typing import Any

import numpy as np

from micstools.reading.overlap import present_bodies
from micstools.reading.profiles import with_ends
from micstools.reading.reader import Fields, Run
from micstools.shapes.geometry import Array, IntArray

PolyData = Any  # pyvista.PolyData and its like, which are imported late
ImageData = Any
MultiBlock = Any


def triangles_of(points: Array, triangles: IntArray) -> PolyData:
    """Points (n, 3) [m] and triangles (m, 3)."""
    import pyvista as pv

    threes = np.full((len(triangles), 1), 3)
    return pv.PolyData(points, faces=np.hstack([threes, triangles]).ravel())


def joined(surfaces: list[PolyData]) -> PolyData:
    """One surface of several, with their data."""
    return surfaces[0].append_polydata(*surfaces[1:])


def blocks(run: Run, row: int) -> dict[int, PolyData]:
    """The surface of each block in the tank at a row, on a crane, too, by its number from 0; on
    each face `body`, the number from 1."""
    found = {}
    for k, body in present_bodies(run, row, held=True).items():
        found[k] = triangles_of(body.points, body.shape.triangles)
        found[k].cell_data["body"] = np.full(len(body.shape.triangles), k + 1)
    return found


def cells(run: Run, fields: Fields) -> ImageData:
    """The grid with the fields of one time as values of its cells."""
    import pyvista as pv

    grid = run.grid
    points = [len(faces) for faces in grid.faces]
    image = pv.ImageData(dimensions=points, spacing=grid.spacing, origin=grid.low)
    for name in ("liquid", "solid", "pressure"):
        image.cell_data[name] = getattr(fields, name).ravel()
    image.cell_data["velocity"] = fields.velocity.reshape(-1, 3)
    return image


def moved(mesh: Any, low: Array) -> Any:
    """A mesh about zero, moved to `low` (3) [m] in double precision, which VTK does not keep."""
    mesh.points = np.asarray(mesh.points, float) + low
    return mesh


def water(run: Run, fields: Fields) -> tuple[PolyData, PolyData]:
    """Where the share of liquid is one half, outside of solids, and the border of what has more of
    it; empty where all is liquid, or none."""
    import pyvista as pv

    if not fields.liquid.min() < 0.5 < fields.liquid.max():
        return pv.PolyData(), pv.PolyData()
    axes = zip(run.grid.faces, run.grid.centres, strict=True)
    points = pv.RectilinearGrid(*(with_ends(f[0], c, f[-1]) - f[0] for f, c in axes))
    for name in ("liquid", "solid"):
        points.point_data[name] = np.pad(getattr(fields, name), 1, mode="edge").ravel()
    surface = points.contour([0.5], scalars="liquid")
    if surface.n_points:
        surface = surface.clip_scalar(scalars="solid", value=0.5)
    body = points.clip_scalar(scalars="liquid", value=0.5, invert=False)
    body = body.extract_surface(algorithm="dataset_surface")
    return moved(surface, run.grid.low), moved(body, run.grid.low)


def at(run: Run, t: float) -> MultiBlock:
    """What `Run.vtk` tells."""
    import pyvista as pv

    span = run.bodies.time
    if not span.size:
        raise ValueError(f"{run.folder} holds no rows yet")
    if not span[0] <= t <= span[-1]:
        raise ValueError(f"t = {t:g} s: the run goes from {span[0]:g} to {span[-1]:g} s")
    fields = run.fields_at(t) if run.field_times.size else None
    row = run.bodies.row(t if fields is None else fields.time)
    found = pv.MultiBlock()
    for k, block in blocks(run, row).items():
        found.append(block, f"block {k + 1}")
    if len(run.bed[1]):
        found.append(triangles_of(*run.bed), "bed")
    if fields is not None:
        surface, _ = water(run, fields)
        if surface.n_points:
            found.append(surface, "water")
    found.field_data["time"] = [run.bodies.time[row]]
    return found
