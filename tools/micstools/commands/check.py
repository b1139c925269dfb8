"""Check a case, print its plan or show it on a page."""

import argparse
import sys
import tempfile
from pathlib import Path

import h5py

from micstools import files
from micstools.cases import program
from micstools.commands.base import Command
from micstools.commands.report import NORTH_HELP, check_north
from micstools.commands.run import call
from micstools.pages import falls, plan_page, set_up
from micstools.reading.reader import BadRun, Run


def _arguments(parser: argparse.ArgumentParser) -> None:
    program.add_case(parser)
    page = "write the set-up as one page, check.html beside the case, that loads nothing"
    parser.add_argument("--page", action="store_true", help=page)
    parser.add_argument("--out", type=Path, help="with --page: the file of the page")
    parser.add_argument("--north", type=float, metavar="DEGREES", help=NORTH_HELP)


def _print(given: argparse.Namespace) -> int:
    """The plan as the program prints it, then the falls of the blocks."""
    with tempfile.TemporaryDirectory(prefix="mics-plan-") as folder:
        file = Path(folder, "run.h5")
        code = call(given, ["--check", "--plan", str(file)])
        if code or not file.exists():
            return code
        with h5py.File(file) as h5:
            line = h5["plan/line"][:]
        told = falls.falls(Run(folder), line)
    if told:
        print("Falls")
    for name, words in told:
        for k, text in enumerate(words):
            print(f"  {'' if k else name:24}{text}")
    return 0


def _check(given: argparse.Namespace) -> int:
    if not given.page:
        for name in ("out", "north"):
            if getattr(given, name) is not None:
                raise BadRun(f"--{name}: goes with --page")
        return _print(given)
    check_north(given.north)
    text = program.case_text(given.case, given.settings)
    try:
        with set_up.read(program.find(given.program, given.case), text) as found:
            said = plan_page.page(found, given.case.stem, given.north)
    except set_up.Refused as refused:
        print(refused, file=sys.stderr)  # in the program's own words
        return 2
    path = given.out or given.case.with_name("check.html")
    files.write(path, said)
    print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")
    return 0


CHECK = Command(
    "check",
    "Read and check a case, print its plan; nothing is written but a page that is asked for.",
    (
        "check input/blocks.nml",
        "check input/blocks.nml --set grid.cells=120,40,80",
        "check input/blocks.nml --page",
    ),
    _arguments,
    _check,
)
