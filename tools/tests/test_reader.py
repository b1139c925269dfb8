"""The reader against files as the program writes them, finished, growing and missing."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools.reading.profiles import along_line, table
from micstools.reading.reader import Run
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


def test_series_become_a_table(loose_pile: Run, tmp_path: Path) -> None:
    rows = table(loose_pile.series_to_csv(tmp_path / "series.csv"))
    assert len(rows) == 401
    assert float(rows[-1]["time"]) == loose_pile.series.time[-1]


def test_blocks_become_a_table(loose_pile: Run, tmp_path: Path) -> None:
    b = loose_pile.bodies
    rows = table(loose_pile.to_csv(tmp_path / "blocks.csv"))
    assert len(rows) == b.n * len(b.time)
    found = rows[b.n * 5 + 3]  # the fourth block in the sixth row
    assert (found["block"], found["shape"]) == ("4", b.shape[3])
    for name, value in (
        ("time", b.time[5]),
        ("z", b.position[5, 3, 2]),
        ("qw", b.quaternion[5, 3, 0]),
        ("vz", b.velocity[5, 3, 2]),
        ("wx", b.angular_velocity[5, 3, 0]),
        ("fluid_fz", b.fluid_force[5, 3, 2]),
        ("contact_ty", b.contact_torque[5, 3, 1]),
    ):
        assert float(found[name]) == value


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
