"""Energy that contact makes, which it must not."""

import numpy as np

from micstools.geometry import Array
from micstools.reader import Run


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
