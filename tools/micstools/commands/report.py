"""One page of a run or of an ensemble, and the same on paper."""

import argparse

from micstools import command, extras, files
from micstools.commands.pile import area_of
from micstools.pages import ensemble_page, paper, run_page
from micstools.piles import handover, options, pile_ensemble


def work(given: argparse.Namespace) -> int:
    if given.pdf:
        extras.need("paper")
    if given.crs:
        handover.crs_name(given.crs)
    if pile_ensemble.is_ensemble(given.run):
        folder, told = given.run, options.told(given.run, given)
        found = pile_ensemble.open_ensemble(folder, area=area_of(told.area), told=told)
        text = ensemble_page.page(found, told)
    else:
        run = command.open_run(given.run)
        folder, told = run.folder, options.told(run.folder, given)
        text = run_page.page(run, told)
    options.keep(told, folder)
    path = given.out or folder / "report.html"
    files.write(path, text)
    print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")
    if given.pdf:
        print(paper.write(path.with_suffix(".pdf"), text))
    return 0
