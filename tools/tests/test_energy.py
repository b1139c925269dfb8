"""Energy that contact makes, found in the rows of a run."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.energy import made_by_contact

MASS, SPIN, G = 2.0, 0.3, 9.81


def thrown(kick: float) -> Any:
    """A block that a steady force and torque lift and turn against its weight, and to which contact
    gives energy in the fourth row."""
    time = np.arange(8) * 0.1
    push, twist = 25.0, 0.7
    speed, turning = (push / MASS - G) * time, twist / SPIN * time
    height = 0.5 * (push / MASS - G) * time**2
    kinetic = MASS * speed**2 / 2 + SPIN * turning**2 / 2
    kinetic[4:] += kick
    along = np.zeros((8, 1, 3))
    along[..., 2] = 1.0
    return SimpleNamespace(
        bodies=SimpleNamespace(
            time=time,
            velocity=along * speed[:, None, None],
            angular_velocity=along * turning[:, None, None],
            fluid_force=along * push,
            fluid_torque=along * twist,
        ),
        series=SimpleNamespace(
            kinetic_energy_bodies=kinetic,
            potential_energy_bodies=MASS * G * height,
            contact_energy=np.zeros(8),
        ),
    )


def test_what_the_fluid_gives_is_not_made_by_contact() -> None:
    assert made_by_contact(thrown(0.0)) == pytest.approx(np.zeros(8), abs=1e-12)


def test_a_throw_is_found_in_its_row() -> None:
    made = made_by_contact(thrown(0.25))
    assert made[4] == pytest.approx(0.25)
    assert np.delete(made, 4) == pytest.approx(np.zeros(7), abs=1e-12)


def test_energy_in_springs_is_no_gain() -> None:
    run = thrown(0.25)
    run.series.contact_energy[:4] = 0.25  # pressed together before, and let go
    assert made_by_contact(run)[1:] == pytest.approx(np.zeros(7), abs=1e-12)
