"""A pile at rest under water: blocks that lie on one another do not creep.

Three cubes, one upon two, come to rest in a small tank; then an hour is simulated (`--n`: seconds),
with `&contact sleep` on and off. From 5 s on to the end of the run no block may creep faster than
1e-6 m/s, its corners not by its turning either, and the liquid must stay.
"""

import time
from collections.abc import Iterator
from pathlib import Path

from micstools.reading.reader import Run
from run_cases import Machine, run
from run_soak import Given

SETTLE = 5.0  # s
MOST_CREEP = 1.0e-6  # m/s
MOST_DRIFT = 1.0e-9  # of the liquid, relative
EDGE = 0.02  # m

CASE = Path(__file__).with_suffix(".nml").read_text()


def creep(machine: Machine, seconds: float, sleep: bool, work: Path) -> tuple[str, list[str]]:
    """What a run showed, and what does not hold."""
    case, began = work / f"{sleep}.nml", time.monotonic()
    word = ".true." if sleep else ".false."
    row = min(10.0, seconds / 10)
    case.write_text(CASE.format(t_end=seconds + SETTLE, row=row, sleep=word))
    folder = work / f"run-{sleep}"
    run(case, folder, machine)
    found = Run(folder)
    first = int((found.bodies.time >= SETTLE).argmax())
    past = float(found.bodies.time[-1] - found.bodies.time[first])
    moved = abs(found.bodies.position[-1] - found.bodies.position[first]).max() / past
    turned = EDGE * abs(found.bodies.quaternion[-1] - found.bodies.quaternion[first]).max() / past
    farthest = abs(found.bodies.position[first:] - found.bodies.position[first]).max()
    drift = abs(found.series.liquid_volume_drift).max()
    said = (
        f"sleep = {word}: {past:.0f} s: creep {moved:.1e} m/s, turning {turned:.1e} m/s, "
        f"farthest {farthest:.1e} m, drift of the liquid {drift:.1e}, "
        f"{len(found.bodies.time)} rows, {time.monotonic() - began:.0f} s of wall time"
    )
    still = max(moved, turned) < MOST_CREEP and drift < MOST_DRIFT
    return said, [] if still else ["it creeps, or liquid is lost"]


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """With and without sleep."""
    for sleep in (True, False):
        yield creep(given.machine(), given.n or 3600, sleep, work)
