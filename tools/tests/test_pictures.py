"""Pictures are made, have the right size, and show what they should."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from micstools import plots, scene
from micstools.reader import Run
from micstools.shapes import hexapod

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
    assert bluish.mean() > 0.2


@can_draw
def test_blocks_not_yet_released_are_not_drawn(loose_pile: Run, tmp_path: Path) -> None:
    style = scene.Style(width=300, arrows=False, water=False, label=False)
    early = colours(scene.picture(loose_pile, 0.0, "front", tmp_path / "a.png", style))
    late = colours(scene.picture(loose_pile, 8.0, "front", tmp_path / "b.png", style))
    purple = [((c[:, 2] > c[:, 1] + 25) & (c[:, 0] > c[:, 1] + 10)).mean() for c in (early, late)]
    assert purple[0] == 0.0
    assert purple[1] > 0.001


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


def test_missing_libraries_end_the_program_with_the_command(monkeypatch, capsys) -> None:
    monkeypatch.setattr(scene, "_loads", lambda library: False)
    monkeypatch.setattr(scene.sys, "platform", "linux")
    with pytest.raises(SystemExit) as stop:
        scene.require_libraries()
    assert stop.value.code == 1
    assert "apt-get install libegl1 libgl1" in capsys.readouterr().err


def test_history_has_a_panel_for_each_matter(loose_pile: Run) -> None:
    titles = [axis.get_title(loc="left") for axis in plots.history(loose_pile).axes]
    assert titles[:2] == ["height of the centroid [mm]", "speed [m/s]"]
    assert "drift of the liquid volume [-]" in titles
    assert len(titles) == 10


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
