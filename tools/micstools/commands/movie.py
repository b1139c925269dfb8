"""A film of a run."""

import argparse
import signal
import sys

from micstools import command
from micstools.pictures import movie, scene
from micstools.reading.reader import BadRun


def work(given: argparse.Namespace) -> int:
    scene.require_libraries()
    run = command.open_run(given.run)
    if not run.bodies.n:
        raise BadRun(f"{run.folder} holds no blocks: there is nothing to film")
    path = given.out or run.folder / f"{given.view}.mp4"
    movie.require(path)
    film = movie.Film(given.view, given.begin, given.until, given.slow, given.rate, given.width)
    # As Ctrl-C does it: nothing unfinished is left.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    print(f"{len(film.times(run))} pictures", flush=True)
    print(movie.write(run, film, path))
    return 0
