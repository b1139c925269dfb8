"""A run in the formats of other programs."""

import argparse
from pathlib import Path

from micstools import command, exports
from micstools.commands.base import Command
from micstools.reader import BadRun


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("run", type=Path, help=command.RUN_HELP)
    add("--to", required=True, metavar="FORMATS", help="of " + ",".join(exports.FORMATS))
    add("--time", type=float, help="of stl and obj [s], default the end")
    add("--out", type=Path, help="folder for the files, default RUN/export")


def _export(given: argparse.Namespace) -> int:
    formats = exports.parse_formats(given.to)
    run = command.open_run(given.run)
    if not run.bodies.n:
        raise BadRun(f"{run.folder} holds no blocks: there is nothing to export")
    time = run.bodies.time
    if given.time is not None and not time[0] <= given.time <= time[-1]:
        raise BadRun(f"--time {given.time}: the run goes from {time[0]:g} to {time[-1]:g} s")
    row = len(time) - 1 if given.time is None else run.bodies.row(given.time)
    folder = given.out or run.folder / "export"
    folder.mkdir(parents=True, exist_ok=True)
    for name in formats:
        print(exports.FORMATS[name](run, row, folder))
    return 0


EXPORT = Command(
    "export",
    "Write a run for other programs, in m, a named object per block: the fall (glb), the pile of\n"
    "one time (stl, obj), places and attitudes (csv), files for ParaView before 5.12 (pvd).",
    (
        "export mics-coarse --to glb,csv",
        "export mics-coarse --to stl,obj --time 3 --out /tmp/pile",
    ),
    _arguments,
    _export,
)
