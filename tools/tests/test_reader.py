"""The reader against files as the program writes them, finished, growing, missing, damaged; tables
for pandas and xarray; units by the size of the blocks."""

import shutil
import threading
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest

from calls import mics_tools
from micstools.reading import result_file, units
from micstools.reading.profiles import along_line
from micstools.reading.reader import BadRun, Run
from micstools.serve import living
from synthetic import THREE_LEGS, Motion, change, write_run

TABLES = tomllib.loads(Path(__file__).with_name("reader.toml").read_text())


def test_bodies_and_series_share_their_rows(loose_pile: Run) -> None:
    b, s = loose_pile.bodies, loose_pile.series
    assert b.position.shape == (401, 9, 3)
    assert np.array_equal(b.time, s.time)
    assert b.shape == ["hexapod"] * 9
    assert b.fixed.tolist() == [True] * 3 + [False] * 6
    assert b.dropped.tolist() == [3, 4, 5, 6, 7, 8]
    assert b.quaternion[0, 0] == pytest.approx(THREE_LEGS)
    assert loose_pile.points(0, 0)[:, 2].min() == pytest.approx(0.0, abs=1e-6)  # in space


def test_shapes_grid_and_parameters(loose_pile: Run) -> None:
    assert loose_pile.shapes["hexapod"].volume == pytest.approx(56e-6)
    assert loose_pile.grid.spacing == pytest.approx([0.005] * 3)
    assert loose_pile.grid.high == pytest.approx([0.3, 0.1, 0.2])
    assert len(loose_pile.parameters["body"]) == 3
    assert loose_pile.value("fluid", "water_level") == 0.15
    assert loose_pile.value("fluid", "gravity") == [0, 0, -9.81], "not in the file: today's default"
    assert loose_pile.value("water", "min") is None
    with pytest.raises(KeyError):
        loose_pile.value("fluid", "no_such_name")
    assert loose_pile.sides["z_max"] == "open"
    assert loose_pile.sides["x_min"] == "no_slip"


def test_incomplete_rows_and_frames_are_left_out(loose_pile: Run, tmp_path: Path) -> None:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "growing")
    for name in ("position", "quaternion"):
        change(folder, f"bodies/{name}", data=getattr(loose_pile.bodies, name)[:-1])
    with h5py.File(folder / "fields.vtkhdf", "a") as h5:
        h5["VTKHDF/Steps"].attrs["NSteps"] = 3
    run = Run(folder)
    assert len(run.bodies.time) == len(run.bodies.position) == 400
    assert run.field_times.tolist() == [0.0, 0.5, 1.0]


def test_refresh_sees_what_was_written_since(tmp_path: Path) -> None:
    run = Run(write_run(tmp_path / "run", Motion(t_end=1.0)))
    assert run.bodies.time[-1] == pytest.approx(1.0)
    write_run(tmp_path / "run", Motion(t_end=2.0))
    assert run.bodies.time[-1] == pytest.approx(1.0)
    run.refresh()
    assert run.bodies.time[-1] == pytest.approx(2.0)


def test_a_writer_that_holds_the_file_does_not_stop_the_reader(loose_pile: Run) -> None:
    with h5py.File(loose_pile.folder / "run.h5", "a", locking=False):
        assert Run(loose_pile.folder).bodies.n == 9


def test_the_newest_restart_file_is_read(tmp_path: Path, loose_pile: Run) -> None:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "run")
    with pytest.raises(FileNotFoundError):
        Run(folder).restart()
    for name, value in (("b", 1.0), ("a", 2.0)):
        with h5py.File(folder / f"restart-{name}.h5", "w") as h5:
            h5["flow/liquid"] = np.full((2, 3), value)
    assert Run(folder).restart()["flow/liquid"].max() == 2.0


@pytest.fixture
def dry(tmp_path: Path, loose_pile: Run) -> Path:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "dry")
    (folder / "fields.vtkhdf").unlink()
    return folder


def test_a_run_without_fluid_has_no_fields(dry: Path) -> None:
    run = Run(dry)
    assert run.field_times.size == 0
    assert list(run.fields.data_vars) == [] and run.fields.sizes["time"] == 0
    with pytest.raises(ValueError, match="no fields"):
        run.fields_at(0.0)


def test_a_run_is_shown(loose_pile: Run) -> None:
    text = str(loose_pile)
    assert "60 x 20 x 40 cells, 0.3 x 0.1 x 0.2 m" in text
    assert "9, fixed: 1, 2, 3; shapes: hexapod" in text
    assert "rows    401" in text
    assert "liquid, solid, pressure, velocity" in text
    assert repr(loose_pile) == text
    shown = loose_pile._repr_html_()
    assert shown.startswith("<pre>") and "heading_deg" in shown
    assert np.char.count(shown, "<tr") >= loose_pile.bodies.n


def test_profile_is_exact_for_a_linear_field() -> None:
    x, y, z = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 2.0]), np.linspace(0.0, 1.0, 5)
    cx, cz = (x[1:] + x[:-1]) / 2, (z[1:] + z[:-1]) / 2
    values = np.broadcast_to(2 * cx + 3 * cz[:, None, None], (4, 1, 3))
    points = np.array([[0.6, 0.1, 0.2], [2.0, 1.0, 0.5], [3.4, 1.9, 0.8]])
    found = along_line((x, y, z), values, points)
    assert found == pytest.approx(2 * points[:, 0] + 3 * points[:, 2])
    both = along_line((x, y, z), np.stack([values, -values], axis=-1), points)
    assert both == pytest.approx(np.stack([found, -found], axis=-1))


def test_profile_reads_a_line_and_refuses_others(loose_pile: Run) -> None:
    distance, velocity = loose_pile.profile((0, 0.05, 0.1), (0.3, 0.05, 0.1), "velocity", 2.0, 7)
    assert distance == pytest.approx(np.linspace(0, 0.3, 7))
    assert velocity.shape == (7, 3)
    with pytest.raises(ValueError, match="no such field"):
        loose_pile.profile((0, 0, 0), (0.1, 0, 0), "speed", 2.0)
    with pytest.raises(ValueError, match="leaves the tank"):
        loose_pile.profile((0, 0, 0), (9, 0, 0), "liquid", 2.0)


def test_the_scene_of_a_time(loose_pile: Run, tmp_path: Path) -> None:
    """Blocks and water belong together: all are of the written time nearest to the wish."""
    scene = loose_pile.vtk(2.2)  # fields every 0.5 s
    assert scene.keys() == [f"block {k}" for k in range(1, 7)] + ["water"]
    assert scene.field_data["time"] == pytest.approx([2.0])
    row = loose_pile.bodies.row(2.0)
    for k in range(6):
        block = scene[f"block {k + 1}"]
        assert block.points == pytest.approx(loose_pile.points(k, row))
        assert set(block.cell_data["body"]) == {k + 1}
        assert block.volume == pytest.approx(56e-6, rel=1e-5)
    water = scene["water"].points
    assert water[:, 2].mean() == pytest.approx(0.15 + 0.0112 / 3, abs=0.004)
    assert water[:, :2].max(axis=0) == pytest.approx([0.3, 0.1])
    scene.save(tmp_path / "scene.vtm")
    for t in (-0.1, 8.1, float("nan")):
        with pytest.raises(ValueError, match=rf"t = {t:g} s: the run goes from 0 to 8 s"):
            loose_pile.vtk(t)


def test_the_scene_without_water_is_that_of_the_nearest_row(dry: Path) -> None:
    change(dry, "bed/points", data=np.eye(3))
    change(dry, "bed/triangles", data=[[0, 1, 2]])
    scene = Run(dry).vtk(2.205)
    assert scene.keys() == [f"block {k}" for k in range(1, 7)] + ["bed"]
    assert scene.field_data["time"] == pytest.approx([2.2])
    assert scene["bed"].n_cells == 1


DAMAGES: dict[str, list[dict[str, Any]]] = TABLES["damages"]
DAMAGES["a shape of no name"] = [{"at": "bodies/shape", "data": [b"\xff\xfe"] * 9}]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("whole") / "run", Motion(t_end=0.2))


@pytest.fixture
def broken(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy, and no patience with it."""
    monkeypatch.setattr(result_file.take, "__defaults__", ((),))
    return shutil.copytree(whole, tmp_path / "run")


def look(run: Run) -> None:
    """All that is read of a run."""
    str(run), run.shapes, run.bed, run.series, run.timers, run.sides, run.gravity  # noqa: B018
    living.state(run)


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_damaged_file_is_one_line(broken: Path, kind: str, capsys) -> None:
    for step in DAMAGES[kind]:
        change(broken, **step)
    with pytest.raises(BadRun, match=r"run\.h5: .*") as told:
        look(Run(broken))
    assert "\n" not in str(told.value)
    assert mics_tools(["report", str(broken)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mics-tools report: {broken}/run.h5: ")


def test_damage_keeps_no_other_thread_from_reading(broken: Path, loose_pile: Run) -> None:
    """A studio hung on a damaged shape, as long as its exception was kept."""
    change(broken, "shapes/hexapod/points")
    with pytest.raises(BadRun) as kept:
        Run(broken).shapes  # noqa: B018
    other = threading.Thread(target=lambda: Run(loose_pile.folder).bodies, daemon=True)
    other.start()
    other.join(20.0)
    assert not other.is_alive(), kept


@pytest.mark.parametrize("name", ["position", "quaternion", "velocity", "contact_force"])
def test_a_report_of_no_numbers_is_one_line(broken: Path, name: str, capsys) -> None:
    with h5py.File(broken / "run.h5", "r+") as h5:
        h5[f"bodies/{name}"][2, 3] = np.nan
    assert mics_tools(["report", str(broken)]) == 2
    assert f"run.h5: bodies/{name} holds what is no number" in capsys.readouterr().err


def test_fields_of_other_cells_are_one_line(broken: Path) -> None:
    change(broken, "grid/z", line=[0, 0.2, 21])
    with pytest.raises(BadRun, match=r"fields\.vtkhdf: .*its cells are not those of run\.h5"):
        Run(broken).field_times  # noqa: B018


def test_a_column_without_rows_is_one_line(broken: Path, capsys) -> None:
    change(broken, "series/wall_time", data=np.empty(0))
    assert mics_tools(["report", str(broken)]) == 2
    assert capsys.readouterr().err.endswith("run holds no row of results yet\n")


def test_rows_as_tables(loose_pile: Run, tmp_path: Path) -> None:
    """Of all blocks and of the numbers of the run; as files they are the same."""
    b, found = loose_pile.bodies, loose_pile.blocks
    assert len(found) == b.n * len(b.time)
    row = found[(found.block == 4) & (found.time == b.time[5])].iloc[0]
    for names, values in (
        (["x", "y", "z"], b.position),
        (["qw", "qx", "qy", "qz"], b.quaternion),
        (["vx", "vy", "vz"], b.velocity),
        (["wx", "wy", "wz"], b.angular_velocity),
        (["fluid_fx", "fluid_fy", "fluid_fz"], b.fluid_force),
        (["contact_tx", "contact_ty", "contact_tz"], b.contact_torque),
    ):
        assert row[names].tolist() == values[5, 3].tolist()
    assert (row["shape"], row["released"]) == (b.shape[3], int(b.present(5)[3]))
    written = pd.read_csv(loose_pile.to_csv(tmp_path / "blocks.csv"), keep_default_na=False)
    pd.testing.assert_frame_equal(written, found, check_dtype=False, rtol=1e-15, atol=0)
    series = pd.read_csv(loose_pile.series_to_csv(tmp_path / "series.csv"))
    assert series.time.tolist() == loose_pile.series.time.tolist()
    last = found.groupby("block").last()
    assert last.z.to_numpy() == pytest.approx(b.position[-1, :, 2])
    units = found.attrs["units"]
    assert (units["x"], units["vx"], units["fluid_tz"]) == ("m", "m/s", "N m")


def test_places_as_a_table(loose_pile: Run) -> None:
    found = loose_pile.places
    assert list(found.columns) == list(found.attrs["meaning"])
    assert found.z.to_numpy() == pytest.approx(loose_pile.bodies.position[-1, :, 2])


def test_fields_have_named_axes_and_units(loose_pile: Run) -> None:
    found, cells = loose_pile.fields, loose_pile.grid.centres
    assert found.liquid.dims == ("time", "z", "y", "x")
    assert found.velocity.dims == ("time", "z", "y", "x", "component")
    assert (found.pressure.attrs["units"], found.x.attrs["units"]) == ("Pa", "m")
    assert found.x.to_numpy() == pytest.approx(cells[0])
    one = loose_pile.fields_at(2.2)
    assert one.time == 2.0  # of the nearest frame
    assert one.liquid.shape == (40, 20, 60) and one.velocity.shape == (40, 20, 60, 3)
    assert one.liquid[0].min() == 1.0 and one.liquid[-1].max() == 0.0
    then = found.sel(time=2.0)
    assert (then.liquid.to_numpy() == one.liquid).all()
    assert (then.velocity.sel(component="z").to_numpy() == one.velocity[..., 2]).all()
    level = float(then.liquid.sel(x=0.1, y=0.05, method="nearest").sum("z")) * 0.005
    assert level == pytest.approx(one.liquid[:, 10, 20].sum() * 0.005, rel=0.05)


def test_fields_are_read_when_wanted(loose_pile: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mean over one time reads that time alone."""
    run = Run(loose_pile.folder)
    found, asked, frame = run.fields, [], run.frame
    assert "dask" in type(found.liquid.data).__module__
    monkeypatch.setattr(run, "frame", lambda *words: asked.append(words) or frame(*words))
    wanted = float(run.fields_at(run.field_times[3]).solid.mean())
    assert float(found.solid.isel(time=3).mean()) == pytest.approx(wanted, rel=1e-5)
    assert asked == [("solid", 3)]
    assert found.solid.mean(("x", "y", "z")).to_numpy().shape == run.field_times.shape


@pytest.mark.parametrize(("words", "value"), TABLES["figures"].items())
def test_figures_have_three_digits(words: str, value: float) -> None:
    assert units.figure(value) == words


@pytest.mark.parametrize("kind", TABLES["units"])
def test_units_grow_with_the_blocks(kind: str) -> None:
    """With a blank that does not break; in plain letters for a terminal."""
    for size, (value, told) in zip((0.06, 2.0), TABLES["units"][kind], strict=True):
        unit = units.of_size(size).of_kind(kind)
        assert unit.text(value) == told.replace(" ", "\u00a0")
        assert unit.plain(value) == told.replace("²", "2").replace("³", "3")
    assert units.of_size(2.0).area.plain(float("nan")) == "-"


def test_arrays_and_several_figures() -> None:
    site = units.of_size(2.0)
    assert site.force.of(np.array([1e3, 2e3])) == pytest.approx([1.0, 2.0])
    assert site.length.row([26.0, 6.0, 12.8], " x ") == "26 x 6 x 12.8\u00a0m"


def test_the_largest_free_block_decides_or_the_tank() -> None:
    known = (([0.05, 2], 2, 1, "m"), ([0.05, 2], 1, 1, "mm"), ([], 0, 1, "mm"), ([], 0, 100, "m"))
    for lengths, free, tank, unit in known:
        shapes = {str(k): SimpleNamespace(length=v) for k, v in enumerate(lengths)}
        fixed = [k >= free for k in range(9)]
        bodies = SimpleNamespace(n=len(shapes), shape=list(shapes), fixed=fixed)
        grid = SimpleNamespace(low=np.zeros(3), high=np.array([tank, 0.1, 0.1]))
        run: Any = SimpleNamespace(bodies=bodies, shapes=shapes, grid=grid)
        assert units.of_run(run).length.name == unit
