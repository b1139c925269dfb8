"""A block from a drawing, and pictures of blocks."""

import argparse
import sys
from pathlib import Path

from micstools import command, extras
from micstools.commands.base import Command
from micstools.pictures import scene
from micstools.reading.reader import BadRun
from micstools.shapes import meshing
from micstools.shapes import shape as shapes

BUILT_IN = {"hexapod": shapes.hexapod, "cube": shapes.cube}


def arguments(parser: argparse.ArgumentParser) -> None:
    """The drawing, its scale, and where the block goes."""
    parser.add_argument("file", type=Path, help="closed surface: .stl, .obj, .step")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--size", type=float, help="largest extent of the block [m]")
    unit = "metres per unit of the file, 0.001 for mm; STEP tells its own"
    length.add_argument("--scale", type=float, help=unit)
    edge = "longest edge [file's units, of STEP mm]"
    parser.add_argument("--element", type=float, default=0.0, help=edge)
    parser.add_argument(
        "--simplify", type=int, metavar="FACES", help="most triangles of a fine surface"
    )
    parser.add_argument("--density", type=float, default=2300.0, help="[kg/m3]")
    parser.add_argument("--out", type=Path, required=True, help="shape file to write")
    parser.add_argument("--no-picture", action="store_true", help="do not draw the block")


def make(given: argparse.Namespace) -> int:
    """Read, check, fill, write, report, draw."""
    extras.need("shape")
    try:
        surface = meshing.load(given.file, given.element)
        if given.simplify is not None:
            surface = meshing.simplified(surface, given.simplify)
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
    return 0


def picture_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes to draw."""
    parser.add_argument("what", help="'hexapod', 'cube', or an output folder or case file")
    parser.add_argument("--shape", nargs="+", help="names of the shapes of a run, default all")
    parser.add_argument("--refinement", type=int, default=2, help="of a built-in shape")
    parser.add_argument("--out", type=Path, default=Path(), help="folder for the pictures")


def draw(given: argparse.Namespace) -> int:
    """Draw each shape asked for."""
    scene.require_libraries()
    if given.what in BUILT_IN:
        found = {given.what: BUILT_IN[given.what](0.02, given.refinement)}
    else:
        found = command.open_run(Path(given.what)).shapes
    unknown = set(given.shape or []) - set(found)
    if unknown:
        raise BadRun(f"no shape {', '.join(sorted(unknown))}; there are: {', '.join(found)}")
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.shape or found:
        print(scene.shape_picture(found[name], given.out / f"shape-{name}.png"))
    return 0


SHAPE = Command(
    "shape",
    "Make a block of kind 'file' from a drawing: check it, unite parts that overlap, fill it,\n"
    "tell its mass.",
    (
        "shape block.stl --size 0.06 --out block.txt",
        "shape block.step --out block.txt",
        "shape scan.stl --scale 0.001 --simplify 500 --out block.txt",
    ),
    arguments,
    make,
)
