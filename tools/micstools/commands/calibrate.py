"""`mics-tools calibrate`: the drag coefficient of a shape for `physics = 'light'`."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from micstools import files
from micstools.cases import program
from micstools.cases.calibrate import Calibration
from micstools.commands.base import Command
from micstools.reading.reader import BadRun


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("case", type=Path, help=program.CASE_HELP)
    add("--shape", required=True, help="name of the &shape")
    add("--falls", type=int, default=4, help="resolved falls (%(default)s)")
    add("--threads", type=int, default=1, help="of each (%(default)s)")
    add("--out", type=Path, help="folder of the falls, default mics-calibrate-SHAPE")
    add("--program", type=Path, help=program.PROGRAM_HELP)


def _calibrate(given: argparse.Namespace) -> int:
    if given.falls < 1:
        raise BadRun(f"--falls {given.falls}: must be at least 1")
    folder = given.out or Path(f"mics-calibrate-{given.shape}")
    found = Calibration(program.find(given.program, given.case), given.case, given.shape, folder,
                        given.threads).fit(given.falls)  # fmt: skip
    files.write(folder / "calibrate.json", json.dumps(asdict(found), indent=1) + "\n")
    print(
        f"! &shape '{found.shape}', {found.note}: {len(found.falls)} falls, scatter "
        f"{found.scatter:.2f}; rms of speed {100 * found.rms_speed:.1f} %, time to the floor "
        f"{100 * found.mean_time:+.1f} %, impact {100 * found.mean_impact:+.1f} %"
    )
    print(f"  drag_coefficient = {found.drag_coefficient:.2f}")
    print(f"{folder / 'calibrate.json'}")
    return 0


CALIBRATE = Command(
    "calibrate",
    "Fit the drag coefficient of a shape for 'light' runs to a few resolved falls.",
    ("calibrate input/blocks.nml --shape hexapod", "calibrate case.nml --shape unit --falls 8"),
    _arguments,
    _calibrate,
)
