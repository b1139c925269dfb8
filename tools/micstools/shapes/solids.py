"""Closed surfaces united (manifold3d) and made coarser (VTK); each package is imported when needed.

A part is points (n, 3) and triangles (m, 3), closed, in the units of its file.
"""

import numpy as np

from micstools.shapes.geometry import Array, IntArray

Part = tuple[Array, IntArray]
SWALLOWED = 1e-9
"""Share of a part outside of the others below which it lies inside them."""


class NotOne(Exception):
    """The parts make no one block; the text says why."""


def volume(part: Part) -> float:
    """What a part encloses, negative where it is seen from inside."""
    a, b, c = (part[0][part[1][:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def united(parts: list[Part]) -> Part:
    """One surface around parts that overlap. Parts that lie apart, a hollow, and a part inside
    another, which may be meant for one, are refused."""
    apart = (
        f"the surface is in {len(parts)} pieces, a block is one without hollows; unite what "
        "belongs together where it was drawn, and make a file of each block"
    )
    import manifold3d

    outward = _outward(parts)
    if any(volume(part) <= 0 for part in outward):
        raise NotOne(apart)
    found = [
        manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))
        for points, triangles in outward
    ]
    if any(solid.status() != manifold3d.Error.NoError for solid in found):
        raise NotOne(apart)
    add = manifold3d.OpType.Add
    whole = manifold3d.Manifold.batch_boolean(found, add)
    if len(whole.decompose()) != 1:
        raise NotOne(apart)
    for k, solid in enumerate(found):
        others = manifold3d.Manifold.batch_boolean(found[:k] + found[k + 1 :], add)
        if whole.volume() - others.volume() <= SWALLOWED * solid.volume():
            raise NotOne(
                f"part {k + 1} of {len(parts)} lies inside the others: a hollow, or left over? "
                "take it out where it was drawn"
            )
    mesh = whole.to_mesh64()
    return np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, np.int64)


def words(number: int, before: float, after: float) -> str:
    """What uniting parts changed; volumes before (all parts together) and after."""
    return f"{number} parts were united: {after / before - 1:+.2%} of their volumes together"


def coarser(part: Part, faces: int) -> Part:
    """The surface with `faces` triangles at most, by the collapse of edges that change it least
    (quadric errors of planes, volume kept where it can be)."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    points, corners = vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(part[0]), deep=True))
    starts = np.arange(0, 3 * len(part[1]) + 1, 3)
    corners.SetData(
        numpy_to_vtkIdTypeArray(starts, deep=True),
        numpy_to_vtkIdTypeArray(part[1].ravel().astype(np.int64), deep=True),
    )
    data, reduce = vtkPolyData(), vtkQuadricDecimation()
    data.SetPoints(points)
    data.SetPolys(corners)
    reduce.SetInputData(data)
    reduce.SetTargetReduction(1 - faces / len(part[1]))
    reduce.VolumePreservationOn()
    reduce.Update()
    found = reduce.GetOutput()
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(found.GetPoints().GetData()).astype(float), triangles.astype(np.int64)


def _outward(parts: list[Part]) -> list[Part]:
    """Parts whose triangles turn all one way; all of them outward if all were seen from inside."""
    import trimesh

    found = []
    for points, triangles in parts:
        mesh = trimesh.Trimesh(points, triangles, process=False)
        mesh.remove_unreferenced_vertices()
        if not mesh.is_winding_consistent:
            trimesh.repair.fix_normals(mesh, multibody=False)  # type: ignore[no-untyped-call]
        found.append((np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)))
    if all(volume(part) < 0 for part in found):
        return [(points, triangles[:, ::-1]) for points, triangles in found]
    return found
