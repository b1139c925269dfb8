"""Pictures and films show what they should; what is exported is read back by other programs."""

import json
import os
import signal
import struct
import subprocess
import sys
import warnings
import weakref
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image, ImageSequence

from calls import ROOT, going_on, mics_tools, python, until
from micstools.pictures import exports, labels, movie, plots, reel, scene
from micstools.pictures.movie import Film
from micstools.reading import vtk_data
from micstools.reading.reader import BadRun, Bodies, Run
from micstools.shapes.shape import hexapod
from synthetic import UPRIGHT, Motion, write_run

can_draw = pytest.mark.skipif(bool(scene.missing_libraries()), reason=scene.missing_libraries())


def colours(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3).astype(int)


def share_of_water(rgb: np.ndarray) -> float:
    return ((rgb[:, 2] > rgb[:, 0] + 10) & (rgb[:, 2] > 150)).mean()


@can_draw
@pytest.mark.parametrize("view", scene.VIEWS)
def test_a_picture_shows_blocks_and_water(loose_pile: Run, tmp_path: Path, view: str) -> None:
    full = scene.picture(loose_pile, 8.0, view, tmp_path / "a.png", scene.Style(width=300))
    rgb = colours(full)
    reddish = (rgb[:, 0] > rgb[:, 1] + 60) & (rgb[:, 0] > rgb[:, 2] + 40)
    assert reddish.mean() > 0.01
    wet = share_of_water(rgb)
    assert wet < 0.1 if view == "top" else wet > 0.2  # water veils the pile


@can_draw
def test_the_water_of_a_light_run_is_drawn_at_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write_run(tmp_path / "run")
    (folder / "fields.vtkhdf").unlink()
    monkeypatch.setattr(Run, "physics", property(lambda run: "light"))
    for view, wet in (("front", True), ("top", False)):
        for water in (True, False):
            style = scene.Style(width=300, water=water)
            path = scene.picture(Run(folder), 8.0, view, tmp_path / "a.png", style)
            assert (share_of_water(colours(path)) > 0.2) == (wet and water)


@can_draw
def test_blocks_not_yet_released_are_not_drawn(loose_pile: Run, tmp_path: Path) -> None:
    style = scene.Style(width=300, arrows=False, water=False, label=False)
    early = colours(scene.picture(loose_pile, 0.0, "front", tmp_path / "a.png", style))
    late = colours(scene.picture(loose_pile, 8.0, "front", tmp_path / "b.png", style))
    purple = [((c[:, 2] > c[:, 1] + 25) & (c[:, 0] > c[:, 1] + 10)).mean() for c in (early, late)]
    assert purple[0] == 0.0
    assert purple[1] > 0.001


@can_draw
def test_blocks_are_found_by_their_numbers_from_one(loose_pile: Run) -> None:
    camera = scene.camera_for(loose_pile.grid.low, loose_pile.grid.high, "front")
    for t, seen in ((0.0, {1, 2, 3, 4}), (2.5, {1, 2, 3, 4, 5, 6})):
        plotter = scene.new_plotter(300, int(300 * camera.aspect))
        ids = scene._block_numbers(plotter, loose_pile, loose_pile.bodies.row(t), camera)
        plotter.close()
        assert set(np.unique(ids[ids > 0])) == seen
        middle = [np.nonzero(ids == k)[1].mean() for k in (1, 2, 3)]
        assert middle == sorted(middle)
    with patch.object(Bodies, "there", lambda bodies, _: np.ones(bodies.n, bool)):  # on a crane
        assert len(vtk_data.blocks(loose_pile, 0)) == loose_pile.bodies.n


def test_a_number_is_written_where_its_block_is_seen() -> None:
    image = Image.new("RGB", (400, 200), "#2e4057")
    ids = np.zeros((200, 400), dtype=int)
    ids[50:100, 300:360] = 17
    ids[150:154, 20:24] = 5  # too little of it is seen
    labels.number_blocks(image, ids)
    changed = np.argwhere(np.any(np.asarray(image) != (0x2E, 0x40, 0x57), axis=2))
    assert changed.min(axis=0).tolist() > [50, 300] and changed.max(axis=0).tolist() < [100, 360]
    grey = np.asarray(image.convert("L")).astype(int)
    assert grey.max() > 240 and grey.min() < 40  # black on white on any block


@can_draw
def test_pictures_have_one_scale_of_arrows(loose_pile: Run, tmp_path: Path) -> None:
    """The key beside the time is the same although the wave is at rest in one of them."""
    speed = scene.arrow_speed(loose_pile, [0.0, 0.5, 3.0], ["front"])
    assert 0.05 < speed < 0.15
    style = scene.Style(width=400, speed=speed)
    heads = []
    for t in (0.5, 3.0):
        image = Image.open(scene.picture(loose_pile, t, "front", tmp_path / "a.png", style))
        after_time = round(5 * labels.letter_size(400))
        heads.append(np.asarray(image)[: labels.letter_size(400), after_time:])
    assert np.array_equal(*heads)
    assert (heads[0] < 100).any()


@can_draw
def test_a_picture_in_a_survey_is_the_same(tmp_path: Path) -> None:
    """VTK makes arrows, water and tank in single precision."""
    seen = []
    for origin in ((0.0, 0.0, 0.0), (354200.5, 5621080.0, -12.0)):
        motion = Motion(t_end=1.0, scale=100 / 3, origin=origin)
        run, style = Run(write_run(tmp_path / str(len(seen)), motion)), scene.Style(width=300)
        seen.append(colours(scene.picture(run, 0.5, "front", tmp_path / "a.png", style)))
    assert (np.abs(seen[0] - seen[1]).max(axis=1) > 40).mean() < 0.002


def test_the_line_above_a_picture_is_never_cut_off() -> None:
    """In a narrow picture it takes several lines, with the same ink."""
    keys = [labels.Key("arrow", 90, "0.05 m/s"), labels.Key("bar", 70, "200 mm")]
    ink, heights = [], []
    for width in (150, 220, 380):  # letters of one size
        whole = labels.with_header(Image.new("RGB", (width, 40), "white"), "t = 10.00 s", keys)
        header = 255 - np.asarray(whole.convert("L")).astype(int)[:-40]
        ink.append(header.sum())
        heights.append(len(header))
    assert ink == [ink[2]] * 3
    assert heights[0] > heights[1] > heights[2]


def test_keys_are_round_numbers() -> None:
    found = [labels.round_below(x) for x in (0.0131, 0.2, 0.19999, 7.0, 10.0)]
    assert found == pytest.approx([0.01, 0.2, 0.1, 5.0, 10.0])


def test_a_slice_is_seen_from_its_flat_side(make_run) -> None:
    run = make_run(Motion(cells=(60, 1, 40), t_end=0.5))
    assert scene.telling_views(run) == ["front"]
    thin = scene.camera_for(np.zeros(3), np.array([0.584, 0.006, 0.365]), "side")
    assert thin.aspect < 1.1 * scene.HIGHEST


@can_draw
def test_figure_one(tmp_path: Path) -> None:
    path = scene.shape_picture(hexapod(0.02, 1), tmp_path / "shape.png", 600)
    assert Image.open(path).size == (600, 200)


def test_camera_holds_the_tank() -> None:
    low, high = np.zeros(3), np.array([0.3, 0.1, 0.2])
    corners = np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.1) for z in (0, 0.2)])
    for view in scene.VIEWS:
        camera = scene.camera_for(low, high, view)
        towards = camera.position - camera.focus
        distance = np.linalg.norm(towards)
        right = np.cross([0, 0, 1], towards)
        right /= np.linalg.norm(right)
        up = np.cross(towards / distance, right)
        away = corners - camera.focus
        ahead = distance - away @ towards / distance
        half = np.tan(np.radians(camera.angle / 2))
        assert (np.abs(away @ up) / ahead).max() < half
        assert (np.abs(away @ right) / ahead).max() < half / camera.aspect


def test_missing_libraries_end_the_program_with_the_command(monkeypatch, capsys) -> None:
    monkeypatch.setattr(scene, "_loads", lambda library: False)
    monkeypatch.setattr(scene.sys, "platform", "linux")
    with pytest.raises(SystemExit) as stop:
        scene.require_libraries()
    assert stop.value.code == 1
    assert "apt-get install libegl1 libgl1" in capsys.readouterr().err


def test_history_has_a_panel_for_each_matter(loose_pile: Run) -> None:
    titles = [axis.get_title(loc="left") for axis in plots.history(loose_pile).axes]
    assert titles[:2] == ["height of the centroid, z [mm]", "speed [m/s]"]
    assert "drift of the liquid volume [-]" in titles
    assert "largest excess of fluid in a cell [V], limit dashed" in titles
    assert len(titles) == 12  # with the empty one at the end


def test_units_of_diagrams_and_pictures_go_with_the_blocks(make_run) -> None:
    motion = Motion(t_end=2.0, field_step=2.0, cells=(12, 4, 8))
    for scale, length, force, energy, bar in (
        (1.0, "mm", "N", "mJ", "50 mm"),
        (100 / 3, "m", "kN", "kJ", "2 m"),
    ):
        run = make_run(replace(motion, scale=scale))
        titles = [axis.get_title(loc="left") for axis in plots.history(run).axes]
        assert titles[0] == f"height of the centroid, z [{length}]"
        assert f"contact force [{force}]" in titles and f"energy [{energy}]" in titles
        assert "largest overlap [% of the smallest block's length]" in titles
        assert scene._keys(run, 0.0, 100.0, "front")[-1].text == bar


def test_the_legend_names_every_block_and_covers_no_curve(make_run) -> None:
    ends = [(np.array([0.02 * k, 0.05, 0.1]), UPRIGHT) for k in range(1, 13)]
    figure = plots.history(make_run(Motion(places=ends, t_end=13.0, field_step=13.0)))
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [str(k) for k in range(4, 16)]
    lines = figure.axes[0].get_lines()
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 12
    FigureCanvasAgg(figure).draw()
    panels = [axis.get_window_extent() for axis in figure.axes]
    legends = [axis.get_legend() for axis in figure.axes]
    for box in [found.get_window_extent() for found in [legend, *legends] if found]:
        assert not any(box.overlaps(panel) for panel in panels)


def test_contact_sheet_places_all(tmp_path: Path) -> None:
    paths = []
    for k in range(5):
        paths.append(tmp_path / f"{k}.png")
        Image.new("RGB", (80, 60 + 20 * (k == 1)), (40 * k, 0, 0)).save(paths[-1])
    sheet = Image.open(plots.contact_sheet(paths, tmp_path / "sheet.png", columns=3, width=40))
    assert sheet.size == (120, 40 + 30)
    assert sheet.getpixel((60, 50))[0] == 160


@pytest.mark.parametrize("script", ["plot_pile", "plot_history", "plot_shape", "check_pile"])
def test_scripts_explain_themselves_and_are_short(script: str) -> None:
    path = ROOT / "tools" / f"{script}.py"
    assert len(path.read_text().splitlines()) < 40
    assert "usage" in python(path, "--help", check=True).stdout


def test_check_pile_prints_the_findings(loose_pile: Run) -> None:
    shown = python(ROOT / "tools" / "check_pile.py", loose_pile.folder, check=True)
    assert "pattern A" in shown.stdout


def test_the_final_table_holds_places_and_attitudes(make_run, capsys) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0))  # too late for the third and later ones
    b = run.bodies
    assert mics_tools(["export", str(run.folder), "--to", "csv", "--final"]) == 0
    said = capsys.readouterr()
    path = run.folder / "export" / "final.csv"
    assert said.out == f"{path}\n"
    assert "left out, not in the tank at the end: 6, 7, 8, 9" in said.err
    assert not (run.folder / "export" / "blocks.csv").exists()
    table = pd.read_csv(path, dtype=str)
    heads = ["block", "shape", "fixed", "x", "y", "z", "qw", "qx", "qy", "qz"]
    assert list(table) == heads and table.block.tolist() == ["1", "2", "3", "4", "5"]
    assert table[heads[3:6]].astype(float).to_numpy().tolist() == b.position[-1, :5].tolist()
    assert table[heads[6:]].astype(float).to_numpy().tolist() == b.quaternion[-1, :5].tolist()
    assert table.fixed.tolist() == ["1", "1", "1", "0", "0"]


Y_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # of the axes of glTF


def box_of(run: Run, row: int, blocks: int = 9, turn: np.ndarray | None = None) -> np.ndarray:
    """Lower and upper corner (2, 3) [m] of the first blocks at a row, in turned axes."""
    points = np.concatenate([run.points(k, row) for k in range(blocks)])
    points = points if turn is None else points @ turn
    return np.array([points.min(axis=0), points.max(axis=0)])


def closed_mesh(path: Path, volume: float) -> trimesh.Trimesh:
    mesh = trimesh.load(path, force="mesh")
    mesh.merge_vertices()
    assert mesh.is_watertight and mesh.volume == pytest.approx(volume, rel=1e-5)
    return mesh


@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_the_pile_is_closed_and_each_block_has_its_name(
    loose_pile: Run, tmp_path: Path, kind: str
) -> None:
    row = loose_pile.bodies.row(2.5)  # three are dropped
    path = exports.FORMATS[kind](loose_pile, row, tmp_path)
    mark = {"stl": "solid ", "obj": "o "}[kind]
    names = [line.split()[1] for line in path.read_text().splitlines() if line.startswith(mark)]
    assert names == [f"block-{k}" for k in range(1, 7)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = closed_mesh(path, 6 * 56e-6)
    assert mesh.bounds == pytest.approx(box_of(loose_pile, row, 6))


def parts_of(path: Path) -> tuple[dict, bytes]:
    content = path.read_bytes()
    magic, version, length, size, kind = struct.unpack_from("<4sIII4s", content)
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
    about, numbers = content[20 : 20 + size], content[20 + size :]
    assert numbers[4:8] == b"BIN\0"
    return json.loads(about), numbers[8:]


def array_of(about: dict, numbers: bytes, number: int) -> np.ndarray:
    accessor = about["accessors"][number]
    view = about["bufferViews"][accessor["bufferView"]]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    found = np.frombuffer(numbers, "<f4", accessor["count"] * width, view["byteOffset"])
    return found.reshape(-1, width)


def test_the_film_moves_each_block(loose_pile: Run, tmp_path: Path) -> None:
    path = exports.to_glb(loose_pile, 0, tmp_path)
    about, numbers = parts_of(path)
    b, film = loose_pile.bodies, about["animations"][0]
    blocks = [f"block {k}" for k in range(1, 10)]
    assert [node["name"] for node in about["nodes"]] == [*blocks, "tank"]
    found = {}
    for channel in film["channels"]:
        sampler = film["samplers"][channel["sampler"]]
        what = (channel["target"]["node"], channel["target"]["path"])
        found[what] = array_of(about, numbers, sampler["output"])
        times = array_of(about, numbers, sampler["input"])[:, 0]
    rows = np.searchsorted(b.time, times - 1e-6)
    assert times[0] == 0 and times[-1] == pytest.approx(b.time[-1])
    assert found[5, "translation"] == pytest.approx(b.position[rows, 5], abs=1e-7)
    assert found[5, "rotation"][:, 3] == pytest.approx(b.quaternion[rows, 5, 0], abs=1e-6)
    assert found[5, "rotation"][:, :3] == pytest.approx(b.quaternion[rows, 5, 1:], abs=1e-6)
    assert (found[5, "scale"][:, 0] > 0.5).tolist() == (times >= 2.0 - 1e-6).tolist()
    assert (0, "translation") not in found and (3, "scale") not in found


def test_other_programs_read_the_film(loose_pile: Run, tmp_path: Path) -> None:
    """As trimesh does: y is up there, and z runs to the viewer. In coordinates of a survey places
    count from a node at the corner of the tank: single precision holds them there."""
    found = trimesh.load(exports.to_glb(loose_pile, 0, tmp_path))
    assert found.bounds == pytest.approx(box_of(loose_pile, 0, turn=Y_UP), abs=1e-6)
    corner = (354200.0, 5621080.0, -12.0)
    run = Run(write_run(tmp_path / "far", Motion(scale=100 / 3, origin=corner)))
    path = exports.to_glb(run, 0, tmp_path)
    assert parts_of(path)[0]["nodes"][-1]["translation"] == [354200.0, -12.0, -5621080.0]
    assert np.abs(trimesh.load(path).bounds - box_of(run, 0, turn=Y_UP)).max() < 1e-5


@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_a_pile_in_a_survey_counts_from_a_corner(tmp_path: Path, kind: str, capsys) -> None:
    """Readers of STL hold half a metre there; what 0, 0, 0 is stands beside the file."""
    run = Run(write_run(tmp_path / "far", Motion(scale=100 / 3, origin=(354200.5, 5621080.0, -12))))
    assert mics_tools(["export", str(run.folder), "--to", kind, "--out", str(tmp_path)]) == 0
    assert "0, 0, 0 of stl and obj is 354200, 5621080, -12 m of the run" in capsys.readouterr().out
    told = json.loads((tmp_path / "origin.json").read_text())
    assert told["origin"] == [354200, 5621080, -12]
    wanted = box_of(run, len(run.bodies.time) - 1) - told["origin"]
    found = trimesh.load(tmp_path / f"pile.{kind}", force="mesh").bounds.astype(np.float32)
    assert np.abs(found - wanted).max() < 1e-6


@can_draw
def test_older_paraview_gets_blocks_and_fields(loose_pile: Run, tmp_path: Path) -> None:
    import pyvista as pv

    exports.to_pvd(loose_pile, 0, tmp_path)
    text = (tmp_path / "blocks.pvd").read_text()
    assert text.count("<DataSet") == len(loose_pile.field_times)
    frames = pv.PVDReader(tmp_path / "fields.pvd")
    assert frames.time_values == pytest.approx(loose_pile.field_times)
    image = pv.read(tmp_path / "fields-00004.vti")
    fields = loose_pile.fields_at(2.0)
    assert image.bounds == pytest.approx((0, 0.3, 0, 0.1, 0, 0.2))
    assert np.array_equal(image.cell_data["liquid"], fields.liquid.ravel())
    assert np.array_equal(image.cell_data["velocity"], fields.velocity.reshape(-1, 3))
    blocks = pv.read(tmp_path / "blocks-00004.vtp")
    assert set(blocks.cell_data["body"]) == {1, 2, 3, 4, 5, 6}
    assert blocks.volume == pytest.approx(6 * 56e-6, rel=1e-5)


def test_each_shape_has_its_file(loose_pile: Run, tmp_path: Path) -> None:
    folder = exports.to_shapes(loose_pile, 0, tmp_path)
    assert [path.stem for path in folder.iterdir()] == list(loose_pile.shapes)
    closed_mesh(folder / "hexapod.stl", 56e-6)


has_ffmpeg = pytest.mark.skipif(not movie.encoder(), reason=movie.NO_ENCODER)
has_ffprobe = pytest.mark.skipif(not movie.shutil.which("ffprobe"), reason="no ffprobe here")


def test_slow_motion_is_told_and_has_more_pictures(loose_pile: Run) -> None:
    for factor, said in ((1, ""), (4, ", 4 times slower"), (0.04, ", 25 times faster")):
        assert Film(slow=factor).caption(2.5) == f"t = 2.50 s{said}"
    assert len(Film().times(loose_pile)) == 8 * 25 + 1
    slow = Film(begin=1.0, end=2.0, slow=4, rate=10).times(loose_pile)
    assert len(slow) == 41 and slow[[0, -1]] == pytest.approx([1.0, 2.0])
    with pytest.raises(BadRun, match="holds nothing of the run, which goes from 0 to 8 s"):
        Film(begin=9.0).times(loose_pile)


@can_draw
@has_ffmpeg
@pytest.mark.parametrize("view", movie.VIEWS)
def test_a_gif_moves(loose_pile: Run, tmp_path: Path, view: str) -> None:
    film = Film(view, 2.1, 2.4, rate=10, width=160)
    path = movie.write(loose_pile, film, tmp_path / "a.gif")
    with Image.open(path) as found:
        assert found.n_frames == 4 and found.width == 160
        assert found.info["duration"] == 100
        frames = [np.asarray(k.convert("RGB")).astype(int) for k in ImageSequence.Iterator(found)]
    assert (np.abs(frames[0] - frames[3]).max(axis=2) > 60).mean() > 0.002


@can_draw
@has_ffmpeg
@has_ffprobe
def test_an_mp4_has_its_length(loose_pile: Run, tmp_path: Path, capsys) -> None:
    path = tmp_path / "a.mp4"
    words = ["movie", str(loose_pile.folder), "--from", "2", "--until", "2.4", "--rate", "10"]
    assert mics_tools([*words, "--slow", "2", "--width", "161", "--out", str(path)]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == ["9 pictures", str(path)]
    told = said.err.splitlines()
    assert told[0].startswith("1 of 9 pictures") and told[-1].startswith("9 of 9 pictures")
    ask = ["ffprobe", "-v", "error", "-count_frames", "-show_entries",
           "stream=codec_name,width,nb_read_frames", "-of", "csv=p=0", str(path)]  # fmt: skip
    done = subprocess.run(ask, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "h264,160,9"


@can_draw
def test_what_cannot_be_made_is_said_first(loose_pile: Run, monkeypatch, capsys) -> None:
    monkeypatch.setattr(movie.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    for more, said in (
        ([], "pip install imageio-ffmpeg, or apt-get install ffmpeg"),
        (["--out", "a.gif"], "pip install imageio-ffmpeg, or apt-get install ffmpeg"),
        (["--out", "a.avi"], "must end in .mp4 or .gif"),
    ):
        assert mics_tools(["movie", str(loose_pile.folder), *more]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert said in line


def test_the_encoder_comes_with_the_tools(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of imageio-ffmpeg goes before one of the system."""
    brought = SimpleNamespace(get_ffmpeg_exe=lambda: "/brought/ffmpeg")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", brought)
    assert movie.encoder() == "/brought/ffmpeg"
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(movie.shutil, "which", lambda name: f"/system/{name}")
    assert movie.encoder() == "/system/ffmpeg"


def plain_pictures(n: int, alive: list[int] | None = None) -> Iterator[Image.Image]:
    """Pictures of one colour; notes how many of them are held at a time."""
    held: list[weakref.ref[Image.Image]] = []
    for k in range(n):
        image = Image.new("RGB", (64, 48), (5 * k % 256, 80, 120))
        held.append(weakref.ref(image))
        if alive is not None:
            alive.append(sum(found() is not None for found in held))
        yield image
        del image


@has_ffmpeg
@pytest.mark.parametrize("kind", movie.KINDS)
def test_pictures_are_not_gathered(loose_pile, tmp_path: Path, monkeypatch, kind: str) -> None:
    alive: list[int] = []
    monkeypatch.setattr(movie, "pictures", lambda *_: plain_pictures(60, alive))
    movie.write(loose_pile, Film(), tmp_path / f"a{kind}")
    assert len(alive) == 60 and max(alive) <= 3


@has_ffmpeg
@pytest.mark.parametrize("error", [KeyboardInterrupt(), BadRun("broken"), BrokenPipeError()])
def test_nothing_unfinished_is_left(
    loose_pile: Run, tmp_path: Path, monkeypatch, error: BaseException
) -> None:
    """Nor is an older film lost; a pipe that breaks may be that of standard error."""

    def broken(*_: object) -> Iterator[Image.Image]:
        yield from plain_pictures(5)
        raise error

    monkeypatch.setattr(movie, "pictures", broken)
    old = tmp_path / "a.mp4"
    old.write_text("an older film")
    with pytest.raises(type(error)):
        movie.write(loose_pile, Film(), old)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert old.read_text() == "an older film"


@can_draw
@has_ffmpeg
def test_a_stopped_film_leaves_nothing(loose_pile: Run, tmp_path: Path) -> None:
    words = (sys.executable, "-m", "micstools.cli", "movie", loose_pile.folder, "--out")
    how = {"env": {**os.environ, "PYTHONPATH": str(ROOT / "tools")}, "stdout": subprocess.DEVNULL}
    with going_on(*words, tmp_path / "a.mp4", stderr=subprocess.PIPE, **how) as running:
        running.stderr.readline()  # the first pictures are told
        until(lambda: list(tmp_path.iterdir()), 5)
        running.send_signal(signal.SIGTERM)
        assert running.wait(30) == 143
    assert list(tmp_path.iterdir()) == []


@can_draw
def test_a_reel_builds_nothing_twice(loose_pile: Run) -> None:
    """The water anew for each written time, all else once; blocks move all the same."""
    found = reel.Reel(loose_pile, 160, 0.6, water=True)
    kind = type(found._plotter)
    camera = scene.camera_for(loose_pile.grid.low, loose_pile.grid.high, "front")
    times = (2.10, 2.14, 2.20, 2.60, 2.64)
    with patch.object(kind, "add_mesh", autospec=True, side_effect=kind.add_mesh) as add:
        seen = [np.asarray(found.draw(t, camera)).astype(int) for t in times]
    found.close()
    added = [call.kwargs.get("name", "") for call in add.call_args_list]
    assert added == 2 * list(scene.WATER_PARTS)
    assert (np.abs(seen[0] - seen[2]).max(axis=2) > 60).mean() > 0.002


@can_draw
def test_a_reel_shows_what_a_picture_shows(loose_pile: Run, tmp_path: Path) -> None:
    """But for the smoothing of edges."""
    style = scene.Style(width=600, arrows=False, label=False)
    path = scene.picture(loose_pile, 4.5, "front", tmp_path / "a.png", style)
    camera = scene.camera_for(loose_pile.grid.low, loose_pile.grid.high, "front")
    found = reel.Reel(loose_pile, 600, camera.aspect, water=True)
    drawn = found.draw(4.5, camera)
    found.close()
    with Image.open(path) as image:
        assert drawn.size == image.size
        wanted, seen = (np.asarray(i.convert("RGB").reduce(6)).astype(int) for i in (image, drawn))
    far = np.abs(seen - wanted)
    assert (far > 50).mean() < 0.01 and far.mean() < 6
