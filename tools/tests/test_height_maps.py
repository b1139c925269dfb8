"""Measured ground becomes a map of heights; what is missing or stands askew is refused."""

import re
import tomllib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from PIL import Image, TiffImagePlugin

from calls import mics_tools, needs_mics, plan_of, python
from micstools.reading.reader import BadRun
from micstools.shapes import height_maps

# From y_min to y_max, x in each row.
Z = 10.0 * np.arange(3)[:, None] + np.arange(4)
POINTS = [(101.0 + 2 * k, 201.0 + 2 * j, z) for (j, k), z in np.ndenumerate(Z)]
TABLES = tomllib.loads(Path(__file__).with_name("height_maps.toml").read_text())
ESRI: str = TABLES["esri"]


def same(found: height_maps.HeightMap, z: np.ndarray = Z) -> None:
    """The map of ESRI: middles of its cells."""
    assert found.first == pytest.approx((101.0, 201.0))
    assert found.spacing == pytest.approx((2.0, 2.0))
    assert np.array_equal(found.z, z, equal_nan=True)


def save(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_an_esri_raster(tmp_path: Path) -> None:
    same(height_maps.load(save(tmp_path / "a.asc", ESRI)))
    centre = ESRI.replace("xllcorner 100", "XLLCENTER 101").replace(
        "yllcorner 200", "yllcenter 201"
    )
    same(height_maps.load(save(tmp_path / "b.asc", centre)))
    oblong = ESRI.replace("cellsize 2.0", "dx 2.0\ndy 4.0")
    assert height_maps.load(save(tmp_path / "c.ASC", oblong)).last == pytest.approx((107.0, 210.0))


def test_points_in_any_order(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).permutation(POINTS)
    for separator, head in ((" ", ""), (",", "x,y,z\n"), (";\t", "# a remark\n")):
        text = head + "\n".join(separator.join(map(str, row)) for row in rows)
        same(height_maps.load(save(tmp_path / "a.xyz", text)))


@pytest.mark.parametrize("head", ["", "x,y,z\n", "# Höhen\n"])
def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path, head: str) -> None:
    points = head + "\n".join(f"{x},{y},{z}" for x, y, z in POINTS)
    for name, text in (("a.asc", ESRI), ("a.xyz", points)):
        (tmp_path / name).write_text("\ufeff" + text, encoding="utf-8")
        same(height_maps.load(tmp_path / name))


def test_points_with_rounded_figures_are_a_grid(tmp_path: Path) -> None:
    text = "\n".join(f"{k / 3:.2f} {j / 7:.3f} {k}" for k in range(10) for j in range(8))
    found = height_maps.load(save(tmp_path / "a.xyz", text))
    assert found.z.shape == (8, 10) and not found.missing
    assert found.spacing == pytest.approx((1 / 3, 1 / 7), rel=1e-3)


def test_scattered_points_are_refused_or_drawn(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.random((2, 400)) * [[10.0], [6.0]]
    x[:4], y[:4] = [0, 10, 0, 10], [0, 0, 6, 6]
    rows = np.column_stack([x, y, 3 + 2 * x - y])
    path = save(tmp_path / "a.xyz", "\n".join(" ".join(map(repr, map(float, r))) for r in rows))
    with pytest.raises(BadRun, match="--grid SPACING draws"):
        height_maps.load(path)
    found = height_maps.load(path, 0.5)
    assert found.z.shape == (13, 21)
    inside = found.z[1:-1, 1:-1]
    gx, gy = np.meshgrid(0.5 * np.arange(1, 20), 0.5 * np.arange(1, 12))
    assert inside == pytest.approx(3 + 2 * gx - gy, abs=1e-9)


@pytest.mark.parametrize(("points", "said"), TABLES["no_area"])
def test_points_on_one_line_cannot_be_drawn(tmp_path: Path, points: list, said: str) -> None:
    """A section through a flume, as some solvers write their bed: it is needed twice."""
    path = save(tmp_path / "a.xyz", "\n".join(f"{x!r} {y!r} {z!r}" for x, y, z in points))
    with pytest.raises(BadRun, match=said) as fault:
        height_maps.load(path, 0.5)
    assert "qhull" not in str(fault.value) and "\n" not in str(fault.value)
    if len({x for x, _, _ in points}) > 1 and "line" in said:
        both = "".join(f"{x!r} {y + d!r} {z!r}\n" for x, y, z in points for d in (0.0, 3.0))
        found = height_maps.load(save(path, both), 0.5)
        assert found.z.shape[0] >= 7


def geotiff(path: Path, z: np.ndarray, keys: tuple[int, ...], **more: object) -> Path:
    """Rows from the north, as ESRI above."""
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags.tagtype[33550] = tags.tagtype[33922] = tags.tagtype[34264] = 12
    tags.tagtype[34735], tags.tagtype[42113] = 3, 2
    if keys:
        tags[34735] = keys
    for number, value in more.pop("tags").items():  # type: ignore[attr-defined]
        tags[number] = value
    Image.fromarray(z[::-1]).save(path, tiffinfo=tags, **more)
    return path


AREA, POINT, DEGREES = ((1, 1, 0, 1, 1025, 0, 1, 1), (1, 1, 0, 1, 1025, 0, 1, 2),
                        (1, 1, 0, 1, 1024, 0, 1, 2))  # fmt: skip
SCALE = {33550: (2.0, 2.0, 0.0), 33922: (0.0, 0.0, 0.0, 100.0, 206.0, 0.0)}
TURN = {34264: (2.0, 0, 0, 100.0, 0, -2.0, 0, 206.0, 0, 0, 0, 0, 0, 0, 0, 1.0)}


@pytest.mark.parametrize("tags", [SCALE, TURN])
@pytest.mark.parametrize("kind", [np.float32, np.uint16, np.uint8, np.int32])
@pytest.mark.parametrize("compression", [None, "tiff_lzw"])
def test_a_geotiff(tmp_path: Path, tags: dict, kind: type, compression: str | None) -> None:
    path = geotiff(tmp_path / "a.tif", Z.astype(kind), AREA, tags=tags, compression=compression)
    same(height_maps.load(path))


def test_a_geotiff_of_points_and_gaps(tmp_path: Path) -> None:
    tags = {33550: SCALE[33550], 33922: (1.0, 1.0, 0.0, 103.0, 203.0, 0.0), 42113: "21"}
    found = height_maps.load(geotiff(tmp_path / "a.tif", Z.astype(np.float32), POINT, tags=tags))
    same(found, np.where(Z == 21, np.nan, Z))


@pytest.mark.parametrize("written", ["-3.4028235e+38", "-3.40282e+38", "-3.4028234663852886e+38"])
def test_a_mark_of_single_precision(tmp_path: Path, written: str) -> None:
    """However the lowest number of single precision is rounded, in the data or in the tag."""
    gap = np.where(Z == 12, np.nan, Z)
    for mark, datum in ((written, "-3.4028234663852886e+38"), ("-3.4028235e+38", written)):
        text = ESRI.replace("-99", mark).replace("12", datum)
        same(height_maps.load(save(tmp_path / "a.asc", text)), gap)
    z = np.where(Z == 12, np.finfo(np.float32).min, Z).astype(np.float32)
    path = geotiff(tmp_path / "a.tif", z, AREA, tags={**SCALE, 42113: written})
    same(height_maps.load(path), gap)
    z = np.where(Z == 12, np.float32(-99.99), Z).astype(np.float32)
    path = geotiff(tmp_path / "b.tif", z, AREA, tags={**SCALE, 42113: "-99.99"})
    same(height_maps.load(path), gap)


@pytest.mark.parametrize("height", ["-3.4e38", "1e21", "-12001", "9001", "-32768", "-9999"])
@pytest.mark.parametrize("kind", ["asc", "tif"])
def test_a_doubtful_height_is_asked_about(
    tmp_path: Path, height: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a file that names -99 as its mark; the command refuses it, or takes it as missing."""
    path = save(tmp_path / "a.asc", ESRI.replace("12", height))
    if kind == "tif":
        z = np.where(Z == 12, float(height), Z).astype(np.float32)
        path = geotiff(tmp_path / "a.tif", z, AREA, tags={**SCALE, 42113: "-99"})
    words = ["bed", str(path), "--out", str(tmp_path / "bed.txt")]
    assert mics_tools(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "1 of 12 points have doubtful heights" in line and " at 105, 203: " in line
    assert "--nodata=" + height[0] in line and not (tmp_path / "bed.txt").exists()
    for more in ([f"--nodata={height}", "--fill", "12"], ["--window", "101,201,103,203"]):
        assert mics_tools([*words, *more]) == 0


@pytest.mark.parametrize(
    ("keys", "tags", "said"),
    [
        ((), {}, "does not tell where it lies"),
        (DEGREES, SCALE, "lies in degrees"),
        (AREA, {34264: (2.0, 0.1, *TURN[34264][2:])}, "is turned"),
    ],
)
def test_a_geotiff_without_its_place_is_refused(
    tmp_path: Path, keys: tuple, tags: dict, said: str
) -> None:
    with pytest.raises(BadRun, match=said):
        height_maps.load(geotiff(tmp_path / "a.tif", Z.astype(np.float32), keys, tags=tags))


def in_system(path: Path, epsg: int, x: float = 100, y: float = 206, **more: Any) -> Any:
    """A GeoTIFF of 4 x 3 heights in a system, its upper left corner at x and y, to write into."""
    return rasterio.open(
        path, "w", driver="GTiff", width=4, height=3, count=1, crs=rasterio.CRS.from_epsg(epsg),
        transform=rasterio.transform.from_origin(x, y, 2, 2), **{"dtype": "float32"} | more,
    )  # fmt: skip


@pytest.mark.parametrize(("epsg", "told", "unit", "along", "up"), TABLES["geotiff"])
def test_a_geotiff_in_its_own_units(
    tmp_path: Path, epsg: int, told: str, unit: str, along: float, up: float
) -> None:
    """Places in the unit of the system, heights in that of the band, packed as 2 z - 30."""
    path = tmp_path / "a.tif"
    with in_system(path, epsg, dtype="int16", nodata=64) as raster:
        raster.write((2 * (Z[::-1] + 30)).astype(np.int16), 1)
        raster.scales, raster.offsets, raster.units = (0.5,), (-30.0,), (told,)
    found = height_maps.load(path, unit=unit or None)
    assert found.first == pytest.approx((101 * along, 201 * along))
    assert found.spacing == pytest.approx((2 * along, 2 * along))
    assert found.z == pytest.approx(up * np.where(Z == 2, np.nan, Z), nan_ok=True)
    assert ("from US survey foot to m" in found.remarks) == (along != 1)
    assert any("times 0.5 plus -30" in r for r in found.remarks)


@pytest.mark.parametrize(("code", "factor"), [(9001, 1.0), (9002, 0.3048), (9003, 1200 / 3937)])
def test_a_geotiff_with_bare_keys_of_units(tmp_path: Path, code: int, factor: float) -> None:
    """Of places (3076) and of heights (4099), in a system without a name."""
    keys = (1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3076, 0, 1, code, 4099, 0, 1, code)
    path = geotiff(tmp_path / "a.tif", Z.astype(np.float32), keys, tags=SCALE)
    found = height_maps.load(path)
    assert found.spacing == pytest.approx((2 * factor, 2 * factor))
    assert found.z == pytest.approx(factor * Z)


def test_heights_of_unknown_unit_are_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    with in_system(path, 2263) as raster:
        raster.write(Z.astype(np.float32), 1)
    with pytest.raises(BadRun, match="lies in US survey foot .* give --unit"):
        height_maps.load(path)
    with pytest.raises(BadRun, match="unit 'yard' is none of m, cm, mm, ft, us-ft"):
        height_maps.load(path, unit="yard")


@pytest.mark.parametrize(("head", "unit", "along", "up"), TABLES["units"])
def test_points_in_units_of_their_names(
    tmp_path: Path, head: str, unit: str, along: float, up: float
) -> None:
    text = head + "\n" + "\n".join(" ".join(map(str, row)) for row in POINTS)
    found = height_maps.load(save(tmp_path / "a.xyz", text), unit=unit or None)
    assert found.spacing == pytest.approx((2 * along, 2 * along)) and found.remarks
    assert found.z == pytest.approx(up * Z)
    with pytest.raises(BadRun, match="unit 'fathom' is none of"):
        height_maps.load(save(tmp_path / "b.xyz", "x [m] y [m] z [fathom]\n0 0 1\n"))


@pytest.mark.parametrize("table", TABLES["named"])
def test_columns_mean_what_their_names_say(table: str, tmp_path: Path) -> None:
    found = height_maps.load(save(tmp_path / "a.csv", table.format(z=-1)))
    assert found.z.tolist() == [[-1.0, -1.0], [-1.0, -5.0]]
    assert ("depths, which count down" in found.remarks) == ("Depth" in table)
    for head in ("x y sand", "x x y z", "survey of stones"):
        with pytest.raises(BadRun, match="columns must be named"):
            height_maps.load(save(tmp_path / "b.csv", head + "\n0 0 1\n"))


def test_a_unit_in_a_remark_is_told(tmp_path: Path) -> None:
    found = height_maps.load(save(tmp_path / "a.xyz", "# in feet\n0 0 1\n0 1 1\n1 0 1\n1 1 1"))
    assert any("a remark speaks of feet" in told for told in found.remarks)


def test_doubled_soundings_and_gaps_are_told(tmp_path: Path) -> None:
    """The order of lines does not decide, and a hole of 10 m in soundings 1 m apart stays one."""
    x, y = (c.ravel() for c in np.meshgrid(np.arange(41.0), np.arange(31.0)))
    keep = (np.abs(x - 20) > 5) | (np.abs(y - 15) > 5)
    rows = [f"{a} {b} {-7.0}" for a, b in zip(x[keep], y[keep], strict=True)]
    rows.insert(0, "3 3 -5")
    for text in (rows, rows[::-1]):
        found = height_maps.load(save(tmp_path / "a.xyz", "\n".join(text)), 1.0)
        assert found.z[3, 3] == -6.0 and found.z[3, 4] == -7.0
        assert np.isnan(found.z[15, 20]) and found.z[15, 14] == -7.0
        assert found.missing == np.isnan(found.z[10:21, 15:26]).sum() > 20
        assert [r.split()[0] for r in found.remarks] == ["1", str(found.missing)]


def test_lost_points_and_unknown_systems_are_told(tmp_path: Path, capsys) -> None:
    """Points behind # and coordinates of a survey; a GeoTIFF tells its system."""
    rows = [f"{354200 + k % 3} {5621080 + k // 3} {-k}" for k in range(9)]
    rows = ["# x y z", "#354203 5621080 -9", *rows, "# 1,2,3"]
    path = save(tmp_path / "a.xyz", "\n".join(rows))
    assert mics_tools(["bed", str(path), "--out", str(tmp_path / "bed.txt")]) == 0
    told = capsys.readouterr()
    assert "note      remarks look like points, 2 in all, the first on line 2" in told.out
    numbered = save(tmp_path / "b.csv", "ID;x;y;z\na;0;0;1\n b;1;0;1\nc;0;1;1\nd;1;1;1\n#5;2;0;1")
    assert "1 in all, the first on line 6" in height_maps.load(numbered).remarks[0]
    assert "coordinates of a survey, whose system the file does not tell" in told.err
    with in_system(tmp_path / "a.tif", 25832, 354200, 5621080) as raster:
        raster.write(Z.astype(np.float32), 1)
    assert mics_tools(["bed", str(tmp_path / "a.tif")]) == 0 and (tmp_path / "a.bed.txt").exists()
    told = capsys.readouterr()
    assert "note      places in the system EPSG:25832" in told.out and told.err == ""


def test_a_picture_is_no_map(tmp_path: Path) -> None:
    Image.new("RGB", (4, 3)).save(tmp_path / "a.tif")
    warnings.simplefilter("error")
    with pytest.raises(BadRun, match="holds colours"):
        height_maps.load(tmp_path / "a.tif")
    (tmp_path / "b.tif").write_bytes(b"II*\0 and nothing else")
    with pytest.raises(BadRun, match="gdal_translate"):
        height_maps.load(tmp_path / "b.tif")


@pytest.mark.parametrize(("name", "text", "said"), TABLES["no_map"])
def test_what_is_no_map_is_one_line(
    tmp_path: Path, name: str, text: str | list[str], said: str, capsys
) -> None:
    whole = text if isinstance(text, str) else re.sub(text[0], text[1], ESRI)
    words = [str(save(tmp_path / name, whole)), "--out", str(tmp_path / "bed.txt")]
    assert mics_tools(["bed", *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not (tmp_path / "bed.txt").exists()


@needs_mics
def test_the_program_reads_the_map(tmp_path: Path, capsys) -> None:
    """A model at 1:50 of a part of the map, its gap filled, under a tank of 60 x 40 mm."""
    path = save(tmp_path / "a.asc", ESRI.replace("12", "-99"))
    words = ["bed", str(path), "--out", str(tmp_path / "bed.txt"), "--fill", "12.5", "--window",
             "101.5,201.5,104.5,203.5", "--origin", "101.5,201.5,0", "--scale", "0.02"]  # fmt: skip
    assert mics_tools(words) == 0
    assert "filled    1 points with 12.5 m" in capsys.readouterr().out
    written = (tmp_path / "bed.txt").read_text().split("\n", 1)[1]
    assert written == "3 3 -0.01 -0.01 0.04 0.04\n0 0.02 0.04\n0.2 0.22 0.25\n0.4 0.42 0.44\n"
    case = (
        "&run t_end = 1 /\n&grid cells = 6, 4, 40  length = 0.06, 0.04, 0.4 /\n"
        "&bed file = 'bed.txt' /\n"
    )
    plan_of(tmp_path, case)


def test_maps_need_no_other_program(tmp_path: Path) -> None:
    """The command starts without pyvista, gmsh or trimesh."""
    code = (
        "import sys; from micstools import cli\n"
        f"try: cli.main(['bed', {str(save(tmp_path / 'a.asc', ESRI))!r}, '--out', "
        f"{str(tmp_path / 'b.txt')!r}])\n"
        "except SystemExit as end: assert end.code == 0\n"
        "assert not {'pyvista', 'gmsh', 'trimesh', 'matplotlib'} & set(sys.modules)"
    )
    python("-c", code, check=True)
