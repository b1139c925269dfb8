"""One page of a run or of an ensemble."""

import argparse
from pathlib import Path

from micstools import command, files
from micstools.commands.base import Command
from micstools.commands.pile import add_area, area_of
from micstools.pages import ensemble_page, run_page
from micstools.piles import pile_ensemble
from micstools.reading.reader import BadRun

NORTH_HELP = """direction of north in the plan, from +y towards +x; default: +y is taken as north,
and the page says so"""


def check_north(degrees: float | None) -> None:
    """Raise BadRun where `--north` is no direction."""
    if degrees is not None and not abs(degrees) <= 360:
        raise BadRun(f"--north {degrees}: must be degrees from -360 to 360")


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("run", type=Path, help=command.RUN_HELP + "; or the folder of an ensemble")
    add("--north", type=float, metavar="DEGREES", help=NORTH_HELP)
    add_area(parser)
    add("--out", type=Path, help="the file, default report.html in the folder")


def _report(given: argparse.Namespace) -> int:
    check_north(given.north)
    if pile_ensemble.is_ensemble(given.run):
        folder = given.run
        found = pile_ensemble.open_ensemble(folder, area=area_of(given.area))
        text = ensemble_page.page(found, given.north)
    elif given.area:
        raise BadRun("--area: for an ensemble, not for one run")
    else:
        run = command.open_run(given.run)
        folder, text = run.folder, run_page.page(run, given.north)
    path = given.out or folder / "report.html"
    files.write(path, text)
    print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")
    return 0


REPORT = Command(
    "report",
    "Make one page of a run: the fall to play, the pile to scale, forces, health, provenance; or\n"
    "of an ensemble: where blocks lie, maps, histograms, every pile. One file that loads nothing.",
    (
        "report mics-coarse",
        "report mics-coarse --out pile.html",
        "report mics-ensemble-blocks_coarse",
    ),
    _arguments,
    _report,
)
