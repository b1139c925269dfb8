"""The reader against files as the program writes them, finished, growing, missing, damaged; tables
for pandas and xarray; units by the size of the blocks."""

import shutil
import threading
from collections.abc import Callable
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
from synthetic import THREE_LEGS, Motion, write_run


def test_bodies_and_series_share_their_rows(loose_pile: Run) -> None:
    b, s = loose_pile.bodies, loose_pile.series
    assert b.position.shape == (401, 9, 3)
    assert np.array_equal(b.time, s.time)
    assert b.shape == ["hexapod"] * 9
    assert b.fixed.tolist() == [True] * 3 + [False] * 6
    assert b.dropped.tolist() == [3, 4, 5, 6, 7, 8]
    assert b.quaternion[0, 0] == pytest.approx(THREE_LEGS)


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


def test_fields_are_those_of_the_nearest_frame(loose_pile: Run) -> None:
    fields = loose_pile.fields_at(2.2)
    assert fields.time == 2.0
    assert fields.liquid.shape == (40, 20, 60)
    assert fields.velocity.shape == (40, 20, 60, 3)
    assert fields.liquid[0].min() == 1.0
    assert fields.liquid[-1].max() == 0.0


def test_points_of_a_body_are_in_space(loose_pile: Run) -> None:
    assert loose_pile.points(0, 0)[:, 2].min() == pytest.approx(0.0, abs=1e-6)


def test_incomplete_rows_and_frames_are_left_out(loose_pile: Run, tmp_path: Path) -> None:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "growing")
    with h5py.File(folder / "run.h5", "a") as h5:
        for name in ("position", "quaternion"):
            values = h5[f"bodies/{name}"][:-1]
            del h5[f"bodies/{name}"]
            h5[f"bodies/{name}"] = values
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


def test_a_folder_without_results_says_so(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"no run\.h5"):
        Run(tmp_path)


def test_a_run_without_fluid_has_no_fields(tmp_path: Path, loose_pile: Run) -> None:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "dry")
    (folder / "fields.vtkhdf").unlink()
    run = Run(folder)
    assert run.field_times.size == 0
    with pytest.raises(ValueError, match="no fields"):
        run.fields_at(0.0)


def test_print_tells_what_is_there(loose_pile: Run) -> None:
    text = str(loose_pile)
    assert "60 x 20 x 40 cells, 0.3 x 0.1 x 0.2 m" in text
    assert "9, fixed: 1, 2, 3; shapes: hexapod" in text
    assert "rows    401" in text
    assert "liquid, solid, pressure, velocity" in text


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


def test_the_scene_without_water_is_that_of_the_nearest_row(
    loose_pile: Run, tmp_path: Path
) -> None:
    folder = shutil.copytree(loose_pile.folder, tmp_path / "dry")
    (folder / "fields.vtkhdf").unlink()
    with h5py.File(folder / "run.h5", "a") as h5:
        h5["bed/points"] = np.eye(3)
        h5["bed/triangles"] = [[0, 1, 2]]
    scene = Run(folder).vtk(2.205)
    assert scene.keys() == [f"block {k}" for k in range(1, 7)] + ["bed"]
    assert scene.field_data["time"] == pytest.approx([2.2])
    assert scene["bed"].n_cells == 1


@pytest.mark.parametrize("t", [-0.1, 8.1, float("nan")])
def test_a_scene_outside_of_the_run_is_refused(loose_pile: Run, t: float) -> None:
    with pytest.raises(ValueError, match=rf"t = {t:g} s: the run goes from 0 to 8 s"):
        loose_pile.vtk(t)


Damage = Callable[[h5py.File], None]


def put(name: str, values: object, **how: object) -> Damage:
    """Other values in the place of a dataset."""

    def damage(h5: h5py.File) -> None:
        if name in h5:
            del h5[name]
        if how:
            h5.create_dataset(name, **how)
        elif not isinstance(values, (h5py.SoftLink, h5py.ExternalLink)):
            h5.create_dataset(name, data=values)
        else:
            h5[name] = values

    return damage


def drop(name: str) -> Damage:
    def damage(h5: h5py.File) -> None:
        del h5[name]

    return damage


def say(name: str, value: object) -> Damage:
    def damage(h5: h5py.File) -> None:
        h5["provenance"].attrs[name] = value

    return damage


def elsewhere(h5: h5py.File) -> None:
    del h5["bodies/mass"]
    layout = h5py.VirtualLayout(shape=(9,), dtype=float)
    layout[:] = h5py.VirtualSource("other.h5", "mass", shape=(9,))
    h5.create_virtual_dataset("bodies/mass", layout)


KINDS: dict[str, Damage] = {
    "no bodies": drop("bodies"),
    "no series": drop("series"),
    "no grid": drop("grid"),
    "no provenance": drop("provenance"),
    "no shapes": drop("shapes"),
    "a column is missing": drop("bodies/velocity"),
    "a group for a dataset": lambda h5: (drop("bodies/mass")(h5), h5.create_group("bodies/mass")),
    "a dataset for a group": put("series", [1.0]),
    "texts for numbers": put("bodies/mass", ["a"] * 9),
    "another number of bodies": put("bodies/mass", np.ones(4)),
    "vectors of two": put("bodies/position", np.zeros((11, 9, 2))),
    "a single number": put("series/time", 1.0),
    "times that fall": put("series/time", np.arange(11.0)[::-1]),
    "a time that is none": put("bodies/time", np.full(11, np.nan)),
    "a time beyond all": put("bodies/time", np.linspace(0, 1e300, 11)),
    "no cells": put("grid/x", [0.0]),
    "a cell that reaches far": put("grid/z", [*np.linspace(0, 0.2, 41)[:-1], 1e15]),
    "cells like threads": put("grid/x", np.linspace(0, 1e12, 61)),
    "cells of nothing": lambda h5: [put(f"grid/{d}", [0.0, 1e-30])(h5) for d in "xyz"],
    "a corner far away": put("shapes/hexapod/points", np.full((135, 3), 1e15)),
    "a triangle of one corner": put("shapes/hexapod/triangles", np.zeros((9, 3), int)),
    "corners in one place": put("shapes/hexapod/points", np.full((135, 3), 1e-3)),
    "a block of dust": put("shapes/hexapod/sphere_radius", np.full(192, 1e9)),
    "no volume": lambda h5: h5["shapes/hexapod"].attrs.modify("volume", -1e15),
    "a density beyond all": lambda h5: h5["shapes/hexapod"].attrs.modify("density", 1e30),
    "masses below nothing": put("bodies/mass", np.full(9, -1.0)),
    "a block far away": put("bodies/position", np.full((11, 9, 3), 1e15)),
    "a provenance of nothing": lambda h5: (drop("provenance")(h5), h5.create_group("provenance")),
    "a corner without a place": put("shapes/hexapod/points", np.full((8, 3), np.nan)),
    "a corner that is not there": put("shapes/hexapod/triangles", [[0, 1, 10**6]]),
    "a shape of no name": put("bodies/shape", [b"\xff\xfe"] * 9),
    "a status in words": say("exit_status", "well"),
    "words for a number": say("parameters", "&run t_end = 'soon' /"),
    "no namelist": say("parameters", "&run t_end = ((("),
    "a huge repeat": say("parameters", "&run t_end = 999999999*0.1 /"),
    "more than it holds": put("bodies/mass", None, shape=(10**12,), dtype=float, chunks=(10**6,)),
    "data in another file": put("bodies/mass", None, shape=(9,), dtype=float,
                                external=[("/etc/passwd", 0, 72)]),
    "virtual data": elsewhere,
    "a link outside": put("bodies", h5py.ExternalLink("/etc/passwd", "/bodies")),
    "a link inside": put("bodies/mass", h5py.SoftLink("/bodies/time")),
}  # fmt: skip


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


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_one_line(broken: Path, kind: str, capsys) -> None:
    with h5py.File(broken / "run.h5", "r+") as h5:
        KINDS[kind](h5)
    with pytest.raises(BadRun, match=r"run\.h5: .*") as told:
        look(Run(broken))
    assert "\n" not in str(told.value)
    assert mics_tools(["report", str(broken)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mics-tools report: {broken}/run.h5: ")


def test_damage_keeps_no_other_thread_from_reading(broken: Path, loose_pile: Run) -> None:
    """A studio hung on a damaged shape, as long as its exception was kept."""
    with h5py.File(broken / "run.h5", "r+") as h5:
        drop("shapes/hexapod/points")(h5)
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
    with h5py.File(broken / "run.h5", "r+") as h5:
        put("grid/z", np.linspace(0, 0.2, 21))(h5)
    with pytest.raises(BadRun, match=r"fields\.vtkhdf: .*its cells are not those of run\.h5"):
        Run(broken).field_times  # noqa: B018


def test_a_column_without_rows_is_one_line(broken: Path, capsys) -> None:
    with h5py.File(broken / "run.h5", "r+") as h5:
        put("series/wall_time", np.empty(0))(h5)
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
    one = loose_pile.fields_at(2.0)
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
    assert float(found.solid.isel(time=3).mean()) == pytest.approx(
        float(run.fields_at(run.field_times[3]).solid.mean()), rel=1e-5
    )
    assert asked == [("solid", 3)]
    assert found.solid.mean(("x", "y", "z")).to_numpy().shape == run.field_times.shape


def test_a_run_without_fields(make_run) -> None:
    run = make_run(Motion(t_end=1.0))
    (run.folder / "fields.vtkhdf").unlink()
    assert list(run.fields.data_vars) == [] and run.fields.sizes["time"] == 0


def test_a_run_is_shown(loose_pile: Run) -> None:
    assert repr(loose_pile) == str(loose_pile)
    shown = loose_pile._repr_html_()
    assert shown.startswith("<pre>") and "heading_deg" in shown
    assert np.char.count(shown, "<tr") >= loose_pile.bodies.n


@pytest.mark.parametrize(
    ("value", "words"),
    [(6.789, "6.79"), (0.4, "0.4"), (6790.0, "6790"), (1.0132e6, "1.01e+06"), (123456.0, "123000"),
     (0.0, "0"), (-0.01234, "-0.0123"), (3.2e-7, "3.2e-07"), (999.7, "1000"), (float("nan"), "–")],
)  # fmt: skip
def test_figures_have_three_digits(value: float, words: str) -> None:
    assert units.figure(value) == words


@pytest.mark.parametrize(
    ("kind", "small", "words", "large", "others"),
    [
        ("length", 0.0679, "67.9 mm", 6.79, "6.79 m"),
        ("area", 0.0123, "123 cm²", 61.2, "61.2 m²"),
        ("volume", 56e-6, "56 cm³", 2.24, "2.24 m³"),
        ("mass", 0.129, "0.129 kg", 5376.0, "5.38 t"),
        ("force", 1.264, "1.26 N", 1.01e6, "1010 kN"),
        ("energy", 0.0757, "75.7 mJ", 6790.0, "6.79 kJ"),
        ("speed", 0.512, "0.512 m/s", 0.512, "0.512 m/s"),
    ],
)
def test_units_grow_with_the_blocks(
    kind: str, small: float, words: str, large: float, others: str
) -> None:
    """With a blank that does not break; in plain letters for a terminal."""
    for size, value, told in ((0.06, small, words), (2.0, large, others)):
        unit = units.of_size(size).of_kind(kind)
        assert unit.text(value) == told.replace(" ", "\u00a0")
        assert unit.plain(value) == told.replace("²", "2").replace("³", "3")
    assert units.of_size(2.0).area.plain(float("nan")) == "-"


def test_arrays_and_several_figures() -> None:
    site = units.of_size(2.0)
    assert site.force.of(np.array([1e3, 2e3])) == pytest.approx([1.0, 2.0])
    assert site.length.row([26.0, 6.0, 12.8], " x ") == "26 x 6 x 12.8\u00a0m"


def run(lengths: list[float], tank: float = 1.0) -> Any:
    names = [str(k) for k in range(len(lengths))]
    return SimpleNamespace(
        bodies=SimpleNamespace(n=len(names), shape=names),
        shapes={name: SimpleNamespace(length=v) for name, v in zip(names, lengths, strict=True)},
        grid=SimpleNamespace(low=np.zeros(3), high=np.array([tank, 0.1, 0.1])),
    )


def test_the_largest_block_decides_or_the_tank() -> None:
    assert units.of_run(run([0.05, 2.0])).length.name == "m"
    assert units.of_run(run([0.05])).length.name == "mm"
    assert units.of_run(run([], tank=1.0)).length.name == "mm"
    assert units.of_run(run([], tank=100.0)).length.name == "m"
