"""Pictures of the blocks and diagrams of the history of a run."""

import argparse

from micstools import command
from micstools.pictures import plots, scene
from micstools.piles import pile
from micstools.reading.reader import BadRun


def draw_pictures(given: argparse.Namespace) -> int:
    """Draw every time and view, and the sheets."""
    scene.require_libraries()
    run = command.open_run(given.run)
    out = given.out or run.folder / "pictures"
    out.mkdir(parents=True, exist_ok=True)
    times = given.times or pile.telling_times(run)
    last = float(run.series.time[-1])
    for t in given.times or []:
        if not 0 <= t <= last + 1e-9:
            raise BadRun(f"--times {t:g}: the run goes from 0 to {last:g} s")
    views = given.view or scene.telling_views(run)
    fine = next(n for n in range(3, 18) if len({f"{t:.{n}f}" for t in times}) == len(set(times)))
    style = scene.Style(width=given.width, speed=scene.arrow_speed(run, times, views))
    for view in views:
        pictures = []
        for number, t in enumerate(times, start=1):
            print(f"{view} at {t:g} s, {number} of {len(times)}", flush=True)
            path = out / f"{view}-{t:0{fine + 3}.{fine}f}.png"
            pictures.append(scene.picture(run, t, view, path, style))
        plots.contact_sheet(pictures, out / f"{view}.png", columns=min(4, len(pictures)))
        many = "1 picture" if len(pictures) == 1 else f"{len(pictures)} pictures"
        print(f"{many} and a sheet: {out / f'{view}.png'}")
    return 0


def draw_history(given: argparse.Namespace) -> int:
    """Draw and save the diagrams."""
    run = command.open_run(given.run)
    out = given.out or run.folder / "pictures" / "history.png"
    out.parent.mkdir(parents=True, exist_ok=True)
    plots.history(run).savefig(out, dpi=110)
    print(out)
    return 0


def work(given: argparse.Namespace) -> int:
    if not given.history:
        draw_pictures(given)
    given.out = given.out / "history.png" if given.out else None
    return draw_history(given)
