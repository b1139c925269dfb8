"""Blocks at rest give way little, whatever the restitution and the load, and what goes through is
told: stacks, heavy blocks on small ones, thin plates, plates that are driven into blocks."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from shared_runs import mics

HEAD = """&run t_end = {end}  dt = 0.005  physics = 'dry'  field_interval = 0 /
&grid cells = 4, 4, 4  length = 0.3, 0.3, 0.3 /
&shape name = 'c'  kind = 'cube'  size = {size}  density = 2300 /
"""


def end_of(work: Path) -> tuple[float, int, int]:
    """Overlap [m] at the end of the run, how many bodies sleep, and how many there are."""
    with h5py.File(work / "mics-out" / "run.h5") as h5:
        series = h5["series"]
        bodies = h5["bodies/position"].shape[1]
        return float(series["max_overlap"][-1]), int(series["sleeping"][-1]), bodies


@pytest.mark.parametrize("e", ["0", "1e-6", "1e-3", "0.1"])
@pytest.mark.parametrize("gap", [1e-3, 2e-2])
def test_stack_rests(e: str, gap: float, tmp_path: Path) -> None:
    """Two cubes of 40 mm fall on one another: within .1 mm and asleep, however small e is."""
    case = HEAD.format(end=1.0, size=0.04) + f"&contact restitution = {e} /\n"
    for k in range(2):
        case += f"&body shape = 'c'  position = 0.15, 0.15, {0.02 + gap + k * (0.04 + gap)} /\n"
    done = mics(tmp_path, case)
    overlap, asleep, bodies = end_of(tmp_path)
    assert (done.returncode, done.stderr, asleep) == (0, "", bodies)
    assert overlap < 1e-4


@pytest.mark.cost(30)
@pytest.mark.parametrize("size", [0.01, 0.005])
def test_small_blocks_carry_a_heavy_one(size: float, tmp_path: Path) -> None:
    """A cube of 100 mm on four small ones: they give way by less than 1 % and all sleep."""
    case = HEAD.format(end=1.5, size=size) + "&shape name = 'b'  kind = 'cube'  size = 0.1 /\n"
    case += f"&body shape = 'b'  position = 0.15, 0.15, {size + 0.0501} /\n"
    for x in (-1, 1):
        for y in (-1, 1):
            place = [0.15 + x * (0.05 - size), 0.15 + y * (0.05 - size), size / 2]
            case += "&body shape = 'c'  position = {}, {}, {} /\n".format(*place)
    done = mics(tmp_path, case)
    overlap, asleep, bodies = end_of(tmp_path)
    assert (done.returncode, done.stderr, asleep) == (0, "", bodies)
    assert overlap < 0.01 * size


@pytest.mark.parametrize("model", ["surface", "spheres"])
def test_driven_plate_is_told(model: str, tmp_path: Path) -> None:
    """A plate of 20 mm is pushed down through a block at 2 cm/s: a warning at 5 % of the smaller,
    code 3 with the state saved at 20 %."""
    case = HEAD.format(end=2.0, size=0.04) + f"&contact model = '{model}' /\n"
    case += "&shape name = 'p'  kind = 'box'  size = 0.1, 0.1, 0.02 /\n"
    case += "&body shape = 'c'  position = 0.15, 0.15, 0.02 /\n"
    case += "&body shape = 'p'  position = 0.15, 0.15, 0.055  fixed = T  velocity = 0, 0, -0.02 /\n"
    done = mics(tmp_path, case)
    warning, fault = done.stderr.splitlines()
    assert done.returncode == 3
    for line in (warning, fault):
        assert "body 1 and body 2 reach" in line and "% of the size of the smaller" in line
    assert warning.startswith("mics: warning: ") and ", t = 0." in warning
    assert "above 20 %" in fault
    assert list((tmp_path / "mics-out").glob("restart-*.h5"))
    with h5py.File(tmp_path / "mics-out" / "run.h5") as h5:
        overlap = h5["series/max_overlap"][:]
    if model == "surface":
        assert 0.2 * 0.02 < overlap[-1] < 0.22 * 0.02
        assert np.all(overlap[:-2] < 0.2 * 0.02)


@pytest.mark.parametrize("fixed", ["T", "F"])
def test_block_in_a_thin_plate_is_told(fixed: str, tmp_path: Path) -> None:
    """A corner comes down on a plate of 1 mm at 7.7 m/s: out again, or told."""
    case = HEAD.format(end=0.6, size=0.04)
    case += "&shape name = 'p'  kind = 'box'  size = 0.1, 0.1, 0.001 /\n"
    height = 0.1 if fixed == "T" else 0.0005
    case += f"&body shape = 'p'  position = 0.15, 0.15, {height}  fixed = {fixed} /\n"
    case += f"&body shape = 'c'  position = 0.15, 0.15, {height + 0.0405}  velocity = 0, 0, -7.7"
    case += "  axis = 1, 0.3, 0  angle_deg = 40 /\n"
    done = mics(tmp_path, case)
    overlap, _, _ = end_of(tmp_path)
    out_again = done.returncode == 0 and overlap < 0.05 * 0.001
    assert out_again or (done.returncode == 3 and "of the size of the smaller" in done.stderr)
