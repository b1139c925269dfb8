"""A block from a drawing, and pictures of blocks."""

import argparse
import sys
from pathlib import Path

from micstools import command, extras
from micstools.pictures import scene
from micstools.reading.reader import BadRun
from micstools.shapes import meshing
from micstools.shapes import shape as shapes

BUILT_IN = {"hexapod": shapes.hexapod, "cube": shapes.cube}


def work(given: argparse.Namespace) -> int:
    """Read, check, fill, write, report, draw."""
    if given.size and given.scale:
        raise BadRun("--size, --scale: give one")
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
    given.out.write_text(meshing.shape_text(shape.points, shape.tets))
    print(meshing.report(shape, centroid))
    print(given.out)
    if not given.no_picture and not scene.missing_libraries():
        print(scene.shape_picture(shape, given.out.with_suffix(".png")))
    return 0


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
