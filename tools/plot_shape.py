"""A block as polygons, tetrahedra and contact spheres, like the paper's figure 1.

usage: python tools/plot_shape.py hexapod|cube|RUN [--shape NAME] [--out FILE]
"""

import argparse
from pathlib import Path

from micstools import command, scene, shapes
from micstools.reader import BadRun

BUILT_IN = {"hexapod": shapes.hexapod, "cube": shapes.cube}


def main() -> None:
    """Draw each shape asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", help="'hexapod', 'cube', or an output folder or case file")
    parser.add_argument("--shape", nargs="+", help="names of the shapes of a run, default all")
    parser.add_argument("--refinement", type=int, default=2, help="of a built-in shape")
    parser.add_argument("--out", type=Path, default=Path(), help="folder for the pictures")
    given = parser.parse_args()
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


if __name__ == "__main__":
    command.run_script(main)
