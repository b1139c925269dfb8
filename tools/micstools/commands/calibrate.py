"""`mics-tools calibrate`: the drag coefficient of a shape for `physics = 'light'`."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from micstools import files
from micstools.cases import program
from micstools.cases.calibrate import Calibration


def work(given: argparse.Namespace) -> int:
    folder = given.out or Path(f"mics-calibrate-{given.shape}")
    path = program.find(given.program, given.case)
    text = program.case_text(given.case, given.settings)
    found = Calibration(path, text, given.shape, folder, given.threads).fit(given.falls)
    files.write(folder / "calibrate.json", json.dumps(asdict(found), indent=1) + "\n")
    print(
        f"! &shape '{found.shape}', {found.note}: {len(found.falls)} falls, scatter "
        f"{found.scatter:.2f}; rms of speed {100 * found.rms_speed:.1f} %, time to the floor "
        f"{100 * found.mean_time:+.1f} %, impact {100 * found.mean_impact:+.1f} %"
    )
    print(f"  drag_coefficient = {found.drag_coefficient:.2f}")
    print(f"{folder / 'calibrate.json'}")
    return 0
