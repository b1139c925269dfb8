"""Smooth forms that are cut finely touch as any other: stones on a floor, a beam on a crest; beds
and constants that are refused, and who may sleep."""

import itertools
from pathlib import Path

import h5py
import numpy as np
import pytest

from shared_runs import run_text


def mics(work: Path, case: str, *words: str) -> tuple[int, str, str]:
    """Exit code, output and messages of a run."""
    done = run_text(work, case, *words)
    return done.returncode, done.stdout, done.stderr


def series(work: Path, name: str) -> np.ndarray:
    with h5py.File(work / "mics-out" / "run.h5") as h5:
        return h5[name][:]


def ellipsoid(path: Path, axes: tuple[float, float, float], n: int) -> None:
    """A shape file: n x n squares on each side of a cube, blown up, two triangles each, with the
    centre."""
    number: dict[tuple[int, ...], int] = {}

    def at(axis: int, side: int, i: int, j: int) -> int:
        place = np.roll([side * n, 2 * i - n, 2 * j - n], axis)
        return number.setdefault(tuple(place.tolist()), 2 + len(number))

    tets = []
    for axis, side in itertools.product(range(3), (-1, 1)):
        for i, j in itertools.product(range(n), range(n)):
            a, b, c, d = (at(axis, side, i + k, j + m) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
            tets += [(1, a, b, c), (1, a, c, d)]
    cube = np.tan(np.pi / 4 * np.array(list(number)) / n)
    points = np.concatenate([[[0, 0, 0]], cube / np.linalg.norm(cube, axis=1)[:, None]]) * axes
    lines = ["mics-shape 1", f"points {len(points)}"]
    lines += [" ".join(repr(float(x)) for x in point) for point in points]
    lines += [f"tets {len(tets)}"] + [" ".join(map(str, tet)) for tet in tets]
    path.write_text("\n".join(lines) + "\n")


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
    code, _, said = mics(tmp_path, case, "--quiet")
    assert (code, said) == (0, "")
    height = series(tmp_path, "bodies/position")[-1, 0, 2]
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
    code, _, said = mics(tmp_path, case, "--quiet")
    assert (code, said) == (0, "")
    height = series(tmp_path, "bodies/position")[-1, 0, 2]
    assert height == pytest.approx(0.095, abs=5e-4)


def test_a_bed_that_does_not_meet_itself_is_refused(tmp_path: Path) -> None:
    """A slope from one periodic side to the other would have a cliff without a facet."""
    case = """&run physics = 'dry'  t_end = 1 /
    &grid cells = 8, 8, 8  length = 1, 1, 1 /
    &boundary x_min = 'periodic'  x_max = 'periodic' /
    &bed file = 'slope.txt' /
    """
    for rise, wanted in ((0.2, 2), (0.0, 0)):
        z = 0.2 + rise * np.array([0.0, 0.5, 1.0])
        height_map(tmp_path / "slope.txt", np.tile(z, (2, 1)), 0.5, 1.0)
        code, _, said = mics(tmp_path, case, "--check")
        assert code == wanted, said
        assert ("same height at both ends of a period" in said) == (wanted == 2)


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
    code, _, said = mics(tmp_path, case, "--quiet")
    assert code == 0
    assert all("was cut at its limit" in line for line in said.splitlines())  # a light raft
    assert series(tmp_path, "series/sleeping")[-1] == asleep


def test_what_check_warns_of(tmp_path: Path) -> None:
    case = """&run t_end = 1 /
    &grid cells = 8, 8, 8  length = 1, 1, 1 /
    &boundary x_min = 'inflow'  x_min_velocity = 0.2, 0, 0 /
    &water min = 0, 0, 0  max = 1, 1, 0.3 /
    &shape name = 'a'  kind = 'cube'  size = 0.2 /
    &drop shape = 'a'  position = 0.3, 0.5, 0.8  spread = 0.01, 0.01, 0 /
    &drop shape = 'a'  position = 0.7, 0.5, 0.8  spread = 0.01, 0.01, 0 /
    """
    code, told, said = mics(tmp_path, case, "--check")
    assert code == 0, said
    assert "x_min = 'inflow': only gas comes in without &fluid water_level" in told
    assert "&drop seed = 1: is that of another &drop too" in told
    other = case.replace("position = 0.7", "seed = 2  position = 0.7")
    code, told, _ = mics(tmp_path, other + "&fluid water_level = 0.3 /\n", "--check")
    assert code == 0 and "only gas comes in" not in told and "&drop seed" not in told


def test_contact_constants_that_cannot_be_stepped(tmp_path: Path) -> None:
    """A force like the overlap to the power 0.9 is endlessly stiff at the first touch."""
    case = """&run physics = 'dry'  t_end = 1 /
    &grid cells = 8, 8, 8  length = 1, 1, 1 /
    &contact law = 'constants'  gamma_n = 0.9 /
    """
    code, _, said = mics(tmp_path, case, "--check")
    assert code == 2
    assert "gamma_n = 0.9: must lie between 1 and 10" in said
