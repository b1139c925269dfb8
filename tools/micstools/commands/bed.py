"""A bed from a map of measured ground."""

import argparse
import sys

import numpy as np

from micstools.shapes import height_maps, stones


def work(given: argparse.Namespace) -> int:
    x, y, z = given.origin
    found = height_maps.load(given.file, given.grid, given.nodata, given.unit)
    if window := given.window:
        found = height_maps.cut(found, (window[0], window[1]), (window[2], window[3]))
    height_maps.require_ground(found)
    told = found.remarks and found.remarks[0].startswith("places in the system")
    if not told and np.abs([found.first, found.last]).max() > height_maps.SURVEY:
        print("coordinates of a survey, whose system the file does not tell: let it be that of the "
              "plan and of places --crs", file=sys.stderr)  # fmt: skip
    missing = found.missing
    found = height_maps.moved(height_maps.filled(found, given.fill), (x, y, z), given.scale)
    if given.stones:
        found = stones.lay(found, given.stones, given.seed)
    out = given.out or given.file.with_suffix(".bed.txt")
    out.parent.mkdir(parents=True, exist_ok=True)
    height_maps.write(out, found, f"heights of {given.file.name} [m]")
    print(height_maps.report(found))
    if missing:
        print(f"{'filled':10}{missing} points with {given.fill:g} m")
    print(f"{out}\n&bed file = '{out}' /")
    return 0
