"""The program `mics` and the case handed to it."""

import argparse
import os
import shutil
import subprocess
from pathlib import Path

from micstools import case_copy, settings
from micstools.reader import BadRun

CASE_HELP = "case file"


def find(given: Path | None = None) -> Path:
    """The program asked for; else that of this folder of sources, else the one on the path."""
    if given is not None:
        if not os.access(given, os.X_OK) or given.is_dir():
            raise BadRun(f"{given}: is no program")
        return given.resolve()
    built = Path(__file__).parents[2] / "mics"
    found = built if os.access(built, os.X_OK) else shutil.which("mics")
    if found is None:
        raise BadRun("the program mics is not built: run make, or name it with --program")
    return Path(found)


def add_case(parser: argparse.ArgumentParser) -> None:
    """The arguments of every command that takes a case."""
    parser.add_argument("case", type=Path, help=CASE_HELP)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="settings",
        metavar="GROUP.VARIABLE=VALUE",
        help="set a variable of the case, as often as wanted; in each group of a repeated name",
    )
    parser.add_argument("--program", type=Path, help="default: the mics that make has built")


def case_text(case: Path, words: list[str]) -> str:
    """The text of a case with settings; files beside it are named from where we are, since the
    program does not see where a text comes from."""
    text = settings.read(case)
    if words:
        text = settings.set_variables(text, map(settings.parse, words))
    return case_copy.from_here(text, case.parent)


def check(program: Path, text: str) -> str:
    """The plan of a case on one thread; its faults in the program's own words."""
    done = subprocess.run(
        [program, "--check", "--threads", "1"], input=text, capture_output=True, text=True
    )
    if done.returncode:
        raise BadRun(done.stderr.strip() or f"{program} ended with code {done.returncode}")
    return done.stdout
