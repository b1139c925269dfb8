"""One page of a run or of an ensemble."""

import argparse
from pathlib import Path

from micstools import command
from micstools.commands.base import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--out", type=Path, help="the file, default report.html in the folder")


def _report(given: argparse.Namespace) -> int:
    from micstools.page import run_page

    run = command.open_run(given.run)
    text = run_page.page(run)
    path = given.out or run.folder / "report.html"
    path.write_text(text, encoding="utf-8")
    print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")
    return 0


REPORT = Command(
    "report",
    "Make one page of a run: the fall to play, the pile to scale, forces, health, provenance.\n"
    "It is one file that loads nothing from outside.",
    ("report mics-coarse", "report mics-coarse --out pile.html"),
    _arguments,
    _report,
)
