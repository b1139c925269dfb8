"""Contact in runs: smooth forms that are cut finely, who may sleep, a box that slides, heaps of
stones; blocks at rest give way little, and what goes through is told."""

import itertools
from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools.reading.reader import Run
from micstools.shapes.meshing import shape_text
from shared_runs import mics, results, told


def ellipsoid(path: Path, axes: tuple[float, float, float], n: int) -> None:
    """A shape file: n x n squares on each side of a cube, blown up, two triangles each, with the
    centre."""
    number: dict[tuple[int, ...], int] = {}

    def at(axis: int, side: int, i: int, j: int) -> int:
        place = np.roll([side * n, 2 * i - n, 2 * j - n], axis)
        return number.setdefault(tuple(place.tolist()), 1 + len(number))

    tets = []
    for axis, side in itertools.product(range(3), (-1, 1)):
        for i, j in itertools.product(range(n), range(n)):
            a, b, c, d = (at(axis, side, i + k, j + m) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
            tets += [(0, a, b, c), (0, a, c, d)]
    cube = np.tan(np.pi / 4 * np.array(list(number)) / n)
    points = np.concatenate([[[0, 0, 0]], cube / np.linalg.norm(cube, axis=1)[:, None]]) * axes
    path.write_text(shape_text(points, np.array(tets)))


def height_map(path: Path, z: np.ndarray, dx: float, dy: float) -> None:
    """A bed from the heights (ny, nx) [m] at points of a spacing [m]."""
    heights = "\n".join(" ".join(repr(float(v)) for v in row) for row in z)
    path.write_text(f"{z.shape[1]} {z.shape[0]} 0 0 {dx} {dy}\n{heights}\n")


@pytest.mark.parametrize("squares", [6, 40])
def test_a_stone_lies_on_the_floor(squares: int, tmp_path: Path) -> None:
    """A flat pebble of any number of facets: the finer one bends by less than a degree."""
    ellipsoid(tmp_path / "pebble.txt", (0.03, 0.03, 0.009), squares)
    case = """&run physics = 'dry'  t_end = 0.15  dt = 0.005  restart_interval = 0 /
    &grid cells = 8, 8, 8  length = 0.2, 0.2, 0.2 /
    &shape name = 'pebble'  kind = 'file'  file = 'pebble.txt' /
    &body shape = 'pebble'  position = 0.1, 0.1, 0.0095 /
    """
    assert told(tmp_path, case) == (0, "")
    height = Run(tmp_path / "mics-out").bodies.position[-1, 0, 2]
    assert height == pytest.approx(0.009, abs=1.5e-4)


@pytest.mark.parametrize("spacing", [0.02, 0.005])
def test_a_beam_lies_on_a_crest(spacing: float, tmp_path: Path) -> None:
    """On a smooth wave of the bed, whose facets differ by four degrees or by one."""
    x = np.arange(0, 1.2 + 1e-9, spacing)
    z = 0.05 + 0.03 * np.cos(2 * np.pi * (x - 0.6) / 0.6)
    height_map(tmp_path / "crest.txt", np.tile(z, (16, 1)), spacing, 0.02)
    case = """&run physics = 'dry'  dt = 0.005  t_end = 0.5  restart_interval = 0 /
    &grid cells = 24, 6, 8  length = 1.2, 0.3, 0.4 /
    &bed file = 'crest.txt' /
    &shape name = 'beam'  kind = 'box'  size = 0.3, 0.03, 0.03 /
    &body shape = 'beam'  position = 0.6, 0.15, 0.0955 /
    """
    assert told(tmp_path, case) == (0, "")
    height = Run(tmp_path / "mics-out").bodies.position[-1, 0, 2]
    assert height == pytest.approx(0.095, abs=5e-4)


@pytest.mark.parametrize(("fixed", "asleep"), [(".true.", 1), (".false.", 0)])
def test_only_what_is_held_up_sleeps(fixed: str, asleep: int, tmp_path: Path) -> None:
    """A stone lies on a raft in still oil: nothing keeps the two in their place."""
    case = f"""&run dt = 0.01  t_end = 2  restart_interval = 0 /
    &grid cells = 20, 20, 20  length = 0.2, 0.2, 0.2 /
    &fluid water_level = 0.1  liquid_viscosity = 1 /
    &shape name = 'raft'  kind = 'box'  size = 0.1, 0.1, 0.04  density = 500 /
    &shape name = 'stone'  kind = 'cube'  size = 0.03 /
    &body shape = 'raft'  position = 0.1, 0.1, 0.0938  fixed = {fixed} /
    &body shape = 'stone'  position = 0.1, 0.1, 0.1287 /
    """
    code, said = told(tmp_path, case)
    assert code == 0
    assert all("was cut at its limit" in line for line in said.splitlines())  # a light raft
    assert Run(tmp_path / "mics-out").series.sleeping[-1] == asleep


SLOPE, FRICTION, G = 0.6, 0.5, 9.81
DOWN = G / (1 + SLOPE**2) ** 0.5
"""Weight per mass across the slope [m/s2]."""
CASE = f"""&run physics = 'dry'  t_end = 0.52  dt = 0.02 /
&grid cells = 40, 40, 20  length = 0.4, 0.4, 0.2 /
&fluid gravity = 0, {SLOPE * DOWN}, {-DOWN} /
&contact contact_time = 0.002  friction = {FRICTION}  sleep = F /
&shape name = 'bar'  kind = 'box'  size = 0.02, 0.3, 0.02  density = 2300 /
&shape name = 'box'  kind = 'box'  size = 0.12, 0.02, 0.02  density = 2300 /
&body shape = 'bar'  position = 0.17, 0.2, 0.05  fixed = T /
&body shape = 'bar'  position = 0.23, 0.2, 0.05  fixed = T /
&body shape = 'box'  position = 0.2, 0.2, 0.070002 /
"""


def test_only_friction_slows_a_box(tmp_path: Path) -> None:
    """Over .1 m it gains g (sin - mu cos) t, within 1 %, and does not turn."""
    with results(tmp_path, CASE) as h5:
        time, velocity, spin = (
            h5[f"bodies/{name}"][:] for name in ("time", "velocity", "angular_velocity")
        )
    gained = (velocity[-1, 2, 1] - velocity[5, 2, 1]) / (time[-1] - time[5])
    assert gained == pytest.approx(DOWN * (SLOPE - FRICTION), rel=0.01)
    assert abs(spin[:, 2]).max() < 0.01


STONES = "&shape name = 'rock'  kind = 'rock'  density = 2650  mass_50 = 0.1 /\n"
HEAP = f"""&run t_end = 6  dt = 0.01  physics = 'dry'  stop_when_settled = T  field_interval = 0 /
&grid cells = 6, 6, 20  length = 0.24, 0.24, 0.8 /
{STONES}&drop shape = 'rock'  position = 0.12, 0.12, 0.5  count = 20  interval = 0.11
  spread = 0.05, 0.05, 0  orientation = 'random'  seed = {{seed}} /
"""
FALL = f"""&run t_end = 0.12  dt = 0.01  field_interval = 0.12 /
&grid cells = 12, 12, 24  length = 0.12, 0.12, 0.24 /
&fluid water_level = 0.15 /
{STONES}&body shape = 'rock-07'  position = 0.06, 0.06, 0.19  axis = 1, 2, 3  angle_deg = 40 /
"""


def test_a_heap_settles(tmp_path: Path) -> None:
    """Twenty stones lie still, all in the tank, none deep in another; another seed draws others."""
    with results(tmp_path, HEAP.format(seed=1)) as h5:
        assert h5["bodies/time"][-1] < 6.0
        assert np.abs(h5["bodies/velocity"][-1]).max() < 1e-3
        place = h5["bodies/position"][-1]
        assert (np.abs(place[:, :2] - 0.12) < 0.12).all()
        assert place[:, 2].max() > 1.5 * np.median(place[:, 2]), "some lie on others"
        size = min(float(shape.attrs["volume"]) for shape in h5["shapes"].values()) ** (1 / 3)
        assert h5["series/max_overlap"][-1] < 0.01 * size
        drawn = h5["bodies/shape"].asstr()[:]
        mass = [h5[f"shapes/{name}"].attrs["volume"] * 2650 for name in drawn]
        assert h5["bodies/mass"][:] == pytest.approx(np.array(mass).ravel(), rel=1e-15)
        assert len(set(drawn)) > 8 and set(drawn) <= {f"rock-{k:02d}" for k in range(1, 21)}


def test_one_falls_in_water(tmp_path: Path) -> None:
    """The grid holds the volume of the stone, the books of liquid and momentum are closed."""
    with results(tmp_path, FALL) as h5:
        b, dt = h5["bodies"], np.diff(h5["bodies/time"][:])
        force = b["fluid_force"][1:, 0] + b["contact_force"][1:, 0]
        gained = np.diff(b["velocity"][:, 0], axis=0) * b["mass"][0]
        weight = b["mass"][0] * np.array([0, 0, -9.81])
        assert gained == pytest.approx(dt[:, None] * (force + weight), abs=1e-14)
        assert np.abs(h5["series/liquid_volume_drift"][:]).max() < 1e-12
        assert b["position"][-1, 0, 2] < 0.15
    with h5py.File(tmp_path / "mics-out" / "fields.vtkhdf") as h5, \
            h5py.File(tmp_path / "mics-out" / "run.h5") as rows:  # fmt: skip
        solid = h5["VTKHDF/CellData/solid"][-1].sum() * 1e-6
        volume = float(np.ravel(rows["shapes/rock-07"].attrs["volume"])[0])
        assert solid == pytest.approx(volume, rel=1e-6)


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
        assert "body 1 and " in line and " reach" in line and "% of the size of the smaller" in line
    assert warning.startswith("mics: warning: ") and ", t = 0." in warning
    assert "above 20 %" in fault
    assert list((tmp_path / "mics-out").glob("restart-*.h5"))
    # both sides share the overlap until one takes all of it
    for line, share in ((warning, 0.05), (fault, 0.2)):
        assert 0.99 * share < float(line.split("reach ")[1].split()[0]) / 0.02 < 2.1 * share


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
