"""Pictures are made, have the right size, and show what they should."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from calls import mics_tools
from micstools.pictures import labels, plots, scene
from micstools.reading.reader import Run
from micstools.shapes.shape import hexapod
from synthetic import UPRIGHT, Motion, write_run

can_draw = pytest.mark.skipif(bool(scene.missing_libraries()), reason=scene.missing_libraries())
TOOLS = Path(__file__).parents[1]


def colours(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3).astype(int)


@can_draw
@pytest.mark.parametrize("view", scene.VIEWS)
def test_a_picture_shows_blocks_and_water(loose_pile: Run, tmp_path: Path, view: str) -> None:
    full = scene.picture(loose_pile, 8.0, view, tmp_path / "a.png", scene.Style(width=300))
    rgb = colours(full)
    reddish = (rgb[:, 0] > rgb[:, 1] + 60) & (rgb[:, 0] > rgb[:, 2] + 40)
    bluish = (rgb[:, 2] > rgb[:, 0] + 10) & (rgb[:, 2] > 150)
    assert reddish.mean() > 0.01
    assert (bluish.mean() < 0.1) if view == "top" else (bluish.mean() > 0.2)  # water veils the pile


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
            rgb = colours(scene.picture(Run(folder), 8.0, view, tmp_path / "a.png", style))
            bluish = (rgb[:, 2] > rgb[:, 0] + 10) & (rgb[:, 2] > 150)
            assert (bluish.mean() > 0.2) == (wet and water)


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
    for view in scene.VIEWS:
        camera = scene.camera_for(low, high, view)
        towards = camera.position - camera.focus
        distance = np.linalg.norm(towards)
        right = np.cross([0, 0, 1], towards)
        right /= np.linalg.norm(right)
        up = np.cross(towards / distance, right)
        for corner in np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.1) for z in (0, 0.2)]):
            ahead = distance - (corner - camera.focus) @ towards / distance
            height = abs((corner - camera.focus) @ up) / ahead
            width = abs((corner - camera.focus) @ right) / ahead
            half = np.tan(np.radians(camera.angle / 2))
            assert height < half
            assert width < half / camera.aspect


def test_a_time_beyond_the_end_is_refused(loose_pile: Run, capsys) -> None:
    assert mics_tools(["plot", str(loose_pile.folder), "--times", "1e3"]) == 2
    assert "--times 1000: the run goes from 0 to" in capsys.readouterr().err


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
    path = TOOLS / f"{script}.py"
    assert len(path.read_text().splitlines()) < 40
    shown = subprocess.run([sys.executable, path, "--help"], capture_output=True, check=True)
    assert b"usage" in shown.stdout


def test_check_pile_prints_the_findings(loose_pile: Run) -> None:
    command = [sys.executable, TOOLS / "check_pile.py", loose_pile.folder]
    shown = subprocess.run(command, capture_output=True, check=True, text=True)
    assert "pattern A" in shown.stdout
