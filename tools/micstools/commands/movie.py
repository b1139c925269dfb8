"""A film of a run."""

import argparse
import signal
from pathlib import Path
from typing import NoReturn

from micstools import command
from micstools.commands.base import Command
from micstools.pictures import movie, scene
from micstools.reading.reader import BadRun


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("run", type=Path, help=command.RUN_HELP)
    add("--view", choices=movie.VIEWS, default="front")
    add(
        "--slow",
        type=float,
        default=1.0,
        help="times slower than in truth, below 1 faster, default 1",
    )
    add("--from", type=float, default=0.0, dest="begin", help="[s], default 0")
    add("--until", type=float, default=float("inf"), help="[s], default the end")
    add("--rate", type=int, default=25, help="pictures a second, default 25")
    add("--width", type=int, default=800, help="of a picture [pixels], default 800")
    add("--out", type=Path, help="file that ends in .mp4 or .gif, default RUN/VIEW.mp4")


def _movie(given: argparse.Namespace) -> int:
    for name in ("slow", "rate", "width"):
        if not getattr(given, name) > 0:
            raise BadRun(f"--{name} {getattr(given, name)}: must be positive")
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


MOVIE = Command(
    "movie",
    "Make a film of a run, mp4 or gif. The water is that of the nearest written\n"
    "field: a small &run field_interval makes it flow.",
    ("movie mics-coarse", "movie mics-coarse --view orbit --slow 2 --out fall.gif --width 480"),
    _arguments,
    _movie,
)
