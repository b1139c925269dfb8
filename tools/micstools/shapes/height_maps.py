"""Measured ground as a map of heights for `&bed`: from Esri .asc, points in .xyz or .csv, GeoTIFF.

A height belongs to the middle of its cell, so a map reaches half a cell less far than a raster.
"""

import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from micstools.extras import need
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
SURVEY = 1e4
"""Beyond this coordinates are those of a survey, not of a tank [m]."""
NARROW = 1e-7
"""Width of places on one line, over their length; rounding leaves less."""
FAR = 3.0
"""What lies farther than so many mean spacings from any point of a survey is a gap in it."""
UNITS = {
    1.0: ("m", "metre", "metres", "meter", "meters"),
    0.01: ("cm", "centimetre", "centimeter"),
    0.001: ("mm", "millimetre", "millimeter"),
    0.3048: ("ft", "foot", "feet", "international foot"),
    1200 / 3937: ("us-ft", "us survey foot", "us survey feet", "ftus", "usft", "us ft", "foot us"),
}
"""Metres in a unit of length, and its names."""
_HEADER = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize",
           "dx", "dy", "nodata_value")  # fmt: skip


@dataclass(frozen=True)
class HeightMap:
    """Heights on a regular grid."""

    first: tuple[float, float]  # the point of least x and y [m]
    spacing: tuple[float, float]  # in x and y, positive [m]
    z: Array  # (ny, nx), y rising [m]; nan where none is known
    remarks: tuple[str, ...] = ()  # what was changed of the numbers of the file

    @property
    def missing(self) -> int:
        """Points without a height."""
        return int(np.isnan(self.z).sum())

    @property
    def last(self) -> tuple[float, float]:
        """The point of largest x and y [m]."""
        (x, y), (dx, dy), (ny, nx) = self.first, self.spacing, self.z.shape
        return x + (nx - 1) * dx, y + (ny - 1) * dy


def metres(path: Path, unit: str) -> float:
    """One unit of length in metres."""
    name = unit.strip().lower().replace("_", " ").rstrip(".")
    for factor, names in UNITS.items():
        if name in names:
            return factor
    known = ", ".join(names[0] for names in UNITS.values())
    raise BadRun(f"{path}: the unit {unit!r} is none of {known}")


def load(
    path: Path, grid: float | None = None, marks: Sequence[float] = (), unit: str | None = None
) -> HeightMap:
    """The map of a file in metres; `grid` [m] draws scattered points of an .xyz file to that
    spacing.

    `marks` are heights that stand for a missing one, beside those of the file; `unit` is that of
    the numbers whose unit the file does not tell.
    """
    readers: dict[str, Callable[[Path], HeightMap]] = {
        ".asc": lambda p: _in_metres(p, _esri(p, marks), unit),
        ".xyz": lambda p: _points(p, grid, marks, unit),
        ".csv": lambda p: _points(p, grid, marks, unit),
        ".tif": lambda p: _geotiff(p, marks, unit),
        ".tiff": lambda p: _geotiff(p, marks, unit),
    }
    if path.suffix.lower() not in readers:
        raise BadRun(f"{path}: must end in one of {', '.join(readers)}")
    if grid is not None and path.suffix.lower() not in (".xyz", ".csv"):
        raise BadRun(f"--grid {grid:g}: is for scattered points, in .xyz and .csv files")
    found = readers[path.suffix.lower()](path)
    if min(found.z.shape) < 2:
        raise BadRun(f"{path}: a map of heights needs two points at least in x and y")
    if not np.isfinite(found.z).any():
        raise BadRun(f"{path}: holds no height")
    return found


def _in_metres(path: Path, found: HeightMap, unit: str | None) -> HeightMap:
    factor = metres(path, unit or "m")
    if factor == 1:
        return found
    return replace(moved(found, (0, 0, 0), factor), remarks=(f"from {unit} to m",))


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
    return replace(found, first=(first[0], first[1]), z=found.z[axes[1], axes[0]])


def moved(found: HeightMap, origin: tuple[float, ...], scale: float) -> HeightMap:
    """The map with `origin` (3) as its new 0, 0, 0, all then times `scale`."""
    (x, y), (dx, dy) = found.first, found.spacing
    return HeightMap(
        (scale * (x - origin[0]), scale * (y - origin[1])),
        (scale * dx, scale * dy),
        scale * (found.z - origin[2]),
        found.remarks,
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
    rows += [("note", remark) for remark in found.remarks]
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


_NAMES = (("x", "e", "east", "easting"), ("y", "n", "north", "northing"),
          ("z", "h", "height", "elevation", "level", "depth", "water depth"))  # fmt: skip
"""What the columns x, y and z are called."""
_SUFFIX = "|".join(re.escape(name) for names in UNITS.values() for name in names)
_BRACKETS = r"[\[(]\s*([^\])]+?)\s*[\])]"


def _columns(path: Path, head: str, unit: str | None) -> tuple[list[int], Array, int]:
    """Where x, y and z stand by the names of a head, as in `x [ft], y (ft), z_m`; metres in the
    unit of each, of all where none or one is told; how many columns. Depths count down."""
    if re.search("[,;\t]", head):
        cells = re.split("[,;\t]", head)
    else:
        cells = [m[0] for m in re.finditer(rf"[^\s\[(]+(\s*{_BRACKETS})?", head)]
    unit_of = re.compile(rf"(?i){_BRACKETS}|_({_SUFFIX})\s*$")
    told = ["".join((unit_of.findall(cell) or [""])[0]) for cell in cells]
    names = [unit_of.sub("", cell).strip(' \t"').lower() for cell in cells]
    places = [[k for k, name in enumerate(names) if name in wanted] for wanted in _NAMES]
    if any(len(at) != 1 for at in places):
        raise BadRun(f"{path}: columns must be named x, y and z, or easting, northing, elevation "
                     f"or depth: {head.strip()}")  # fmt: skip
    at = [k for (k,) in places]
    units = [told[k] for k in at if told[k]]
    if len(units) not in (0, 1, 3):
        raise BadRun(f"{path}: tells the units of {len(units)} columns of three: {head.strip()}")
    units = units * 3 if len(units) == 1 else units or [unit or "m"] * 3
    down = np.array([1, 1, -1 if "depth" in names[at[2]] else 1])
    return at, down * [metres(path, name) for name in units], len(names)


def _points(path: Path, grid: float | None, marks: Sequence[float], unit: str | None) -> HeightMap:
    """Points x, y, z in lines, parted by blanks, commas or semicolons; the first may be names."""
    text = path.read_text("utf-8-sig", errors="replace").splitlines()
    rows = [re.split(r"[\s,;]+", line.split("#")[0].strip(" \t,;")) for line in text]
    lines = [line for line, row in zip(text, rows, strict=True) if row != [""]]
    rows = [row for row in rows if row != [""]]
    xyz, factors, wide = _columns(path, "x y z", unit)
    if rows and not any(map(_is_number, rows[0])):
        xyz, factors, wide = _columns(path, lines[0], unit)
        rows = rows[1:]
    if not rows or any(len(row) != wide for row in rows):
        raise BadRun(f"{path}: must hold x, y and z in each line")
    points = _numbers(path, [row[k] for row in rows for k in xyz]).reshape(-1, 3)
    if not np.isfinite(points[:, :2]).all():
        raise BadRun(f"{path}: a place is not a number")
    points[:, 2] = _without_marks(points[:, 2], [*MARKS, *marks])
    remarks = ("from other units to m",) * bool((np.abs(factors) != 1).any())
    if factors[2] < 0 and (points[:, 2] > 0).any():
        remarks += ("depths, which count down",)
        points[:, 2] *= -1
    points *= np.abs(factors)
    said = re.findall(rf"(?i)#.*?\b({_SUFFIX})\b", "\n".join(text[:20]))
    if said and not unit and (factors == 1).all() and metres(path, said[0]) != 1:
        remarks += (f"a remark speaks of {said[0]}; taken in m, --unit tells another one",)
    behind = [(n, re.split(r"[\s,;]+", line.strip("# \t,;"))) for n, line in enumerate(text, 1)
              if line.lstrip()[:1] == "#"]  # fmt: skip
    lost = [n for n, row in behind if len(row) == wide and all(_is_number(row[k]) for k in xyz)]
    if lost:
        remarks += (f"remarks look like points, {len(lost)} in all, the first on line {lost[0]}",)
    if grid is None:
        _require_width(path, points[:, :2])
        return replace(_regular(path, points), remarks=remarks)
    known = points[np.isfinite(points[:, 2])]
    if not len(known):
        raise BadRun(f"{path}: holds no height")
    _require_width(path, known[:, :2])
    places, at, times = np.unique(known[:, :2], axis=0, return_inverse=True, return_counts=True)
    heights = np.bincount(at.ravel(), known[:, 2]) / times
    if (times > 1).any():
        remarks += (f"{int((times > 1).sum())} places sounded more than once: their mean",)
    found = _drawn(path, np.column_stack([places, heights]), grid)
    return replace(found, remarks=remarks + found.remarks)


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
    them, and in gaps between them."""
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
    z = LinearTriInterpolator(triangles, points[:, 2])(*at).filled(np.nan)
    inside = np.asarray(triangles.get_trifinder()(*at), dtype=np.int64)
    corner = (points[:, :2] - low)[triangles.triangles[inside]]  # (ny, nx, 3, 2)
    away = np.linalg.norm(corner - np.stack(at, axis=-1)[:, :, None], axis=3).min(axis=2)
    far = FAR * float(np.sqrt(np.ptp(x) * np.ptp(y) / len(points)))
    gap = (inside >= 0) & (away > far)
    z[gap] = np.nan
    said = f"{int(gap.sum())} points of the grid lie farther than {far:.3g} m from any sounding"
    remarks = (said,) if gap.any() else ()
    return HeightMap((float(low[0]), float(low[1])), (grid, grid), z, remarks)


def _geotiff(path: Path, marks: Sequence[float], unit: str | None) -> HeightMap:
    """A GeoTIFF with one band of heights: its units, scale, offset, mark and place are its own."""
    need("survey")
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    try:
        with (
            warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning),
            rasterio.open(path, driver="GTiff") as raster,
        ):
            if raster.count != 1 or np.issubdtype(raster.dtypes[0], np.complexfloating):
                raise BadRun(f"{path}: holds colours, not heights")
            z = raster.read(1).astype(float)
            (a, b, c, d, e, f), crs, mark = raster.transform[:6], raster.crs, raster.nodata
            scale, offset, told = raster.scales[0], raster.offsets[0], raster.units[0]
    except RasterioError as error:
        if not path.exists():
            raise FileNotFoundError(path) from error
        raise BadRun(f"{path}: cannot be read ({error}); gdal_translate may mend it") from error
    if (a, b, c, d, e, f) == (1, 0, 0, 0, 1, 0):
        raise BadRun(f"{path}: does not tell where it lies, it is no GeoTIFF")
    if crs is not None and crs.is_geographic:
        raise BadRun(f"{path}: lies in degrees; gdalwarp -t_srs makes one in metres of it")
    if b or d:
        raise BadRun(f"{path}: is turned; gdalwarp makes one along x and y of it")
    if a <= 0 or not e:
        raise BadRun(f"{path}: its columns do not run to the east")
    z = offset + scale * _without_marks(z, [*(MARKS if mark is None else (mark,)), *marks])
    ground = crs.linear_units if crs is not None and crs.is_projected else _unit_key(path)
    along = metres(path, ground)
    if not (told or unit) and along != 1:
        raise BadRun(f"{path}: lies in {ground} and does not tell the unit of its heights: give "
                     "--unit")  # fmt: skip
    x, y = along * (c + a / 2), along * (f + e / 2)
    step = [along * a, along * e]
    heights = told or unit or "m"
    factor = metres(path, heights)
    z *= factor
    if step[1] < 0:  # rows come from the north, as a rule
        z, y, step[1] = z[::-1], y + (len(z) - 1) * step[1], -step[1]
    remarks = [f"places in the system {crs.to_string()[:40]}"] * (crs is not None)
    remarks += [f"heights times {scale:g} plus {offset:g}"] * ((scale, offset) != (1, 0))
    remarks += [f"from {ground} to m"] * (along != 1)
    remarks += [f"heights from {heights} to m"] * (factor != 1)
    return HeightMap((x, y), (step[0], step[1]), z, tuple(remarks))


def _unit_key(path: Path) -> str:
    """The unit of a GeoTIFF whose system has no other name: its key 3076, which GDAL passes over
    then."""
    from PIL import Image

    with Image.open(path, formats=["TIFF"]) as image:
        keys = image.tag_v2.get(34735, ())  # type: ignore[attr-defined]
    known = {keys[k]: keys[k + 3] for k in range(4, len(keys) - 3, 4)}
    code = known.get(3076, 9001)
    return {9001: "m", 9002: "foot", 9003: "US survey foot"}.get(code, f"EPSG:{code}")
