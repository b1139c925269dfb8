"""A block rests by the rule that ends a run."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.reading import rest, scales


def run_of(since: float, end: float, z: np.ndarray, turn: float = 0.0) -> Any:
    """One block in rows to a time `end` [s] whose height is `z` (T) [m]; it ends after a turn."""
    attitude = np.tile([1.0, 0, 0, 0], (len(z), 1, 1))
    attitude[:-1, 0] = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    bodies = SimpleNamespace(
        time=np.linspace(0, end, len(z)),
        position=np.stack([0 * z, 0 * z, z], axis=1)[:, None],
        quaternion=attitude,
        shape=["block"],
        rest_since=np.array([since]),
    )
    shapes = {"block": SimpleNamespace(radius=0.6)}
    return SimpleNamespace(bodies=bodies, shapes=shapes, value=lambda group, name: 0.5)


@pytest.mark.parametrize(
    ("since", "rests"), [(0.0, True), (1.5, True), (1.6, False), (np.nan, False)]
)
def test_it_rests_after_the_time_of_the_case(since: float, rests: bool) -> None:
    """Of 2 s, with any rows: the program counts, not the tools."""
    for rows in (2, 21):
        found = rest.of_block(run_of(since, 2.0, np.zeros(rows)), 0)
        assert (found.time == since) is rests and found.span == 0.5


def test_how_far_it_moved_at_last() -> None:
    """From the last row that is rest_time before the end; a turn counts at the corners."""
    z = np.linspace(2.0, 0.0, 21)
    assert rest.of_block(run_of(np.nan, 2.0, z), 0).moved == pytest.approx(0.5)
    turned = rest.of_block(run_of(0.0, 2.0, np.zeros(21), turn=0.1), 0)
    assert turned.moved == pytest.approx(0.06)


def test_limits_grow_with_the_blocks() -> None:
    """Of touching, and of forces that count."""
    for length in (0.06, 2.0):
        bodies = SimpleNamespace(n=1, shape=["block"], mass=np.array([2.0]))
        shapes = {"block": SimpleNamespace(length=length)}
        run: Any = SimpleNamespace(bodies=bodies, shapes=shapes, gravity=np.array([0, 0, -9.81]))
        assert scales.reach(run) == pytest.approx(length / 120)
        assert scales.weight(run) == pytest.approx(2 * 9.81)
