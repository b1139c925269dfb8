"""A film of a run."""

import argparse
import signal
from typing import NoReturn

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
    signal.signal(signal.SIGTERM, _terminated)
    print(f"{len(film.times(run))} pictures", flush=True)
    print(movie.write(run, film, path))
    return 0


def _terminated(_signum: int, _frame: object) -> NoReturn:
    """End as after Ctrl-C, so that nothing unfinished is left."""
    raise SystemExit(128 + signal.SIGTERM)
