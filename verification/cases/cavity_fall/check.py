"""Blocks that fall under water before they touch anything: none is kicked, whatever the step."""

import numpy as np

from measures.checks import Checks
from micstools.reading import kicks
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

VARIES = ("contact contact_time",)
"""It goes with the size of the block."""

QUICK = (
    "cube_prototype_05_100_4",
    "dolos_model_tension_*",
    "hexapod_prototype_05_100_6",
    "tetrapod_prototype_05_*_4",
)

WINDOW_LIMIT = 0.6  # mean acceleration of a window [g]
STEP_LIMIT = 3.0  # acceleration of a step [g] above which its change of velocity is looked at
CHANGE_LIMIT = 0.02  # of such a step [sqrt(g D)]
STEPS_BAND = 0.05  # of the largest change at different steps, for a block of 2 m [m/s]
GROWTH_LIMIT = 2.0001  # of a step over the one before


class Fall:
    """What a block of `length` D feels between the surface and its first touch."""

    def __init__(self, run: Run) -> None:
        """`windows` (T) [g] from each row on, `change` [m/s] the largest of them."""
        b, g = run.bodies, 9.81
        level = float(run.value("fluid", "water_level"))
        self.length = level / 5.025
        self.courant, self.seed = run.value("run", "cfl_max"), run.value("drop", "seed")
        self.name = f"{run.value('shape', 'kind')} of {'2 m' if self.length > 1 else '50 mm'}"
        self.name += ", surface tension" if run.value("fluid", "surface_tension") > 0 else ""
        self.name += f", {round(self.length / float(run.grid.spacing[2]))} cells"
        contacts = np.flatnonzero(b.contacts[:, 0] > 0)
        first = int(contacts[0]) if contacts.size else b.time.size
        self.time: Array = b.time[:first] / np.sqrt(self.length / g)
        self.windows: Array = kicks.acceleration(run, self.length, clear=0.0)[:first, 0]
        self.window = float(np.nanmax(self.windows))
        self.change = self.window * g * kicks.window(run, self.length)
        under = b.position[: first - 1, 0, 2] < level - 0.35 * self.length
        step = np.diff(b.time[:first])[under]
        change = np.linalg.norm(np.diff(b.velocity[:first, 0], axis=0), axis=1)[under]
        self.hardest = float((change / step).max() / g)
        hard = change > STEP_LIMIT * g * step
        self.hard = float(change[hard].max(initial=0.0) / np.sqrt(g * self.length))
        dt = run.series.dt[1:]
        self.growth = float((dt[1:] / dt[:-1]).max())


def check(runs: list[Run], checks: Checks) -> None:
    """The worst of the seeds of each shape, size and grid; and the same fall at shorter steps."""
    falls = [Fall(run) for run in runs]
    groups: dict[str, list[Fall]] = {}
    for fall in falls:
        groups.setdefault(fall.name, []).append(fall)
    for name, group in groups.items():
        here = f"{name}, {len(group)} falls" if len(group) > 1 else name
        worst = float(np.max([fall.window for fall in group]))  # nan stays
        checks.below(f"{here}: largest acceleration of a window [g]", worst, WINDOW_LIMIT)
        said = f"{here}: change of velocity in a step above {STEP_LIMIT:g} g [sqrt(g D)]"
        checks.below(said, max(fall.hard for fall in group), CHANGE_LIMIT)
        hardest = max(fall.hardest for fall in group)
        checks.below(f"{here}: largest acceleration of a step [g]", hardest, STEP_LIMIT, False)
    check_steps(checks, falls)
    growth = max(fall.growth for fall in falls)
    checks.below("largest step over the one before", growth, GROWTH_LIMIT)
    shown = {name: max(group, key=lambda fall: fall.window) for name, group in groups.items()}
    curves = {name: (fall.time, fall.windows) for name, fall in shown.items() if fall.length > 1}
    title = "acceleration over .22 sqrt(D/g), the worst fall of each kind"
    checks.figure(title, "t / sqrt(D/g)", "g", curves)


def check_steps(checks: Checks, falls: list[Fall]) -> None:
    """What the water changes of the velocity does not depend on the step."""
    same: dict[tuple[str, int], dict[float, Fall]] = {}
    for fall in falls:
        same.setdefault((fall.name, fall.seed), {})[fall.courant] = fall
    for (name, seed), of_step in same.items():
        if len(of_step) < 2:
            continue
        found = [of_step[courant] for courant in sorted(of_step, reverse=True)]
        changes, limit = [fall.change for fall in found], STEPS_BAND * np.sqrt(found[0].length / 2)
        steps = ", ".join(f"{fall.courant:g}" for fall in found)
        text = f"{name}, seed {seed}: largest change in a window, Courant numbers {steps} [m/s]"
        said = " ".join(f"{change:.3f}" for change in changes)
        checks.true(f"{text}, within {limit:g}", np.ptp(changes) < limit, said)
