"""Films have the pictures that were asked for, and blocks move in them."""

import os
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from calls import mics_tools
from micstools.pictures import movie, reel, scene
from micstools.pictures.movie import Film
from micstools.reading.reader import BadRun, Run

ROOT = Path(__file__).parents[2]

can_draw = pytest.mark.skipif(bool(scene.missing_libraries()), reason=scene.missing_libraries())
has_ffmpeg = pytest.mark.skipif(not movie.encoder(), reason=movie.NO_ENCODER)
has_ffprobe = pytest.mark.skipif(not movie.shutil.which("ffprobe"), reason="no ffprobe here")


@pytest.mark.parametrize(
    ("slow", "caption"),
    [(1, "t = 2.50 s"), (4, "t = 2.50 s, 4 times slower"), (0.04, "t = 2.50 s, 25 times faster")],
)
def test_caption(slow: float, caption: str) -> None:
    assert Film(slow=slow).caption(2.5) == caption


def test_slow_motion_has_more_pictures(loose_pile: Run) -> None:
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
        frames = []
        for k in (0, 3):
            found.seek(k)
            frames.append(np.asarray(found.convert("RGB")).astype(int))
    assert (np.abs(frames[0] - frames[1]).max(axis=2) > 60).mean() > 0.002


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
        (["--slow", "0"], "--slow 0.0: must be positive"),
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
@pytest.mark.parametrize("error", [KeyboardInterrupt, BadRun("broken")])
def test_nothing_unfinished_is_left(
    loose_pile: Run, tmp_path: Path, monkeypatch, error: BaseException
) -> None:
    """Nor is an older film lost."""

    def broken(*_: object) -> Iterator[Image.Image]:
        yield from plain_pictures(5)
        raise error

    monkeypatch.setattr(movie, "pictures", broken)
    old = tmp_path / "a.mp4"
    old.write_text("an older film")
    with pytest.raises((KeyboardInterrupt, BadRun)):
        movie.write(loose_pile, Film(), old)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert old.read_text() == "an older film"


@can_draw
@has_ffmpeg
def test_a_stopped_film_leaves_nothing(loose_pile: Run, tmp_path: Path) -> None:
    words = ["-m", "micstools.cli", "movie", loose_pile.folder, "--out", tmp_path / "a.mp4"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools")}
    with subprocess.Popen(
        [sys.executable, *words], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as running:
        assert running.stderr
        running.stderr.readline()  # the first pictures are told
        for _ in range(100):
            if list(tmp_path.iterdir()):
                break
            time.sleep(0.05)
        running.send_signal(signal.SIGTERM)
        assert running.wait(30) == 143
    assert list(tmp_path.iterdir()) == []


@can_draw
def test_a_reel_builds_nothing_twice(loose_pile: Run, monkeypatch) -> None:
    """The water anew for each written time, all else once; blocks move all the same."""
    found = reel.Reel(loose_pile, 160, 0.6, water=True)
    added: list[str] = []
    add = type(found._plotter).add_mesh

    def noted(self: object, *mesh: object, **look: object) -> object:
        added.append(str(look.get("name", "")))
        return add(self, *mesh, **look)

    monkeypatch.setattr(type(found._plotter), "add_mesh", noted)
    camera = scene.camera_for(loose_pile.grid.low, loose_pile.grid.high, "front")
    seen = [np.asarray(found.draw(t, camera)).astype(int) for t in (2.10, 2.14, 2.20, 2.60, 2.64)]
    found.close()
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
