"""A run in the formats of other programs."""

import argparse
import sys

import numpy as np

from micstools import command, extras
from micstools.pictures import exports
from micstools.reading.reader import BadRun


def work(given: argparse.Namespace) -> int:
    formats = [name.strip().lower() for name in given.to.split(",")]
    unknown = [name for name in formats if name not in exports.FORMATS]
    if unknown:
        raise BadRun(f"--to {given.to}: '{unknown[0]}' is none of {', '.join(exports.FORMATS)}")
    if given.final and "csv" not in formats:
        raise BadRun(f"--final is of csv, which --to {given.to} does not ask for")
    if "pvd" in formats:
        extras.need("pictures")
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
        if given.final and name == "csv":
            print(exports.to_final_csv(run, len(time) - 1, folder))
            missing = ", ".join(str(k + 1) for k in np.flatnonzero(~run.bodies.present(-1)))
            if missing:
                print(f"left out, not in the tank at the end: {missing}", file=sys.stderr)
        else:
            print(exports.FORMATS[name](run, row, folder))
    if {"stl", "obj"} & set(formats) and (origin := exports.local_origin(run, folder)).any():
        print(f"0, 0, 0 of stl and obj is {', '.join(f'{x:.0f}' for x in origin)} m of the run "
              f"({folder / 'origin.json'})")  # fmt: skip
    return 0
