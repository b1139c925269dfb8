"""Momentum of fluid and bodies against the impulses of walls and gravity; the energy of a fall."""

import numpy as np

from measures.checks import Checks, sound
from micstools.reading.reader import Run

BAND, DRAG_BAND = 1e-3, 0.01
WALLS = ("no_slip", "slip")


class Budget:
    """Momentum and energy at every written time, and what acted in between; axes x, y, z."""

    def __init__(self, run: Run) -> None:
        """Add up the cells."""
        b, h = run.bodies, run.grid.spacing
        self.time, self.bodies = run.field_times, b
        self.g = np.array(run.value("fluid", "gravity", [0.0, 0.0, -9.81]), float)
        liquid = float(run.value("fluid", "liquid_density", 998.2))
        gas = float(run.value("fluid", "gas_density", 1.204))
        fluid, walls, weight, height = [], [], [], []
        for t in self.time:
            field = run.fields_at(t)
            density = gas + (liquid - gas) * field.liquid.astype(float)
            mass = density * h.prod() * (1 - field.solid.astype(float))
            fluid.append((mass[..., None] * field.velocity.astype(float)).sum(axis=(0, 1, 2)))
            pressure = field.pressure.astype(float)
            walls.append([self._push(run, d, pressure, density, h) for d in range(3)])
            weight.append(mass.sum() + b.mass.sum())
            height.append((mass * run.grid.centres[2][:, None, None]).sum())
        free = b.mass * ~b.fixed
        self.momentum = np.array(fluid) + (free[:, None] * b.velocity).sum(axis=1)
        held = (b.fluid_force * b.fixed[:, None]).sum(axis=1)
        weights = (np.array(weight) - (b.mass * b.fixed).sum())[:, None] * self.g
        force = np.array(walls) + weights + b.contact_force.sum(axis=1) - held
        self.fluid_impulse = self.momentum - self.momentum[0]
        self.fluid_impulse[1:] -= np.cumsum(
            (force + held)[1:] * np.diff(self.time)[:, None], axis=0
        )
        self.impulse = np.zeros_like(self.momentum)
        self.impulse[1:] = np.cumsum(force[1:] * np.diff(self.time)[:, None], axis=0)
        self.potential = -self.g[2] * np.array(height) + run.series.potential_energy_bodies
        self.kinetic = run.series.kinetic_energy_fluid + run.series.kinetic_energy_bodies

    def _push(self, run: Run, d: int, pressure, density, h) -> float:
        """Force of the two walls across direction d on the fluid [N]: pressure of the cells next to
        them, carried to the wall by the weight of half a cell."""
        total = 0.0
        for end, sense in (("min", 1), ("max", -1)):
            if run.sides[f"{'xyz'[d]}_{end}"] not in WALLS:
                continue
            p, rho = (
                np.take(a, 0 if end == "min" else -1, axis=2 - d) for a in (pressure, density)
            )
            total += sense * float((p - sense * rho * self.g[d] * h[d] / 2).sum() * h.prod() / h[d])
        return total


def check(runs: list[Run]) -> Checks:
    """Momentum without an owner over the impulse that moves the body; energy that is lost."""
    checks = Checks("momentum and energy")
    curves = {}
    for run in runs:
        name, budget, b = run.folder.name, Budget(run), run.bodies
        error = budget.momentum - budget.momentum[0] - budget.impulse
        touched = np.flatnonzero(b.contacts.max(axis=1) > 0)
        last = int(touched[0]) - 1 if touched.size else len(budget.time) - 1
        if b.fixed.all():
            impulse = np.abs((b.fluid_force[1:, 0, 0] * np.diff(b.time)).sum())
            scale, said = float(impulse), "impulse on the sphere"
            drag = float(impulse / b.time[-1])
            along = np.abs(budget.fluid_impulse[-1, 0]) / b.time[-1]
            state = "held in a stream" if np.all(b.velocity == 0) else "moved through still water"
            checks.close(
                f"{name}: drag on the sphere {state}, against the control volume [N]",
                drag,
                float(along),
                DRAG_BAND,
            )
        else:
            shape = run.shapes[b.shape[0]]
            density = float(run.value("fluid", "liquid_density", 998.2))
            excess = (shape.density - density) * shape.volume * 9.81
            scale, said = float(excess * budget.time[last]), "impulse of its weight under water"
            lost = budget.kinetic + budget.potential
            released = budget.potential[0] - budget.potential[last]
            share = float((lost[0] - lost[last]) / released)
            checks.within(f"{name}: energy lost until the floor / released", share, 0.0, 1.0)
            time = budget.time[: last + 1]
            checks.figure(
                f"{name}: energy",
                "t [s]",
                "J",
                {
                    "released": (time, budget.potential[0] - budget.potential[: last + 1]),
                    "kinetic, fluid": (time, run.series.kinetic_energy_fluid[: last + 1]),
                    "kinetic, block": (time, run.series.kinetic_energy_bodies[: last + 1]),
                    "lost": (time, lost[0] - lost[: last + 1]),
                },
            )
        worst = float(np.abs(error[: last + 1]).max()) / scale
        checks.below(f"{name}: momentum without an owner / {said}", worst, BAND)
        curves[name] = (budget.time[: last + 1], np.abs(error[: last + 1]).max(axis=1) / scale)
        sound(run, checks)
    checks.figure("momentum without an owner / impulse", "t [s]", "-", curves)
    return checks
