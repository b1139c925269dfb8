"""Places of units: attitudes, deviations and ellipses that are known exactly; files open in what
people use."""

import csv
import json
import math
from pathlib import Path

import h5py
import numpy as np
import pytest

from calls import mics_tools
from micstools.piles import handover
from micstools.reading import places
from micstools.reading.places import Survey
from micstools.reading.reader import Run
from micstools.shapes import height_maps
from micstools.shapes import shape as shapes
from micstools.shapes.geometry import quaternion_from_axis, quaternion_product
from synthetic import UPRIGHT, Motion, write_run
from test_pile_ensemble import write_ensemble

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
    corners = np.array([(x, y, 0.0) for x in (0.0, 0.3) for y in (0.0, 0.1)])
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bed/points"], h5["bed/triangles"] = corners, np.array([(0, 2, 1), (1, 2, 3)])
    low, high, *_ = places.places(Run(run.folder))[3:]
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
    assert a2.at_rest == 1 and a2.plan_x == pytest.approx(354200.15)

    shown = geopandas.read_file(tmp_path / "places.geojson")
    assert shown.crs.to_epsg() == 25832
    unit = shown[(shown.kind == "unit") & (shown.name == "A2")].iloc[0]
    assert (unit.geometry.x, unit.geometry.y, unit.geometry.z) == pytest.approx((a2.x, a2.y, a2.z))
    plan = shown[(shown.kind == "plan") & (shown.name == "A2")].iloc[0].geometry
    assert plan.area == pytest.approx(EDGE**2, rel=1e-4)
    assert plan.centroid.coords[0] == pytest.approx((a2.x, a2.y), abs=1e-6)
    assert set(shown[shown.kind == "outline"].surface) == {"ball", "mean"}

    drawing = ezdxf.readfile(tmp_path / "places.dxf")
    assert drawing.units == ezdxf.units.M
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
    assert cover.z[here[1], here[0]] == pytest.approx(1 / 6, abs=1e-5)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "csv,shp"], "'shp' is none of csv, geojson, dxf, asc"),
        (["--origin", "1,2"], "--origin 1,2: must be E,N,LEVEL"),
        (["--crs", "UTM 32"], "must be as EPSG:25832"),
        (["--tolerance", "0"], "--tolerance 0.0: must be positive"),
        (["--layers", "0"], "--layers 0: must be 1 or more"),
        (["--north", "400"], "--north 400.0: must be degrees"),
        (["--to", "asc", "--north", "10"], "a raster has its rows along east"),
        (["--area", "0", "0", "1", "0.1"], "the tank reaches from [0.0, 0.0] to [0.3, 0.1] m"),
        (["--area", "0.2", "0", "0.1", "0.1"], "the first corner must be the lower one"),
    ],
)
def test_wrong_words_are_told(run: Run, words: list[str], said: str, tmp_path, capsys) -> None:
    assert mics_tools(["places", str(run.folder), *words, "--out", str(tmp_path / "new")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_hull_and_a_row() -> None:
    assert handover.crs_name("epsg:25832") == "urn:ogc:def:crs:EPSG::25832"
