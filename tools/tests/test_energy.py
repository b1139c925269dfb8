"""Energy that contact makes, found in the rows of a run."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.reading.energy import largest_made, made_by_contact

MASS, SPIN, G, STEP = 2.0, 0.3, 9.81, 0.1
LIMIT = np.ones(8)  # [J]
KICKED = 4  # the row of the step in which contact acts


def thrown(push: float = 0.0, twist: float = 0.0, **values: Any) -> Any:
    """Two blocks, the second one let go with 3 m/s in the second row and carried by a steady force
    of the water; in one step contact lifts and turns it by a mean force and torque."""
    time = np.arange(8) * STEP
    force, torque, speed, turning = (np.zeros((8, 2, 3)) for _ in range(4))
    force[KICKED, 1, 2], torque[KICKED, 1, 2] = push, twist
    speed[1:, 1, 2] = 3.0 + (25.0 / MASS - G) * time[1:]
    speed[KICKED:, 1, 2] += push * STEP / MASS
    turning[KICKED:, 1, 2] = twist * STEP / SPIN
    way, angle = np.zeros((8, 2, 3)), np.zeros(8)
    way[1:] = np.cumsum((speed[1:] + speed[:-1]) / 2 * STEP, axis=0)
    angle[1:] = np.cumsum((turning[1:, 1, 2] + turning[:-1, 1, 2]) / 2 * STEP)
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (8, 2, 1))
    attitude[:, 1, 0], attitude[:, 1, 3] = np.cos(angle / 2), np.sin(angle / 2)
    bodies = SimpleNamespace(
        time=time,
        position=way,
        quaternion=attitude,
        velocity=speed,
        angular_velocity=turning,
        contact_force=force,
        contact_torque=torque,
    )
    return SimpleNamespace(
        bodies=bodies,
        series=SimpleNamespace(time=time, contact_energy=np.zeros(8), dt=np.full(8, STEP)),
        sides={"x_min": "no_slip", "z_max": "open"},
        value=lambda group, name: values.get(name, 0.0),
    )


def test_a_block_that_is_let_go_with_a_speed_gets_nothing_from_contact() -> None:
    """Whatever the step: weight, water and the speed of the drop are no contact."""
    assert made_by_contact(thrown()) == pytest.approx(np.zeros(8), abs=1e-12)
    assert largest_made(thrown(), LIMIT).energy == 0.0


def test_a_throw_is_found_in_its_row() -> None:
    run = thrown(push=5.0, twist=0.6)
    before, after = run.bodies.velocity[KICKED - 1 : KICKED + 1, 1, 2]
    gain = 5.0 * STEP * (before + after) / 2 + 0.5 * SPIN * (0.6 * STEP / SPIN) ** 2
    made = made_by_contact(run)
    assert made[KICKED] == pytest.approx(gain)
    assert np.delete(made, KICKED) == pytest.approx(np.zeros(7), abs=1e-12)
    found = largest_made(run, LIMIT)
    assert (found.energy, found.block) == (pytest.approx(gain), 2)
    assert found.time == pytest.approx(KICKED * STEP)


def test_a_block_that_lands_is_not_thrown() -> None:
    """Contact stops it, and the water that has carried it along lifts it in the end of the step:
    the mean velocity points up, though it came down on the way."""
    run = thrown(push=5.0)
    run.bodies.position[KICKED:, 1, 2] -= 2.0 * STEP * run.bodies.velocity[KICKED, 1, 2]
    assert (made_by_contact(run) <= 0.0).all()


def test_energy_in_springs_is_no_gain() -> None:
    run = thrown(push=5.0)
    run.series.contact_energy[:KICKED] = 10.0  # pressed together before, and let go
    assert (made_by_contact(run) <= 0.0).all()


def test_the_step_that_is_most_over_its_limit_counts() -> None:
    """Energy that appears in springs is of no block."""
    run = thrown(push=5.0)
    run.series.contact_energy[6:] = 0.5
    limit = np.where(np.arange(8) == KICKED, 1e6, 1.0)
    found = largest_made(run, limit)
    assert (found.energy, found.limit, found.block) == (pytest.approx(0.5), 1.0, 0)
    assert found.time == pytest.approx(6 * STEP)


def test_rows_of_several_steps_are_not_known() -> None:
    run = thrown(push=5.0)
    run.series.dt[:] = STEP / 2
    made = made_by_contact(run)
    assert np.isnan(made[1:]).all()
    found = largest_made(run, LIMIT)
    assert np.isnan(found.energy) and "history_interval = 0" in found.reason


def test_a_moving_wall_gives_energy() -> None:
    found = largest_made(thrown(push=5.0, x_min_velocity=[0.0, 1.0, 0.0]), LIMIT)
    assert np.isnan(found.energy) and "wall moves" in found.reason
    assert largest_made(thrown(z_max_velocity=[1.0, 0.0, 0.0]), LIMIT).energy == 0.0  # no wall
