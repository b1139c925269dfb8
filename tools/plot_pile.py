"""Pictures of blocks, water and flow like the paper's figures 5 to 7.

usage: python tools/plot_pile.py RUN [--times 0.2 0.5 ...] [--view front side] [--out DIR]
"""

import argparse
from pathlib import Path

from micstools import command, pile, plots, scene


def main() -> None:
    """Draw every time and view, and the sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--times", type=float, nargs="+", help="[s]; default: as in the paper")
    parser.add_argument("--view", nargs="+", choices=scene.VIEWS)
    parser.add_argument("--out", type=Path, help="folder for the pictures, default RUN/pictures")
    parser.add_argument("--width", type=int, default=1200, help="of a picture [pixels]")
    given = parser.parse_args()
    scene.require_libraries()
    run = command.open_run(given.run)
    out = given.out or run.folder / "pictures"
    out.mkdir(parents=True, exist_ok=True)
    times = given.times or pile.telling_times(run)
    views = given.view or scene.telling_views(run)
    speed = scene.arrow_speed(run, times, views)
    style = scene.Style(width=given.width, speed=speed)
    for view in views:
        pictures = [
            scene.picture(run, t, view, out / f"{view}-{t:06.3f}.png", style) for t in times
        ]
        plots.contact_sheet(pictures, out / f"{view}.png", columns=min(4, len(pictures)))
        print(f"{len(pictures)} pictures and a sheet: {out / f'{view}.png'}")


if __name__ == "__main__":
    command.run_script(main)
