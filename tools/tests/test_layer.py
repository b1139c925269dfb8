"""The layer of units against closed forms: a ball on one cube, two layers of cubes."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools.piles import layer
from micstools.reading import units
from micstools.reading.overlap import Placed
from micstools.reading.reader import Run
from micstools.shapes import shape as shapes
from micstools.shapes.geometry import Array
from synthetic import UPRIGHT, Motion, write_run

EDGE = 0.02
RADIUS = EDGE / 4  # of a ball of the diameter D_n/2


def cubes(folder: Path, places: list[tuple[float, float, float]], edge: float = EDGE) -> Run:
    """A run that ends with cubes at some places; the fixed blocks of the synthetic run are never
    let go."""
    motion = Motion(
        shape=shapes.cube(edge),
        places=[(np.array(place), UPRIGHT) for place in places],
        t_end=len(places) + 1.0,
        history_step=0.5,
        field_step=100.0,
        cells=(6, 2, 4),
    )
    write_run(folder / "run", motion)
    with h5py.File(folder / "run" / "run.h5", "r+") as h5:
        h5["bodies/release_time"][:3] = 1e9
    return Run(folder / "run")


def on_edge(away: Array, height: float) -> Array:
    """Lowest point of the ball at a distance from an upright edge of a height; 0 on the floor."""
    rest = RADIUS**2 - np.minimum(away, RADIUS) ** 2
    return np.where(away < RADIUS, height - RADIUS + np.sqrt(rest), 0.0)


def test_a_ball_over_one_cube(tmp_path: Path) -> None:
    """Along x, the volume below it, and its outline; first order in the squares."""
    run = cubes(tmp_path, [(0.15, 0.05, EDGE / 2)])
    off = []
    for fine in (60, 120):
        step = EDGE / fine
        found = layer.maps(run, EDGE, step=step)
        x = found.low[0] + (np.arange(found.ball.shape[1]) + 0.5) * step
        away = np.maximum(np.abs(x - 0.15) - EDGE / 2, 0.0)
        row = found.ball[found.ball.shape[0] // 2]
        sloping = np.abs(away - RADIUS) > 1.5 * step
        # An edge lies half a square off at most, where the ball is steep.
        wanted = on_edge(away, EDGE)
        nearer, farther = (on_edge(np.maximum(away + d, 0), EDGE) for d in (-step, step))
        assert (row[sloping] >= farther[sloping] - 1e-12).all()
        assert (row[sloping] <= nearer[sloping] + 1e-12).all()
        assert row[away == 0] == pytest.approx(EDGE) and row[away > RADIUS + step] == pytest.approx(
            0
        )
        steep, r, a = EDGE - RADIUS, RADIUS, EDGE
        volume = a**3 + 4 * a * (steep * r + np.pi * r**2 / 4) + np.pi * r**2 * steep
        volume += 2 * np.pi * r**3 / 3
        plan = a**2 + 4 * a * r + np.pi * r**2
        assert wanted.max() == EDGE
        off.append(
            [found.ball.sum() * step**2 / volume - 1, found.raised.sum() * step**2 / plan - 1]
        )
        assert found.covered.sum() * step**2 == pytest.approx(a**2, rel=2.1 / fine)
    assert np.abs(off[0]).max() < 0.03
    assert np.abs(off[1]).max() < 0.6 * np.abs(off[0]).max()


PITCH = np.sqrt(2 / (2 * 1.10 * (1 - 0.47))) * EDGE  # two layers of k_t = 1.10 and n_v = .47
TOP = 2 * 1.10 * EDGE * (PITCH / EDGE) ** 2


def two_layers(shift: float = 0.0) -> list[tuple[float, float, float]]:
    """Three by three cubes in two layers, above a gap that gives the coefficient."""
    x, y = 0.15 - PITCH, 0.05 - PITCH
    columns = [(x + PITCH * i, y + PITCH * j) for i, j in product(range(3), repeat=2)]
    return [(*at, z + shift) for z in (EDGE / 2, TOP - EDGE / 2) for at in columns]


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return cubes(tmp_path_factory.mktemp("pack"), two_layers())


CELL = ((0.15 - PITCH, 0.05 - PITCH), (0.15 + PITCH, 0.05 + PITCH))  # four cells of the pattern


def ball_thickness() -> float:
    """Mean over a cell of the pattern of the surface of a ball that no gap lets through."""
    n, half = 400, (PITCH - EDGE) / 2
    assert half * np.sqrt(2) < RADIUS
    at = (np.arange(n) + 0.5) * half / n
    strip = float(on_edge(at, TOP).mean())
    cross = float(on_edge(np.hypot(*np.meshgrid(at, at)), TOP).mean())
    gap = PITCH - EDGE
    return (EDGE**2 * TOP + 2 * EDGE * gap * strip + gap**2 * cross) / PITCH**2


def test_two_layers_of_cubes(pack: Run) -> None:
    """Of known k_t and n_v on average; by the ball of those that its surface gives."""
    maps, found = layer.of_run(pack, area=CELL)  # type: ignore[misc]
    assert found.nominal_diameter == pytest.approx(EDGE)
    assert found.units == pytest.approx(8) and found.area == pytest.approx(4 * PITCH**2)
    assert found.packing == pytest.approx(200 / PITCH**2)
    assert found.packing_density == pytest.approx(2 * 1.10 * 0.53)  # 1.17 of the literature
    rough = dict(rel=0.02)  # squares on the edges, at D_n/24
    assert found.layers == round(ball_thickness() / EDGE)
    two = layer.layer(pack, maps, EDGE, layers=2, area=CELL)
    assert two.mean.coefficient == pytest.approx(1.10, **rough)
    assert two.mean.porosity == pytest.approx(0.47, **rough)
    assert two.ball.thickness == pytest.approx(ball_thickness(), **rough)
    assert two.ball.porosity == pytest.approx(1 - 8 * EDGE**3 / (4 * PITCH**2 * ball_thickness()),
                                              **rough)  # fmt: skip
    for one in (two.mean, two.ball):
        assert 2 * one.coefficient * (1 - one.porosity) == pytest.approx(two.packing_density)


def test_squares_as_fine_as_wanted(pack: Run) -> None:
    """The error falls with the squares."""
    off = []
    for fine in (20, 80):
        maps = layer.maps(pack, EDGE, step=EDGE / fine, area=CELL)
        found = layer.layer(pack, maps, EDGE, layers=2, area=CELL)
        off.append(abs(found.mean.coefficient - 1.10) + abs(found.ball.thickness / EDGE
                                                            - ball_thickness() / EDGE))  # fmt: skip
    assert off[1] < 0.5 * off[0] and off[1] < 0.02


def test_a_bed_is_measured_by_the_ball_too(tmp_path: Path) -> None:
    """The same pack on a slope of 1:2 is as thick; a ball rests higher on both."""
    run = cubes(tmp_path, two_layers(0.01))
    corners = np.array([(x, y, 0.01) for x in (0.0, 0.3) for y in (0.0, 0.1)])
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bed/points"], h5["bed/triangles"] = corners, np.array([(0, 2, 1), (1, 2, 3)])
    maps, found = layer.of_run(Run(run.folder), layers=2, area=CELL)  # type: ignore[misc]
    assert found.mean.coefficient == pytest.approx(1.10, rel=0.02)
    assert found.ball.thickness == pytest.approx(ball_thickness(), rel=0.02)
    slope = np.tile(0.5 * EDGE / 24 * np.arange(200), (60, 1))
    rise = layer.on_ball(slope, EDGE / 24, RADIUS) - slope
    assert rise[20:40, 20:180] == pytest.approx(RADIUS * (np.sqrt(1.25) - 1), rel=0.05)


def test_a_bare_slope_has_no_layer(tmp_path: Path) -> None:
    """The ball rests above a slope as above what lies on it."""
    run = cubes(tmp_path, [(0.15, 0.05, 0.15)])
    corners = np.array([(x, y, 0.4 * x) for x in (0.0, 0.3) for y in (0.0, 0.1)])
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bed/points"], h5["bed/triangles"] = corners, np.array([(0, 2, 1), (1, 2, 3)])
    maps, found = layer.of_run(Run(run.folder), area=((0.02, 0.02), (0.10, 0.08)))  # type: ignore[misc]
    assert found.ball.thickness == pytest.approx(0.0, abs=1e-12)
    assert found.mean.thickness == pytest.approx(0.0, abs=1e-12) and found.units == 0
    assert (maps.bed_ball - maps.bed)[10:20, 10:20].min() > 0.05 * RADIUS


def test_the_outline_of_a_flat_unit(tmp_path: Path) -> None:
    """A cube sunk into the bed but for a tenth: the ball leaves the bed where it stands higher than
    `THIN`."""
    out, high = 0.1 * EDGE, 0.03
    run = cubes(tmp_path, [(0.15, 0.05, high + out - EDGE / 2)])
    corners = np.array([(x, y, high) for x in (0.0, 0.3) for y in (0.0, 0.1)])
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bed/points"], h5["bed/triangles"] = corners, np.array([(0, 2, 1), (1, 2, 3)])
    found = layer.maps(Run(run.folder), EDGE, step=EDGE / 100)
    width = np.sqrt(RADIUS**2 - (RADIUS - out + layer.THIN * EDGE) ** 2)
    plan = EDGE**2 + 4 * EDGE * width + np.pi * width**2
    assert found.raised.sum() * found.step**2 == pytest.approx(plan, rel=0.03)


def test_without_an_area_the_outline_counts(tmp_path: Path) -> None:
    run = cubes(tmp_path, [(0.15, 0.05, EDGE / 2)])
    maps, found = layer.of_run(run)  # type: ignore[misc]
    assert found.units == 1 and found.layers == 1
    assert found.area == pytest.approx(found.packing and 100 / found.packing)
    assert found.area == pytest.approx(maps.raised.sum() * maps.step**2)
    lines = maps.outlines()
    (ball,), (mean,) = lines["ball"], lines["mean"]
    assert np.ptp(mean, axis=0) == pytest.approx([EDGE, EDGE], abs=2 * maps.step)
    assert np.ptp(ball, axis=0) == pytest.approx([1.5 * EDGE] * 2, abs=2.1 * maps.step)
    said = " ".join(layer.words(found, units.of_run(run)))
    assert "1 units of D_n = 20\u00a0mm" in said and "by the ball" in said


def test_no_unit_no_layer(tmp_path: Path) -> None:
    run = cubes(tmp_path, [(0.15, 0.05, EDGE / 2)])
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/release_time"][:] = 1e9
    assert layer.of_run(Run(run.folder)) is None


@pytest.fixture
def unit() -> Callable[[float, float], Placed]:
    return lambda edge, density: Placed(
        replace(shapes.cube(edge), density=density), np.zeros(3), UPRIGHT
    )


def test_the_middle_unit_by_mass(unit: Callable[[float, float], Placed]) -> None:
    """Nine light ones and one of as much mass as twenty: half of the mass lies in that one."""
    small, large = unit(1.0, 1000.0), unit(2.0, 2500.0)
    assert layer.nominal_diameter([small] * 9 + [large]) == pytest.approx(2.0)
    assert layer.nominal_diameter([small] * 21 + [large]) == pytest.approx(1.0)
    assert layer.nominal_diameter([small]) == pytest.approx(1.0)
