"""Measured ground as a map of heights for `&bed`: from Esri .asc, points in .xyz, and GeoTIFF.

A height belongs to the middle of its cell, so a map reaches half a cell less far than a raster.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from micstools.reading.reader import BadRun
from micstools.shapes.geometry import Array

MARKS = (-9999.0, -99999.0, -999999.0, -32768.0, -32767.0, 9999.0, 32767.0)
"""Heights that the program takes for the mark of a missing one, too."""
GROUND = (-12_000.0, 9_000.0)
"""Heights that ground on Earth can have [m]."""
MOST_POINTS = 20_000_000
"""Points of a map that the program reads."""
OFF_GRID = 0.03
"""How far a point of a regular grid may lie aside, for rounded figures, over the spacing."""
NARROW = 1e-7
"""Width of places on one line, over their length; rounding leaves less."""
_HEADER = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize",
           "dx", "dy", "nodata_value")  # fmt: skip


@dataclass(frozen=True)
class HeightMap:
    """Heights on a regular grid."""

    first: tuple[float, float]  # the point of least x and y [m]
    spacing: tuple[float, float]  # in x and y, positive [m]
    z: Array  # (ny, nx), y rising [m]; nan where none is known

    @property
    def missing(self) -> int:
        """Points without a height."""
        return int(np.isnan(self.z).sum())

    @property
    def last(self) -> tuple[float, float]:
        """The point of largest x and y [m]."""
        (x, y), (dx, dy), (ny, nx) = self.first, self.spacing, self.z.shape
        return x + (nx - 1) * dx, y + (ny - 1) * dy


def load(path: Path, grid: float | None = None, marks: Sequence[float] = ()) -> HeightMap:
    """The map of a file; `grid` [m] draws scattered points of an .xyz file to that spacing.

    `marks` are heights that stand for a missing one, beside those of the file.
    """
    readers: dict[str, Callable[[Path], HeightMap]] = {
        ".asc": lambda p: _esri(p, marks),
        ".xyz": lambda p: _points(p, grid, marks),
        ".tif": lambda p: _geotiff(p, marks),
        ".tiff": lambda p: _geotiff(p, marks),
    }
    if path.suffix.lower() not in readers:
        raise BadRun(f"{path}: must end in one of {', '.join(readers)}")
    if grid is not None and path.suffix.lower() != ".xyz":
        raise BadRun(f"--grid {grid:g}: is for scattered points, in .xyz files")
    found = readers[path.suffix.lower()](path)
    if min(found.z.shape) < 2:
        raise BadRun(f"{path}: a map of heights needs two points at least in x and y")
    if not np.isfinite(found.z).any():
        raise BadRun(f"{path}: holds no height")
    return found


def require_ground(found: HeightMap) -> None:
    """Refuse heights that are no height of ground, or that mark a missing one in other files."""
    outside = (found.z < GROUND[0]) | (found.z > GROUND[1])  # nan is neither
    doubtful = outside | np.isin(found.z, MARKS)
    if not doubtful.any():
        return
    row, column = np.argwhere(doubtful)[0]
    x, y = np.array(found.first) + np.array(found.spacing) * (column, row)
    z = float(found.z[row, column])
    if outside[row, column]:
        said = f"ground has heights of {GROUND[0]:,.0f} to {GROUND[1]:,.0f} m"
    else:
        said = "is it the mark of a missing one?"
    raise BadRun(
        f"{int(doubtful.sum())} of {found.z.size} points have doubtful heights, the first "
        f"{z:.9g} m at {x:.10g}, {y:.10g}: {said}; --nodata={z:.9g} takes it as missing, "
        "--window cuts it off"
    )


def filled(found: HeightMap, height: float | None) -> HeightMap:
    """The map with a height where none is known; without one such places are refused."""
    if not found.missing:
        return found
    if height is None:
        row, column = np.argwhere(np.isnan(found.z))[0]
        x, y = np.array(found.first) + np.array(found.spacing) * (column, row)
        raise BadRun(
            f"{found.missing} of {found.z.size} points have no height, the first at {x:.10g}, "
            f"{y:.10g}: cut them off with --window, or give --fill HEIGHT"
        )
    return replace(found, z=np.where(np.isnan(found.z), height, found.z))


def cut(found: HeightMap, low: tuple[float, float], high: tuple[float, float]) -> HeightMap:
    """The least part of the map that covers the rectangle from `low` to `high` [m]."""
    if any(a >= b for a, b in zip(low, high, strict=True)):
        raise BadRun("--window: must be X0,Y0,X1,Y1, the lower corner first")
    axes, first = [], []
    for a, b, start, step, n in zip(
        low, high, found.first, found.spacing, found.z.shape[::-1], strict=True
    ):
        begin, end = int((a - start) / step + 1e-6), int(np.ceil((b - start) / step - 1e-6))
        if a < start - 1e-6 * step or end > n - 1:
            x, y = (f"{p:.10g} to {q:.10g}" for p, q in zip(found.first, found.last, strict=True))
            raise BadRun(f"--window: the map covers x {x} and y {y} m only")
        axes.append(slice(begin, end + 1))
        first.append(start + begin * step)
    return HeightMap((first[0], first[1]), found.spacing, found.z[axes[1], axes[0]])


def moved(found: HeightMap, origin: tuple[float, ...], scale: float) -> HeightMap:
    """The map with `origin` (3) as its new 0, 0, 0, all then times `scale`."""
    (x, y), (dx, dy) = found.first, found.spacing
    return HeightMap(
        (scale * (x - origin[0]), scale * (y - origin[1])),
        (scale * dx, scale * dy),
        scale * (found.z - origin[2]),
    )


def write(path: Path, found: HeightMap, remark: str) -> None:
    """The file that `&bed file` names."""
    ny, nx = found.z.shape
    place = " ".join(f"{x:.12g}" for x in (*found.first, *found.spacing))
    lines = [f"# {remark}", f"{nx} {ny} {place}"]
    lines += [" ".join(f"{z:.9g}" for z in row) for row in found.z]
    path.write_text("\n".join(lines) + "\n")


def report(found: HeightMap) -> str:
    """What the map covers, in lines to read."""
    (ny, nx), (dx, dy) = found.z.shape, found.spacing
    rows = [
        ("points", f"{nx} x {ny}, {dx:.6g} x {dy:.6g} m apart"),
        ("x", f"{found.first[0]:.10g} to {found.last[0]:.10g} m"),
        ("y", f"{found.first[1]:.10g} to {found.last[1]:.10g} m"),
        ("heights", f"{found.z.min():.6g} to {found.z.max():.6g} m"),
    ]
    return "\n".join(f"{name:10}{text}" for name, text in rows)


def _without_marks(z: Array, marks: Sequence[float]) -> Array:
    """Heights with nan for the marks of a missing one.

    A mark may be rounded otherwise than the data: to single precision, or, where neither can be
    a height, to six figures.
    """
    missing = ~np.isfinite(z)
    for mark in marks:
        missing |= np.isclose(z, mark, rtol=1e-5 if abs(mark) > 1e20 else 2.0**-23, atol=0)
    return np.where(missing, np.nan, z)


def _number(path: Path, word: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise BadRun(f"{path}: {word[:20]!r} stands where a number should") from None


def _numbers(path: Path, words: list[str]) -> Array:
    try:
        return np.array(words, dtype=float)
    except ValueError:
        return np.array([_number(path, word) for word in words])


def _esri(path: Path, marks: Sequence[float]) -> HeightMap:
    """An Esri ASCII raster: its rows come from the north."""
    words = path.read_text("utf-8-sig", errors="replace").split()
    head: dict[str, float] = {}
    at = 0
    while at + 1 < len(words) and words[at].lower() in _HEADER:
        head[words[at].lower()] = _number(path, words[at + 1])
        at += 2
    edges = [head.get(name, head.get("cellsize", np.nan)) for name in ("dx", "dy")]
    first = []
    for axis, edge in zip("xy", edges, strict=True):
        corner = head.get(f"{axis}llcorner", np.nan) + edge / 2
        first.append(head.get(f"{axis}llcenter", corner))
    shape = [head.get(name, np.nan) for name in ("nrows", "ncols")]
    if not np.isfinite([*edges, *first, *shape]).all() or min(*edges, *shape) <= 0:
        raise BadRun(
            f"{path}: no whole header of an Esri raster (ncols, nrows, xllcorner, yllcorner, "
            "cellsize)"
        )
    ny, nx = (int(n) for n in shape)
    if len(words) - at != nx * ny:
        raise BadRun(f"{path}: holds {len(words) - at} heights, {nx} x {ny} were announced")
    z = _numbers(path, words[at:]).reshape(ny, nx)[::-1]
    z = _without_marks(z, [head.get("nodata_value", -9999.0), *marks])
    return HeightMap((first[0], first[1]), (edges[0], edges[1]), z)


def _points(path: Path, grid: float | None, marks: Sequence[float]) -> HeightMap:
    """Points x, y, z in lines, parted by blanks, commas or semicolons; the first may be names."""
    text = path.read_text("utf-8-sig", errors="replace").replace(",", " ").replace(";", " ")
    rows = [line.split("#")[0].split() for line in text.splitlines()]
    rows = [row for row in rows if row]
    if rows and not any(map(_is_number, rows[0])):
        rows = rows[1:]
    if not rows or any(len(row) != 3 for row in rows):
        raise BadRun(f"{path}: must hold x, y and z in each line")
    points = _numbers(path, [word for row in rows for word in row]).reshape(-1, 3)
    if not np.isfinite(points[:, :2]).all():
        raise BadRun(f"{path}: a place is not a number")
    points[:, 2] = _without_marks(points[:, 2], [*MARKS, *marks])
    if grid is None:
        _require_width(path, points[:, :2])
        return _regular(path, points)
    known = points[np.isfinite(points[:, 2])]
    if not len(known):
        raise BadRun(f"{path}: holds no height")
    _require_width(path, known[:, :2])
    return _drawn(path, known, grid)


def _require_width(path: Path, places: Array) -> None:
    """Refuse places (n, 2) on one line, which no triangles join."""
    across = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if len(across) < 2 or across[1] <= NARROW * across[0]:
        raise BadRun(
            f"{path}: all points stand on one line; a bed needs points beside it, and one that is "
            "the same across the tank needs the line twice, along both sides"
        )


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _regular(path: Path, points: Array) -> HeightMap:
    """The map of points (n, 3) that stand on a regular grid, in any order."""
    first, numbers, spacing = points[:, :2].min(axis=0), [], []
    for axis in range(2):
        values = points[:, axis] - first[axis]
        gaps = np.diff(np.unique(values))
        gaps = gaps[gaps > OFF_GRID * gaps.max()]
        count = round(float(values.max() / gaps.min()))
        spacing.append(float(values.max()) / count)
        numbers.append(np.rint(values / spacing[-1]).astype(np.int64))
        aside = np.abs(values / spacing[-1] - numbers[-1]).max()
        if aside > OFF_GRID:
            raise BadRun(
                f"{path}: the points stand on no regular grid; --grid SPACING draws one through "
                "them"
            )
    nx, ny = (int(n.max()) + 1 for n in numbers)
    if nx * ny > 100 * len(points):
        raise BadRun(
            f"{path}: {len(points)} points for a grid of {nx} x {ny}; --grid SPACING draws a "
            "coarser one through them"
        )
    place = numbers[1] * nx + numbers[0]
    if len(np.unique(place)) < len(place):
        raise BadRun(f"{path}: two points stand in the same place")
    z = np.full(nx * ny, np.nan)
    z[place] = points[:, 2]
    return HeightMap(
        (float(first[0]), float(first[1])), (spacing[0], spacing[1]), z.reshape(ny, nx)
    )


def _drawn(path: Path, points: Array, grid: float) -> HeightMap:
    """Heights on a grid, linear on the triangles between points (n, 3) with heights; nan outside of
    them."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    if not grid > 0:
        raise BadRun(f"--grid {grid:g}: must be positive [m]")
    low = points[:, :2].min(axis=0)
    x, y = (points[:, :2] - low).T
    nx, ny = (int(float(values.max()) / grid + 1e-9) + 1 for values in (x, y))
    if nx * ny > MOST_POINTS:
        raise BadRun(f"--grid {grid:g}: {nx} x {ny} points, more than {MOST_POINTS}")
    try:
        triangles = Triangulation(x, y)
    except (ValueError, RuntimeError) as error:
        raise BadRun(f"{path}: no triangles fit between the points") from error
    at = np.meshgrid(grid * np.arange(nx), grid * np.arange(ny))
    z = LinearTriInterpolator(triangles, points[:, 2])(*at)
    return HeightMap((float(low[0]), float(low[1])), (grid, grid), z.filled(np.nan))


def _geotiff(path: Path, marks: Sequence[float]) -> HeightMap:
    """A GeoTIFF with one band of integers or single precision, in metres; Pillow unpacks it, its
    tags tell where it lies."""
    from PIL import Image

    try:
        with (
            warnings.catch_warnings(action="ignore"),
            Image.open(path, formats=["TIFF"]) as image,
        ):
            if image.mode not in ("F", "I", "L") and not image.mode.startswith("I;16"):
                raise BadRun(f"{path}: holds colours, not heights")
            tags = {int(key): image.tag_v2[key] for key in image.tag_v2}  # type: ignore[attr-defined]
            z = np.asarray(image).astype(float)
    except (Image.DecompressionBombError, SyntaxError, ValueError, OSError) as error:
        if isinstance(error, FileNotFoundError):
            raise
        raise BadRun(
            f"{path}: cannot be read ({error}); gdal_translate -ot Float32 makes one that can"
        ) from error
    corner, step = _place(path, tags)
    mark = tags.get(42113)
    own = MARKS if mark is None else (_number(path, str(mark).strip("\0 ")),)
    z = _without_marks(z, [*own, *marks])
    if step[1] < 0:  # rows come from the north, as a rule
        z, corner[1], step[1] = z[::-1], corner[1] + (len(z) - 1) * step[1], -step[1]
    return HeightMap((corner[0], corner[1]), (step[0], step[1]), z)


def _place(path: Path, tags: dict[int, tuple[float, ...]]) -> tuple[list[float], list[float]]:
    """Middle of the first pixel, and the step from one to the next."""
    keys = tags.get(34735, ())
    known = {keys[k]: keys[k + 3] for k in range(4, len(keys) - 3, 4) if keys[k + 1] == 0}
    if known.get(1024) == 2:
        raise BadRun(f"{path}: lies in degrees; gdalwarp -t_srs makes one in metres of it")
    middle = 0.0 if known.get(1025) == 2 else 0.5  # pixels are points, or areas
    if 34264 in tags:
        m = tags[34264]
        if m[1] or m[4]:
            raise BadRun(f"{path}: is turned; gdalwarp makes one along x and y of it")
        step, corner = [m[0], m[5]], [m[3], m[7]]
    elif 33550 in tags and len(tags.get(33922, ())) == 6:
        (sx, sy), (i, j, _, x, y, _) = tags[33550][:2], tags[33922]
        step = [sx, -sy]
        corner = [x - i * step[0], y - j * step[1]]
    else:
        raise BadRun(f"{path}: does not tell where it lies, it is no GeoTIFF")
    if not step[0] > 0 or not step[1]:
        raise BadRun(f"{path}: its columns do not run to the east")
    return [c + middle * s for c, s in zip(corner, step, strict=True)], step
