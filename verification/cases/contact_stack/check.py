"""Stacked cubes stand and a hooked hexapod hangs."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

WAY = 0.5  # [mm]
TILT = 0.5  # [degrees]
CREEP = 1e-6  # [m/s]
PARTS = {"aligned cubes": slice(0, 10), "cubes with offsets": slice(10, 20), "hook": slice(21, 22)}
VARIES = ("contact sleep", "contact solver")
QUICK = ("impulses",)


def check(runs: list[Run], checks: Checks) -> None:
    """How far each part has moved and turned at the end, and its creep, free of any sway."""
    for run in runs:
        b = run.bodies
        moved = np.linalg.norm(b.position[-1] - b.position[0], axis=1)
        same = np.abs((b.quaternion[-1] * b.quaternion[0]).sum(axis=1)).clip(0.0, 1.0)
        turned = 2.0 * np.degrees(np.arccos(same))
        end = b.time[-1]
        third, last = (b.time > 0.5 * end) & (b.time <= 0.75 * end), b.time > 0.75 * end
        creep = b.position[last].mean(axis=0) - b.position[third].mean(axis=0)
        creep = np.linalg.norm(creep, axis=1) / (0.25 * end)
        for what, part in PARTS.items():
            name = f"{run.folder.name}, {what}:"
            checks.below(f"{name} way [mm]", 1e3 * moved[part].max(), WAY)
            checks.below(f"{name} tilt [deg]", turned[part].max(), TILT)
            checks.below(f"{name} creep [m/s]", creep[part].max(), CREEP)
        held = b.contacts[-1, 21]
        checks.true("the hooked hexapod touches one body", held == 1, f"{held}")
