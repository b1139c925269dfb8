"""One page of a run or of an ensemble."""

import argparse

from micstools import command, files
from micstools.commands.pile import area_of
from micstools.pages import ensemble_page, run_page
from micstools.piles import pile_ensemble
from micstools.reading.reader import BadRun

NORTH_HELP = """direction of north in the plan, from +y towards +x; default: +y is taken as north,
and the page says so"""


def work(given: argparse.Namespace) -> int:
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
