"""Energy that steps and contacts make, which they must not."""

from dataclasses import dataclass

import numpy as np

from micstools.geometry import Array
from micstools.reader import Run

ENERGY_LIMIT = 0.01  # of the energy set free: more than was put in is to be looked at


@dataclass(frozen=True)
class Excess:
    """Largest energy of fluid and blocks over what was put in, of what was set free."""

    share: float
    time: float  # s

    @property
    def good(self) -> bool:
        """Is it within what a step may be off?"""
        return self.share <= ENERGY_LIMIT

    def __str__(self) -> str:
        return f"{100 * max(self.share, 0.0):.2g} %, t = {self.time:.3g} s"


def largest_excess(run: Run) -> Excess | None:
    """None where the program does not know it: `energy_excess` of `/series` is NaN."""
    values = run.series.energy_excess
    if not np.isfinite(values).any():
        return None
    row = int(np.nanargmax(values))
    return Excess(float(values[row]), float(run.series.time[row]))


def made_by_contact(run: Run) -> Array:
    """In each row what the blocks have more as motion, height and springs than the fluid has given
    them since the row before [J] (T); negative where contact takes energy, as it should.

    Forces are means over the step, so their work on velocity and spin in the middle of it is exact;
    what is left to rounding and to the substeps is some 1e-4 of weight times length of a block."""
    b, s = run.bodies, run.series
    own = s.kinetic_energy_bodies + s.potential_energy_bodies + np.nan_to_num(s.contact_energy)
    work = sum(
        (np.nan_to_num(push[1:]) * (speed[1:] + speed[:-1]) / 2).sum(axis=(1, 2))
        for push, speed in (
            (b.fluid_force, b.velocity),
            (b.fluid_torque, b.angular_velocity),
        )
    )
    made = np.zeros(b.time.size)
    made[1:] = np.diff(own) - work * np.diff(b.time)
    return made
