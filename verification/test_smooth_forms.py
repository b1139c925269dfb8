"""Smooth forms that are cut finely touch as any other: stones on a floor, a beam on a crest; and
who may sleep."""

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
