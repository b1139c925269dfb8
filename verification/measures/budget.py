"""Momentum of the fluid and of the free bodies in a tank against what acts on them from outside:
walls of the tank, gravity, bodies that are held or moved.
"""

import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

WALLS = ("no_slip", "slip")


class Budget:
    """Momentum and energy at every written time, and what acted in between; axes x, y, z."""

    def __init__(self, run: Run) -> None:
        """Add up the cells."""
        b, h = run.bodies, run.grid.spacing
        self.time, self.bodies = run.field_times, b
        self.g = np.array(run.value("fluid", "gravity"), float)
        liquid = float(run.value("fluid", "liquid_density"))
        gas = float(run.value("fluid", "gas_density"))
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
        contact = (b.contact_force * ~b.fixed[:, None]).sum(axis=1)
        force = np.array(walls) + weights + contact - held
        self.fluid_impulse = self.momentum - self.momentum[0]
        self.fluid_impulse[1:] -= np.cumsum(
            (force + held)[1:] * np.diff(self.time)[:, None], axis=0
        )
        self.impulse = np.zeros_like(self.momentum)
        self.impulse[1:] = np.cumsum(force[1:] * np.diff(self.time)[:, None], axis=0)
        self.potential = -self.g[2] * np.array(height) + run.series.potential_energy_bodies
        self.kinetic = run.series.kinetic_energy_fluid + run.series.kinetic_energy_bodies

    def _push(self, run: Run, d: int, pressure: Array, density: Array, h: Array) -> float:
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
