"""A bed from a map of measured ground."""

import argparse
from pathlib import Path

import numpy as np

from micstools.commands.base import Command
from micstools.reading.reader import BadRun
from micstools.shapes import height_maps


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("file", type=Path, help="Esri raster .asc, points .xyz, or GeoTIFF .tif")
    add("--out", type=Path, required=True, help="map of heights to write, for &bed file")
    add("--fill", type=float, metavar="HEIGHT", help="where the file has none (NODATA) [m]")
    add("--nodata", type=float, action="append", default=[], metavar="HEIGHT", help="takes this "
        "height as missing, beside the file's own mark; --nodata=-9999 with a sign")  # fmt: skip
    add("--grid", type=float, metavar="SPACING", help="draw scattered points to a grid [m]")
    add("--unit", help="m, cm, mm, ft or us-ft, of numbers whose unit the file does not tell")
    add("--window", metavar="X0,Y0,X1,Y1", help="keep this part, in the file's coordinates [m]")
    add("--origin", default="0,0,0", metavar="X,Y,Z", help="place of the file that becomes 0,0,0 "
        "of the tank [m]; --origin=-5,2,0 with a sign first")  # fmt: skip
    add("--scale", type=float, default=1.0, help="of the model, 0.02 for 1:50, after --origin")


def _parts(option: str, word: str, form: str) -> list[float]:
    """The numbers of an option, as many as its form has."""
    try:
        found = [float(part) for part in word.split(",")]
    except ValueError:
        found = []
    if len(found) != len(form.split(",")) or not np.isfinite(found).all():
        raise BadRun(f"{option} {word}: must be {form}")
    return found


def _bed(given: argparse.Namespace) -> int:
    x, y, z = _parts("--origin", given.origin, "X,Y,Z")
    if not given.scale > 0:
        raise BadRun(f"--scale {given.scale:g}: must be positive")
    window = given.window and _parts("--window", given.window, "X0,Y0,X1,Y1")
    found = height_maps.load(given.file, given.grid, given.nodata, given.unit)
    if window:
        found = height_maps.cut(found, (window[0], window[1]), (window[2], window[3]))
    height_maps.require_ground(found)
    missing = found.missing
    found = height_maps.moved(height_maps.filled(found, given.fill), (x, y, z), given.scale)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    height_maps.write(given.out, found, f"heights of {given.file.name} [m]")
    print(height_maps.report(found))
    if missing:
        print(f"{'filled':10}{missing} points with {given.fill:g} m")
    print(f"{given.out}\n&bed file = '{given.out}' /")
    return 0


BED = Command(
    "bed",
    "Make the map of heights of a bed from measured ground; it must cover the tank.",
    (
        "bed survey.asc --out bed.txt --window 354200,5621080,354260,5621120 \\\n"
        "      --origin 354200,5621080,-12.5",
        "bed survey.tif --out bed.txt --fill -15 --origin 354200,5621080,-12.5 --scale 0.02",
        "bed soundings.xyz --grid 0.5 --out bed.txt",
    ),
    _arguments,
    _bed,
)
