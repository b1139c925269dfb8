"""A block of kind 'file' from a drawing: checks the surface, fills it with tetrahedra, tells mass.

usage: python tools/make_shape.py FILE.stl|.obj|.step [--size M | --scale X] --out BLOCK.txt

Exit code 2 and a message for a surface that cannot become a block.
"""

import argparse
import sys
from pathlib import Path

from micstools import command, meshing, scene
from micstools.reader import BadRun


def main() -> None:
    """Read, check, fill, write, report, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path, help="closed surface: .stl, .obj, .step")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--size", type=float, help="largest extent of the block [m]")
    length.add_argument("--scale", type=float, help="metres per unit of the file, 0.001 for mm")
    parser.add_argument("--element", type=float, default=0.0, help="longest edge [file's units]")
    parser.add_argument("--density", type=float, default=2300.0, help="[kg/m3]")
    parser.add_argument("--out", type=Path, required=True, help="shape file to write")
    parser.add_argument("--no-picture", action="store_true", help="do not draw the block")
    given = parser.parse_args()
    try:
        surface = meshing.load(given.file, given.element)
        scale = meshing.scale_of(surface, given.size, given.scale)
        tets = scale * meshing.fill(surface, given.element)
    except meshing.BadSurface as problem:
        raise BadRun(problem) from problem
    for warning in surface.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    shape, centroid = meshing.block(given.file.stem, tets, given.density)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    meshing.write_shape(given.out, shape)
    print(meshing.report(shape, centroid))
    print(given.out)
    if not given.no_picture and not scene.missing_libraries():
        print(scene.shape_picture(shape, given.out.with_suffix(".png")))


if __name__ == "__main__":
    command.run_script(main)
