"""Places of units: attitudes, deviations and ellipses that are known exactly, files that open in
what people use; the layer of units against closed forms."""

import csv
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pytest

from calls import ROOT, mics_tools
from micstools.pages import run_page
from micstools.piles import layer
from micstools.reading import places, units
from micstools.reading.overlap import Placed
from micstools.reading.places import Survey
from micstools.reading.reader import Run
from micstools.shapes import height_maps
from micstools.shapes import shape as shapes
from micstools.shapes.geometry import Array, quaternion_from_axis, quaternion_product
from synthetic import UPRIGHT, Motion, change, with_bed, write_run
from test_pile_ensemble import cube_run, write_ensemble

EDGE, HALF = 0.02, 0.01
X, Y, Z = np.eye(3)
START = (0.15, 0.05, 0.16)  # of every drop of the synthetic run
SLOPED = quaternion_product(quaternion_from_axis(X, 25.0), quaternion_from_axis(Z, 40.0))
ENDS = [((0.03, 0.03, HALF), UPRIGHT), ((0.03, 0.03, 3 * HALF), UPRIGHT),
        ((0.25, 0.05, 0.08), SLOPED), ((0.15, 0.05, 0.15), UPRIGHT)]  # fmt: skip


def write(folder: Path, t_end: float = 5.0) -> Run:
    """Two stacked cubes, one in the air and a last one that is still to come at 3 s."""
    motion = Motion(shape=shapes.cube(EDGE), places=[(np.array(p), q) for p, q in ENDS],
                    t_end=t_end, history_step=0.05, field_step=100.0, cells=(6, 2, 4))  # fmt: skip
    write_run(folder, motion)
    with h5py.File(folder / "run.h5", "r+") as h5:
        names = ["", "", "", "A1", "A2", "B 1", "B2"]
        h5["bodies/name"] = np.array([name.encode().ljust(64) for name in names])
    return Run(folder)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return write(tmp_path_factory.mktemp("places") / "run")


@pytest.mark.parametrize(
    ("axis", "angle", "heading", "tilt"),
    [(Z, 0, 90, 0), (Z, 30, 60, 0), (Z, -90, 180, 0), (Z, 100, 350, 0), (X, 25, 90, 25),
     (Y, 130, 90, 130), (X + Y, 70, 90, 70)],
)  # fmt: skip
def test_heading_and_tilt_of_one_turn(axis, angle: float, heading: float, tilt: float) -> None:
    q = quaternion_from_axis(axis, angle)
    for sign in (1, -1):
        assert places.heading_and_tilt(sign * q) == pytest.approx((heading, tilt), abs=1e-9)
    assert places.heading_and_tilt(q, 20.0) == pytest.approx((heading - 20, tilt), abs=1e-9)


def test_a_tilt_leaves_the_heading() -> None:
    """About any horizontal axis, after the turn about the vertical."""
    for direction in np.radians(np.arange(0, 360, 45)):
        axis = np.array([math.cos(direction), math.sin(direction), 0.0])
        q = quaternion_product(quaternion_from_axis(axis, 65.0), quaternion_from_axis(Z, 40.0))
        assert places.heading_and_tilt(q) == pytest.approx((50.0, 65.0))


def test_a_survey_turns_and_moves() -> None:
    """North along +x: what lies ahead in x lies north, what lies ahead in y lies west."""
    survey = Survey((1000.0, 2000.0, -5.0), 90.0)
    found = survey.of(np.array([[3.0, 0, 1], [0, 4.0, 2]]))
    assert found == pytest.approx(np.array([[1000, 2003, -4], [996, 2000, -3]]))
    assert survey.of(np.array([3.0, 0.0])) == pytest.approx((1000, 2003))


def test_the_table_of_a_run(run: Run) -> None:
    found = places.places(run)
    assert [p.name for p in found] == ["", "", "", "A1", "A2", "B 1", "B2"]
    assert [p.fixed for p in found] == [1, 1, 1, 0, 0, 0, 0]
    low, high, hanging = found[3:6]
    assert (low.x, low.y, low.z) == pytest.approx((0.03, 0.03, HALF))
    assert (low.heading_deg, low.tilt_deg) == pytest.approx((90, 0))
    assert (hanging.heading_deg, hanging.tilt_deg) == pytest.approx((50, 25))
    assert low.deviation == pytest.approx(math.hypot(0.12, 0.02))
    assert hanging.deviation == pytest.approx(0.10)
    assert (low.plan_x, low.plan_y, low.plan_z) == pytest.approx(START)
    assert (low.neighbours, low.contacts, low.touching) == (1, 2, "5")  # and the floor
    assert (high.neighbours, high.contacts, high.touching) == (1, 1, "4")
    assert (hanging.neighbours, hanging.contacts) == (0, 0)
    assert [p.at_rest for p in found] == [1] * 7
    assert [p.time for p in found[3:]] == pytest.approx([0, 1, 2, 3])


def test_units_that_move_or_are_to_come(tmp_path: Path) -> None:
    found = places.places(write(tmp_path / "run", t_end=2.5))
    assert [p.at_rest for p in found] == [1, 1, 1, 1, 1, 0, 0]
    late = places.row_of(found[6])
    assert {late[k] for k in ("x", "y", "z", "deviation", "tilt_deg", "plan_x")} == {""}
    assert late["unit"] == 7 and late["name"] == "B2" and found[5].x == found[5].x


def test_a_bed_is_a_contact(tmp_path: Path) -> None:
    """Beside the floor and the other cube."""
    run = write(tmp_path / "run")
    run = with_bed(run.folder, lambda x, y: 0 * x)
    low, high, *_ = places.places(run)[3:]
    assert (low.contacts, low.neighbours, high.contacts) == (3, 1, 1)


def test_the_random_shift_is_no_plan(tmp_path: Path) -> None:
    """A block that `spread` moved by 4 mm lies that far from its plan, though it fell straight."""
    run = write(tmp_path / "run")
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/planned"] = h5["bodies/position"][0, :, :2]
        h5["bodies/position"][:, 6, 0] += 0.004
    found = places.places(Run(run.folder))
    assert found[6].deviation == pytest.approx(0.004)
    assert (found[6].plan_x, found[6].x) == pytest.approx((0.15, 0.154))


def test_a_level_that_is_found_at_the_release(tmp_path: Path) -> None:
    """Until then a block waits over the tank."""
    run = write(tmp_path / "run")
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/position"][: round(2.0 / 0.05) + 1, 5, 2] = 0.22  # until 2 s
        after = h5["bodies/position"][round(2.0 / 0.05) + 1, 5, 2]
    plan = places.planned(Run(run.folder))
    assert plan[5, 2] == after < 0.2 and plan[4, 2] == START[2]


def test_the_status_says_what_is_there(tmp_path: Path) -> None:
    """A fixed block that nobody touched is there, one that was left out is not, wherever it is."""
    run = write(tmp_path / "run")
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/status"] = np.array([2.0, 2, 2, 2, 2, 3, 1])
        h5["bodies/entry_time"] = h5["bodies/release_time"][:]
        h5["bodies/raised"] = np.zeros(7)
    found = places.places(Run(run.folder))
    assert [p.x == p.x for p in found] == [True] * 5 + [False] * 2
    assert [p.at_rest for p in found] == [1] * 5 + [0] * 2
    told = run_page.page(Run(run.folder))
    assert "one block is still to come" in told and "one block is left out or out of" in told
    change(run.folder, "bodies/status", data=np.array([2.0, 2, 2, 2, 2, 3, 2]))
    told = run_page.page(Run(run.folder))
    assert re.search(r"After [\d.]+ s three free blocks lie still, one block is left out", told)


def test_share_within_a_tolerance(run: Run) -> None:
    found = places.places(run)
    assert places.within(found, 0.11).count == 2 and places.within(found, 0.11).units == 4
    assert places.within(found, 0.11).share == 0.5
    assert places.within(found, 0.13).count == 4
    assert math.isnan(places.within(found[:3], 1.0).share)


def test_ellipse_of_four_points() -> None:
    """Covariance diag(8/3, 2/3), turned by 30 degrees from east to north."""
    turn = np.radians(30.0)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    points = np.array([(2.0, 0), (-2, 0), (0, 1), (0, -1)]) @ axes + (5.0, 7.0)
    middle, long, short, heading = places.ellipse(points)
    size = -2 * math.log(0.1)
    assert middle == pytest.approx((5, 7)) and heading == pytest.approx(60.0)
    assert (long, short) == pytest.approx((math.sqrt(size * 8 / 3), math.sqrt(size * 2 / 3)))
    line = places.ellipse_line(middle, long, short, heading) - middle
    assert line[0] == pytest.approx(long * axes[0])
    area = 0.5 * np.sum(line[:-1, 0] * line[1:, 1] - line[1:, 0] * line[:-1, 1])
    assert abs(area) == pytest.approx(np.pi * long * short, rel=2e-3)


def test_an_ellipse_holds_its_share_of_normal_landings() -> None:
    points = np.random.default_rng(3).normal(size=(40_000, 2)) @ np.array([[2.0, 1], [0, 0.5]])
    middle, long, short, heading = places.ellipse(points)
    turn = np.radians(heading)
    axis = np.array([np.sin(turn), np.cos(turn)])
    along = (points - middle) @ axis / long
    across = (points - middle) @ np.array([axis[1], -axis[0]]) / short
    assert np.mean(along**2 + across**2 <= 1) == pytest.approx(places.ELLIPSE, abs=0.005)
    assert math.isnan(places.ellipse(points[:1])[1])
    in_line = np.stack([points[:9, 0], 0.3 * points[:9, 0]], axis=1)
    assert places.ellipse(in_line)[2] == 0.0
    assert places.ellipse(points[[0, 0, 0]])[1:3] == (0.0, 0.0)


def test_files_open_in_what_people_use(run: Run, tmp_path: Path, capsys) -> None:
    pandas = pytest.importorskip("pandas")
    geopandas = pytest.importorskip("geopandas")
    ezdxf = pytest.importorskip("ezdxf")
    words = ["places", str(run.folder), "--to", "csv,geojson,dxf,asc", "--out", str(tmp_path),
             "--origin", "354200,5621080,-12.5", "--crs", "EPSG:25832"]  # fmt: skip
    assert mics_tools(words) == 0
    said = capsys.readouterr().out
    assert "4 free units, 4 of them at rest" in said and "per 100 cm2" in said
    table = pandas.read_csv(tmp_path / "places.csv")
    contract = ["unit", "name", "x", "y", "z", "heading_deg", "tilt_deg", "deviation", "at_rest",
                "neighbours", "contacts"]  # fmt: skip
    assert list(table.columns[: len(contract)]) == contract
    assert list(table.columns) == list(places.MEANING)
    a2 = table[table.name == "A2"].iloc[0]
    assert (a2.x, a2.y, a2.z) == pytest.approx((354200.03, 5621080.03, -12.47), abs=1e-9)
    assert a2.at_rest == 1 and a2.plan_x == pytest.approx(354200.15, abs=1e-6)

    shown = geopandas.read_file(tmp_path / "places.geojson")
    assert shown.crs.to_epsg() == 25832
    unit = shown[(shown.kind == "unit") & (shown.name == "A2")].iloc[0]
    here = unit.geometry.x, unit.geometry.y, unit.geometry.z
    assert here == pytest.approx((a2.x, a2.y, a2.z), abs=1e-6)
    plan = shown[(shown.kind == "plan") & (shown.name == "A2")].iloc[0].geometry
    assert plan.area == pytest.approx(EDGE**2, rel=1e-4)
    assert plan.centroid.coords[0] == pytest.approx((a2.x, a2.y), abs=1e-6)
    assert set(shown[shown.kind == "outline"].surface) == {"ball", "mean"}

    assert json.loads((tmp_path / "places.json").read_text())["survey"]["crs"] == "EPSG:25832"
    drawing = ezdxf.readfile(tmp_path / "places.dxf")
    assert drawing.header.custom_vars.get("CRS") == "urn:ogc:def:crs:EPSG::25832"
    assert drawing.units == ezdxf.units.M
    line = drawing.modelspace().query('LINE[layer=="DEVIATIONS"]')[1]
    ends = line.dxf.start.x, line.dxf.end.x
    assert ends == pytest.approx((354200.15, 354200.03), abs=1e-6)
    meshes = drawing.modelspace().query('MESH[layer=="UNITS"]')
    corners = np.array(meshes[4].vertices)
    assert corners.min(axis=0) == pytest.approx(np.array([a2.x, a2.y, a2.z]) - HALF, abs=1e-6)
    assert corners.max(axis=0) == pytest.approx(np.array([a2.x, a2.y, a2.z]) + HALF, abs=1e-6)
    names = [t.dxf.text for t in drawing.modelspace().query("TEXT")]
    assert names == ["1", "2", "3", "A1", "A2", "B 1", "B2"]
    assert drawing.audit().errors == []

    surface = height_maps.load(tmp_path / "places.asc")
    at = [np.abs(surface.first[d] + surface.spacing[d] * np.arange(surface.z.shape[1 - d])
                 - (a2.x, a2.y)[d]).argmin() for d in (0, 1)]  # fmt: skip
    assert surface.z[at[1], at[0]] == pytest.approx(-12.5 + 2 * EDGE, abs=1e-4)
    seen = height_maps.load(tmp_path / "places-mean.asc")
    assert seen.z.shape == surface.z.shape and (seen.z <= surface.z + 1e-6).all()
    assert seen.z[at[1], at[0]] == pytest.approx(-12.5 + 2 * EDGE, abs=1e-4)
    assert seen.z.min() == pytest.approx(-12.5) and (surface.z - seen.z).max() > 0.7 * EDGE
    about = json.loads((tmp_path / "places.json").read_text())
    assert about["within"]["tolerance"] == pytest.approx(EDGE / 2)
    assert about["layer"]["nominal_diameter"] == pytest.approx(EDGE)
    assert set(about["layer"]["definitions"]) >= {"packing", "thickness", "porosity"}


@pytest.mark.parametrize("to", ["csv", "geojson", "dxf", "asc"])
def test_the_system_of_a_survey_is_asked_for(to: str, tmp_path: Path, capsys) -> None:
    """Not of a tank, and not if it is given."""
    words = ["places", str(write(tmp_path / "run").folder), "--to", to, "--out", str(tmp_path)]
    far = ["--origin", "354200,5621080,-12.5"]
    for more, asked in (([], False), (far, True), ([*far, "--crs", "epsg:25832"], False)):
        assert mics_tools([*words, *more]) == 0
        told = capsys.readouterr().err
        assert ("of which system are coordinates like 354200, 5621080? --crs" in told) == asked


def test_a_name_is_no_formula(tmp_path: Path) -> None:
    """In any table that a spreadsheet opens."""
    run = write(tmp_path / "run")
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/name"][...] = b"=HYPERLINK(1)"
    assert mics_tools(["places", str(run.folder)]) == 0
    Run(run.folder).to_csv(tmp_path / "blocks.csv")
    for table in (run.folder / "places.csv", tmp_path / "blocks.csv"):
        with table.open() as file:
            assert {row["name"] for row in csv.DictReader(file)} == {"'=HYPERLINK(1)"}


def test_the_reef_lies_in_its_system() -> None:
    """In UTM zone 32, whose northings have seven digits."""
    rows = csv.DictReader((ROOT / "input/reef.csv").open(), skipinitialspace=True)
    assert all(5.5e6 < float(row["y"]) < 5.7e6 and 3e5 < float(row["x"]) < 4e5 for row in rows)


def test_an_ensemble_in_the_survey(tmp_path: Path, capsys) -> None:
    """One cube lands left in one run, right in four; in a sixth a second one waits."""
    geopandas = pytest.importorskip("geopandas")
    folder = write_ensemble(tmp_path / "ensemble")
    words = ["places", str(folder), "--to", "csv,geojson,dxf,asc", "--origin", "100,200,0"]
    assert mics_tools([*words, "--tolerance", "0.112"]) == 0
    rows = list(csv.DictReader((folder / "places.csv").open()))
    assert [r["run"] for r in rows if r["unit"] == "4"] == ["1", "2", "3", "4", "5", "6"]
    (landing, *_) = csv.DictReader((folder / "landings.csv").open())
    x = np.array([0.04, 0.26, 0.26, 0.26, 0.26, 0.26])
    assert float(landing["x"]) == pytest.approx(100 + x.mean())
    assert float(landing["ellipse_long"]) == pytest.approx(
        math.sqrt(-2 * math.log(0.1)) * x.std(ddof=1)
    )
    assert (landing["landings"], landing["within"]) == ("6", "6")
    shown = geopandas.read_file(folder / "places.geojson")
    line = shown[shown.kind == "landing"].iloc[0].geometry
    assert (line.x, line.y) == pytest.approx((100 + x.mean(), 200.05))
    assert sorted(set(shown[shown.kind == "cover"].probability)) == [0.1, 0.5, 0.9]
    cover = height_maps.load(folder / "places.asc")
    assert cover.first == pytest.approx((100.0005, 200.0005)) and cover.spacing[0] == 0.001
    here = [round((v - cover.first[d]) / cover.spacing[d]) for d, v in ((0, 100.04), (1, 200.05))]
    assert cover.z[here[1], here[0]] == pytest.approx(1 / 5, abs=1e-5)  # of complete piles
    about = json.loads((folder / "ensemble.json").read_text()) | {"start": ["loads"]}
    (folder / "ensemble.json").write_text(json.dumps(about))
    assert mics_tools([*words, "--crs", "EPSG:25832"]) == 0
    assert "no landings" in capsys.readouterr().out


RADIUS = EDGE / 4  # of a ball of the diameter D_n/2


def cubes(folder: Path, places: list[tuple[float, float, float]]) -> Run:
    """A run that ends with cubes at some places; the fixed blocks of the synthetic run are never
    let go."""
    write_run(folder / "run", cube_run(places))
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
    """The same pack on a bed is as thick; in steps down a slope of 1:2 less, as it is measured
    across it; a ball rests higher on slope and pack."""
    run = cubes(tmp_path, two_layers(0.01))
    run = with_bed(run.folder, lambda x, y: 0 * x + 0.01)
    maps, found = layer.of_run(run, layers=2, area=CELL)  # type: ignore[misc]
    assert found.mean.coefficient == pytest.approx(1.10, rel=0.02)
    assert found.ball.thickness == pytest.approx(ball_thickness(), rel=0.02)
    steps = cubes(tmp_path / "slope", [(x, y, z + 0.5 * x) for x, y, z in two_layers()])
    steps = with_bed(steps.folder, lambda x, y: 0.5 * x)
    found = layer.of_run(steps, layers=2, area=CELL)[1]  # type: ignore[index]
    assert found.mean.coefficient == pytest.approx(1.10 / np.sqrt(1.25), rel=0.02)
    assert found.area == pytest.approx(4 * PITCH**2 * np.sqrt(1.25))
    assert found.packing == pytest.approx(100 * found.units / found.area)
    slope = np.tile(0.5 * EDGE / 24 * np.arange(200), (60, 1))
    rise = layer.on_ball(slope, EDGE / 24, RADIUS) - slope
    assert rise[20:40, 20:180] == pytest.approx(RADIUS * (np.sqrt(1.25) - 1), rel=0.05)


def test_a_bare_slope_has_no_layer(tmp_path: Path) -> None:
    """The ball rests above a slope as above what lies on it."""
    run = cubes(tmp_path, [(0.15, 0.05, 0.15)])
    run = with_bed(run.folder, lambda x, y: 0.4 * x)
    maps, found = layer.of_run(run, area=((0.02, 0.02), (0.10, 0.08)))  # type: ignore[misc]
    assert found.ball.thickness == pytest.approx(0.0, abs=1e-12)
    assert found.mean.thickness == pytest.approx(0.0, abs=1e-12) and found.units == 0
    assert (maps.bed_ball - maps.bed)[10:20, 10:20].min() > 0.05 * RADIUS


def test_the_outline_of_a_flat_unit(tmp_path: Path) -> None:
    """A cube sunk into the bed but for a tenth: the ball leaves the bed where it stands higher than
    `THIN`."""
    out, high = 0.1 * EDGE, 0.03
    run = cubes(tmp_path, [(0.15, 0.05, high + out - EDGE / 2)])
    run = with_bed(run.folder, lambda x, y: 0 * x + high)
    found = layer.maps(run, EDGE, step=EDGE / 100)
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
