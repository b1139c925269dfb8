"""Rest is told by places, and limits grow with the blocks."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.reading import rest, scales

G = 9.81


def run_of(z: np.ndarray, step: float, length: float, g: float = G) -> Any:
    """One block of a length whose height in each row is `z` (T) [m]; its velocities are noise."""
    n = len(z)
    position = np.zeros((n, 1, 3))
    position[:, 0, 2] = z
    noise = np.random.default_rng(1).normal(scale=2.5e-3, size=(n, 1, 3))
    bodies = SimpleNamespace(
        n=1,
        time=step * np.arange(n),
        position=position,
        quaternion=np.tile([1.0, 0, 0, 0], (n, 1, 1)),
        velocity=noise,
        shape=["block"],
        mass=np.array([2.0]),
        release_time=np.zeros(1),
        dropped=np.array([0]),
        present=lambda row: np.array([True]),
    )
    shape = SimpleNamespace(length=length, radius=0.6 * length)
    return SimpleNamespace(
        bodies=bodies,
        shapes={"block": shape},
        gravity=np.array([0.0, 0, -g]),
        value=lambda group, name: 0.5,
    )


@pytest.mark.parametrize("length", [0.06, 2.0])
def test_a_block_is_at_rest_when_it_stays(length: float) -> None:
    """It falls by its length for 20 rows, twitches by micrometres, and has noisy velocities: at
    rest it is from the row on from which 0.5 % of its length are left to go."""
    unit = np.sqrt(length / G)
    z = length * np.concatenate([np.linspace(1, 0, 21), 1e-4 * np.sin(np.arange(100))])
    found = rest.of_block(run_of(z, 0.1 * unit, length), 0)
    assert found.time == pytest.approx(2.0 * unit)
    assert found.span == pytest.approx(4 * unit) and found.limit == pytest.approx(5e-3 * length)
    assert found.moved < 3e-4 * length


def test_a_late_twitch_does_not_end_rest_and_a_shift_does() -> None:
    z = np.zeros(200)
    z[150] = 1e-4  # [m], and back
    assert rest.of_block(run_of(z, 0.01, 0.06), 0).time == 0.0
    z[150:] = 1e-3
    assert rest.of_block(run_of(z, 0.01, 0.06), 0).time == pytest.approx(1.5)


def test_a_block_that_falls_to_the_end_is_not_at_rest() -> None:
    z = np.linspace(1, 0, 200)
    found = rest.of_block(run_of(z, 0.01, 0.06), 0)
    assert np.isnan(found.time) and found.moved == pytest.approx(found.span / 2, rel=0.04)


def test_a_turn_counts_as_a_way_of_its_corners() -> None:
    run = run_of(np.zeros(200), 0.01, 0.06)
    turn = np.radians(2.0)
    run.bodies.quaternion[:120, 0] = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    assert rest.of_block(run, 0).time == pytest.approx(1.2)


def test_without_weight_rest_takes_the_time_of_the_case() -> None:
    found = rest.of_block(run_of(np.zeros(200), 0.01, 0.06, g=0.0), 0)
    assert (found.time, found.span) == (0.0, 0.5)


def test_limits_grow_with_the_blocks() -> None:
    small, large = (run_of(np.zeros(2), 0.1, length) for length in (0.06, 2.0))
    assert scales.reach(small) == pytest.approx(5e-4)
    assert scales.reach(large) == pytest.approx(2 / 120)
    assert scales.weight(small) == pytest.approx(2 * G)
