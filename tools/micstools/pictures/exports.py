"""A run in the formats of other programs: a named object per block, SI units, z up."""

import json
from collections.abc import Callable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from micstools.files import table_text, write
from micstools.pictures import gltf
from micstools.reading import vtk_data
from micstools.reading.overlap import present_bodies
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray, normals

FILMED = 30  # frames a second
FAR = 100  # lengths of the tank from 0, 0, 0: coordinates of a survey
Writer = Callable[[Run, int, Path], Path]


def to_csv(run: Run, _row: int, folder: Path) -> Path:
    """Place, attitude, velocity and forces of every block at every row."""
    return run.to_csv(folder / "blocks.csv")


def to_final_csv(run: Run, row: int, folder: Path) -> Path:
    """Place and attitude of every released block at a row; blocks count from 1."""
    b, path, rows = run.bodies, folder / "final.csv", []
    names = ["block", "shape", "fixed", "x", "y", "z", "qw", "qx", "qy", "qz"]
    for k in np.flatnonzero(b.there(row)):
        pose = [*b.position[row, k].tolist(), *b.quaternion[row, k].tolist()]
        rows.append(dict(zip(names, [int(k) + 1, b.shape[k], int(b.fixed[k]), *pose], strict=True)))
    write(path, table_text(rows, names))
    return path


def local_origin(run: Run, folder: Path) -> Array:
    """What is 0, 0, 0 of STL and OBJ files, whose readers hold seven digits: beside coordinates of
    a survey the lower corner of the tank in whole metres. `origin.json` tells it."""
    far = np.abs(run.grid.low).max() > FAR * (run.grid.high - run.grid.low).min()
    origin = np.floor(run.grid.low) if far else np.zeros(3)
    told = {"of": ["pile.stl", "pile.obj"], "origin": origin.tolist(), "unit": "m"}
    write(folder / "origin.json", json.dumps(told) + "\n")
    return origin


def to_stl(run: Run, row: int, folder: Path) -> Path:
    """The released blocks at a row, a solid each, as text."""
    path, origin = folder / "pile.stl", local_origin(run, folder)
    with path.open("w") as file:
        for k, body in present_bodies(run, row).items():
            file.write(_solid(f"block-{k + 1}", body.triangles - origin))
    return path


def to_shapes(run: Run, _row: int, folder: Path) -> Path:
    """Every shape, each stone of a family too, in its body axes: `shapes/NAME.stl`, as text."""
    path = folder / "shapes"
    path.mkdir(exist_ok=True)
    for name, shape in run.shapes.items():
        (path / f"{name}.stl").write_text(_solid(name, shape.points[shape.triangles]))
    return path


def to_obj(run: Run, row: int, folder: Path) -> Path:
    """The released blocks at a row, an object each."""
    path, origin, first = folder / "pile.obj", local_origin(run, folder), 1
    with path.open("w") as file:
        file.write(f"# 0, 0, 0 is {', '.join(map(repr, origin.tolist()))} m of the run\n")
        for k, body in present_bodies(run, row).items():
            points = body.points - origin
            file.write(f"o block-{k + 1}\n")
            file.writelines(f"v {_words(point)}\n" for point in points)
            for triangle in body.shape.triangles + first:
                file.write(f"f {' '.join(map(str, triangle))}\n")
            first += len(points)
    return path


def to_glb(run: Run, _row: int, folder: Path) -> Path:
    """The fall of all blocks."""
    path = folder / "fall.glb"
    gltf.write(run, _film_rows(run), path)
    return path


def to_pvd(run: Run, _row: int, folder: Path) -> Path:
    """Blocks and water for ParaView before 5.12: a .vtp file, and a .vti file where there are
    fields, for each time, and a list of each."""
    import pyvista as pv

    times = run.field_times if run.field_times.size else run.bodies.time[_film_rows(run)]
    parts: dict[str, list[tuple[float, str]]] = {}
    for frame, time in enumerate(times):
        if run.bodies.n:
            name = f"blocks-{frame:05d}.vtp"
            blocks = vtk_data.blocks(run, run.bodies.row(time)).values()
            pv.PolyData().append_polydata(*blocks).save(folder / name)
            parts.setdefault("blocks", []).append((float(time), name))
        if run.field_times.size:
            name = f"fields-{frame:05d}.vti"
            vtk_data.cells(run, run.fields_at(time)).save(folder / name)
            parts.setdefault("fields", []).append((float(time), name))
    for what, files in parts.items():
        (folder / f"{what}.pvd").write_text(_collection(files))
    return folder / f"{next(iter(parts))}.pvd"


def _film_rows(run: Run) -> IntArray:
    """Rows evenly in time, first and last among them."""
    time = run.bodies.time
    wanted = np.linspace(time[0], time[-1], int(FILMED * (time[-1] - time[0])) + 2)
    return np.unique(np.searchsorted(time, wanted).clip(0, len(time) - 1))


def _collection(files: list[tuple[float, str]]) -> str:
    """The text of a .pvd file."""
    lines = [
        f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(name)}/>\n'
        for time, name in files
    ]
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        + "".join(lines)
        + "  </Collection>\n</VTKFile>\n"
    )


def _solid(name: str, corners: Array) -> str:
    """Triangles (m, 3, 3) as a solid of an STL file."""
    lines = [f"solid {name}\n"]
    for normal, triangle in zip(normals(corners), corners, strict=True):
        lines.append(f"facet normal {_words(normal)}\nouter loop\n")
        lines += [f"vertex {_words(corner)}\n" for corner in triangle]
        lines.append("endloop\nendfacet\n")
    return "".join(lines) + f"endsolid {name}\n"


def _words(values: Array) -> str:
    return " ".join(f"{v:.9g}" for v in values)


FORMATS: dict[str, Writer] = {
    "glb": to_glb,
    "stl": to_stl,
    "shapes": to_shapes,
    "obj": to_obj,
    "csv": to_csv,
    "pvd": to_pvd,
}
"""What can be written, by its ending."""
