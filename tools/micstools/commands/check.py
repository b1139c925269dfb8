"""Check a case, print its plan or show it on a page."""

import argparse
import sys
import tempfile
from pathlib import Path

import h5py

from micstools import files
from micstools.cases import program
from micstools.commands.run import call
from micstools.pages import falls, plan_page, set_up
from micstools.reading.reader import BadRun, Run


def _print(given: argparse.Namespace) -> int:
    """The plan as the program prints it, then the falls of the blocks."""
    with tempfile.TemporaryDirectory(prefix="mics-plan-") as folder:
        file = Path(folder, "run.h5")
        with Path(folder, "plan").open("w+") as out:
            code = call(given, ["--check", "--plan", str(file)], out)
            out.seek(0)
            print(set_up.shorter(out.read()), end="", flush=True)
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


def work(given: argparse.Namespace) -> int:
    if not given.page:
        for name in ("out", "north"):
            if getattr(given, name) is not None:
                raise BadRun(f"--{name}: goes with --page")
        return _print(given)
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
