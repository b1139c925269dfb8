"""Contact in runs: smooth forms that are cut finely, who may sleep, a box that slides, heaps of
stones; blocks at rest give way little, and what goes through is told."""

import itertools
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from micstools.reading.reader import Run
from micstools.shapes.meshing import shape_text
from shared_runs import results, texts, told

CASES = texts("contact")


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


def height_at_end(work: Path, case: str) -> float:
    """Where the only block ends in a run without a word [m]."""
    assert told(work, case) == (0, "")
    return float(Run(work / "mics-out").bodies.position[-1, 0, 2])


@pytest.mark.parametrize("squares", [6, 40])
def test_a_stone_lies_on_the_floor(squares: int, tmp_path: Path) -> None:
    """A flat pebble of any number of facets: the finer one bends by less than a degree."""
    ellipsoid(tmp_path / "pebble.txt", (0.03, 0.03, 0.009), squares)
    assert height_at_end(tmp_path, CASES["pebble"]) == pytest.approx(0.009, abs=1.5e-4)


@pytest.mark.parametrize("spacing", [0.02, 0.005])
def test_a_beam_lies_on_a_crest(spacing: float, tmp_path: Path) -> None:
    """On a smooth wave of the bed, whose facets differ by four degrees or by one."""
    x = np.arange(0, 1.2 + 1e-9, spacing)
    z = 0.05 + 0.03 * np.cos(2 * np.pi * (x - 0.6) / 0.6)
    height_map(tmp_path / "crest.txt", np.tile(z, (16, 1)), spacing, 0.02)
    assert height_at_end(tmp_path, CASES["beam"]) == pytest.approx(0.095, abs=5e-4)


@pytest.mark.parametrize(("fixed", "asleep"), [(".true.", 1), (".false.", 0)])
def test_only_what_is_held_up_sleeps(fixed: str, asleep: int, tmp_path: Path) -> None:
    """A stone lies on a raft in still oil: nothing keeps the two in their place."""
    code, said = told(tmp_path, CASES["raft"].format(fixed=fixed))
    assert code == 0
    assert all("was cut at its limit" in line for line in said.splitlines())  # a light raft
    assert Run(tmp_path / "mics-out").series.sleeping[-1] == asleep


SLOPE, FRICTION, G = 0.6, 0.5, 9.81
DOWN = G / (1 + SLOPE**2) ** 0.5
"""Weight per mass across the slope [m/s2]."""


def test_only_friction_slows_a_box(tmp_path: Path) -> None:
    """Over .1 m it gains g (sin - mu cos) t, within 1 %, and does not turn."""
    case = CASES["slide"].format(along=SLOPE * DOWN, across=-DOWN, friction=FRICTION)
    with results(tmp_path, case) as h5:
        time, velocity, spin = (
            h5[f"bodies/{name}"][:] for name in ("time", "velocity", "angular_velocity")
        )
    gained = (velocity[-1, 2, 1] - velocity[5, 2, 1]) / (time[-1] - time[5])
    assert gained == pytest.approx(DOWN * (SLOPE - FRICTION), rel=0.01)
    assert abs(spin[:, 2]).max() < 0.01


def test_a_heap_settles(tmp_path: Path) -> None:
    """Twenty stones lie still, all in the tank, none deep in another."""
    with results(tmp_path, CASES["heap"]) as h5:
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
    with results(tmp_path, CASES["fall"]) as h5:
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


def cubes(end: float, size: float = 0.04, also: str = "", **more: Any) -> str:
    """A dry case of so many seconds with cubes of a size [m], and what stands there besides."""
    return CASES["cubes"].format(end=end, size=size) + CASES.get(also, "").format(**more)


def overlap_asleep(work: Path, case: str) -> float:
    """Overlap [m] at the end of a run without a word, in which all bodies sleep."""
    assert told(work, case) == (0, "")
    run = Run(work / "mics-out")
    assert run.series.sleeping[-1] == run.bodies.n
    return float(run.series.max_overlap[-1])


@pytest.mark.parametrize("e", ["0", "1e-6", "1e-3", "0.1"])
@pytest.mark.parametrize("gap", [1e-3, 2e-2])
def test_stack_rests(e: str, gap: float, tmp_path: Path) -> None:
    """Two cubes of 40 mm fall on one another: within .1 mm and asleep, however small e is."""
    case = cubes(1.0) + f"&contact restitution = {e} /\n"
    for k in range(2):
        case += f"&body shape = 'c'  position = 0.15, 0.15, {0.02 + gap + k * (0.04 + gap)} /\n"
    assert overlap_asleep(tmp_path, case) < 1e-4


@pytest.mark.cost(30)
@pytest.mark.parametrize("size", [0.01, 0.005])
def test_small_blocks_carry_a_heavy_one(size: float, tmp_path: Path) -> None:
    """A cube of 100 mm on four small ones: they give way by less than 1 % and all sleep."""
    case = cubes(1.5, size) + "&shape name = 'b'  kind = 'cube'  size = 0.1 /\n"
    case += f"&body shape = 'b'  position = 0.15, 0.15, {size + 0.0501} /\n"
    for x, y in itertools.product((0.1 + size, 0.2 - size), repeat=2):
        case += f"&body shape = 'c'  position = {x}, {y}, {size / 2} /\n"
    assert overlap_asleep(tmp_path, case) < 0.01 * size


@pytest.mark.parametrize("model", ["surface", "spheres"])
def test_driven_plate_is_told(model: str, tmp_path: Path) -> None:
    """A plate of 20 mm is pushed down through a block at 2 cm/s: a warning at 5 % of the smaller,
    code 3 with the state saved at 20 %."""
    code, said = told(tmp_path, cubes(2.0, also="driven", model=model))
    warning, fault = said.splitlines()
    assert code == 3
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
    height = 0.1 if fixed == "T" else 0.0005
    case = cubes(0.6, also="thin", height=height, above=height + 0.0405, fixed=fixed)
    code, said = told(tmp_path, case)
    overlap = Run(tmp_path / "mics-out").series.max_overlap[-1]
    out_again = code == 0 and overlap < 0.05 * 0.001
    assert out_again or (code == 3 and "of the size of the smaller" in said)
