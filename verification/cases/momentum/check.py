"""Momentum of fluid and bodies against the impulses of walls and gravity; the energy of a fall."""

import numpy as np

from measures.budget import Budget
from measures.checks import Checks
from measures.facts import liquid
from micstools.reading.reader import Run

BAND, DRAG_BAND = 1e-3, 0.01
TOUCH_BAND = 1e-5


def check(runs: list[Run], checks: Checks) -> None:
    """Momentum without an owner over the impulse that moves the body; energy that is lost."""
    for run in runs:
        name, budget, b = run.folder.name, Budget(run), run.bodies
        error = budget.momentum - budget.momentum[0] - budget.impulse
        touched = np.flatnonzero(b.contacts.max(axis=1) > 0)
        last = len(budget.time) - 1
        if touched.size and not b.fixed.any():
            last = int(touched[0]) - 1  # the floor is not in the books
        time = budget.time[: last + 1]
        if b.fixed.all():
            scale = np.abs((b.fluid_force[1:, 0, 0] * np.diff(b.time)).sum())
            along = np.abs(budget.fluid_impulse[-1, 0]) / b.time[-1]
            state = "held in a stream" if np.all(b.velocity == 0) else "moved through still water"
            drag = f"{name}: drag on the sphere {state}, against the control volume [N]"
            checks.close(drag, scale / b.time[-1], along, DRAG_BAND)
            said = "impulse on the sphere"
        else:
            shape = run.shapes[b.shape[0]]
            excess = (shape.density - liquid(run)[0]) * shape.volume * 9.81
            scale, said = excess * budget.time[last], "impulse of its weight under water"
            lost = budget.kinetic + budget.potential
            released = budget.potential[0] - budget.potential[: last + 1]
            share = (lost[0] - lost[last]) / released[-1]
            checks.within(f"{name}: energy lost / released", share, 0.0, 1.0)
            curves = {
                "released": (time, released),
                "kinetic, fluid": (time, run.series.kinetic_energy_fluid[: last + 1]),
                "kinetic, block": (time, run.series.kinetic_energy_bodies[: last + 1]),
                "lost": (time, lost[0] - lost[: last + 1]),
            }
            checks.figure(f"{name}: energy", "t [s]", "J", curves)
        worst = np.abs(error[: last + 1]).max(axis=1) / scale
        band = TOUCH_BAND if b.fixed.any() and not b.fixed.all() else BAND
        checks.below(f"{name}: momentum without an owner / {said}", worst.max(), band)
        checks.figure("momentum without an owner / impulse", "t [s]", "-", {name: (time, worst)})
