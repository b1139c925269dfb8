"""The file of `&fluid initial_state`: what it says is taken, and a wrong one is refused."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools.cases.initial_state import write_initial_state
from micstools.reading.reader import Run
from test_input import mics

CASE = """&run t_end = 0.001 dt = 0.001 physics = 'fluid' field_interval = 1 /
&grid cells = 6, 4, 5  length = 0.6, 0.4, 0.5 /
&boundary x_min = 'periodic' x_max = 'periodic' y_min = 'periodic' y_max = 'periodic'
  z_min = 'slip' z_max = 'slip' /
&fluid initial_state = 'state.h5' """
SHAPE = (5, 4, 6)
ONES = np.ones(SHAPE)


def wave() -> np.ndarray:
    """A velocity free of divergence that no wall hinders."""
    velocity = np.zeros((*SHAPE, 3))
    velocity[..., :2] = np.arange(5)[:, None, None, None] * [1.0, 0.5]
    return velocity


def test_state_is_taken(tmp_path: Path) -> None:
    """The first frame shows the liquid and the velocity of the file, cell by cell."""
    liquid = np.random.default_rng(1).random(SHAPE)
    write_initial_state(tmp_path / "state.h5", liquid, wave())
    done = mics(["--output", "out"], tmp_path, CASE + "gravity = 0, 0, 0 /")
    assert done.returncode == 0, done.stderr
    run = Run(tmp_path / "out")
    first = run.fields_at(0.0)
    assert np.abs(first.liquid - liquid).max() < 1e-6  # fields are stored in single precision
    assert np.abs(first.velocity - wave()).max() < 1e-6
    assert run.series.liquid_volume[0] == pytest.approx(1e-3 * liquid.sum(), rel=1e-12)


@pytest.mark.parametrize(
    ("liquid", "velocity", "more", "message"),
    [
        (ONES[1:], None, "/", "liquid does not have the cells of &grid"),
        (None, ONES, "/", "velocity has another number of dimensions than (nz, ny, nx, 3)"),
        (None, np.nan * wave(), "/", "velocity must hold finite numbers"),
        (None, 1e21 * wave(), "/", "velocity must hold finite numbers up to 1e20"),
        (None, None, "/", "the file holds neither 'liquid' nor 'velocity'"),
        (ONES, None, "water_level = 0.1 /", "'liquid' of the file takes the place of"),
        (ONES, None, "/ &water min = 0,0,0 max = 1,1,1 /", "'liquid' of the file takes the"),
        (None, wave(), "velocity = 1, 0, 0 /", "'velocity' of the file takes the place of"),
    ],
)
def test_wrong_state_is_refused(
    liquid: np.ndarray | None, velocity: np.ndarray | None, more: str, message: str, tmp_path: Path
) -> None:
    """Exit code 2, the reason and the line of the group."""
    write_initial_state(tmp_path / "state.h5", liquid, velocity)
    done = mics(["--check"], tmp_path, CASE + more)
    assert done.returncode == 2
    assert f"mics: &fluid initial_state = 'state.h5': {message}" in done.stderr
    assert "(line 5)" in done.stderr


def test_elements_of_a_wrong_size_are_refused(tmp_path: Path) -> None:
    """A damaged size of the numbers makes the library read past its buffers: not tried."""
    write_initial_state(tmp_path / "state.h5", ONES, None)
    with h5py.File(tmp_path / "state.h5", "r+") as h5:
        del h5["liquid"]
        pair = h5py.h5t.array_create(h5py.h5t.IEEE_F64LE, (1000,))
        space = h5py.h5s.create_simple(SHAPE)
        h5py.h5d.create(h5.id, b"liquid", pair, space)
    done = mics(["--check"], tmp_path, CASE + "/")
    assert done.returncode == 2
    assert "liquid has elements of a size that no number has" in done.stderr


def test_missing_state_is_refused(tmp_path: Path) -> None:
    """A file that is not there is named."""
    done = mics(["--check"], tmp_path, CASE + "/")
    assert done.returncode == 2
    assert "state.h5: cannot open the file" in done.stderr
