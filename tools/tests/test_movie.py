"""Films have the pictures that were asked for, and blocks move in them."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from micstools import cli, movie, scene
from micstools.movie import Film
from micstools.reader import BadRun, Run

can_draw = pytest.mark.skipif(bool(scene.missing_libraries()), reason=scene.missing_libraries())
has_ffmpeg = pytest.mark.skipif(not shutil.which("ffmpeg"), reason="no ffmpeg here")


def test_slow_motion_has_more_pictures(loose_pile: Run) -> None:
    assert len(Film().times(loose_pile)) == 8 * 25 + 1
    slow = Film(begin=1.0, end=2.0, slow=4, rate=10).times(loose_pile)
    assert len(slow) == 41 and slow[[0, -1]] == pytest.approx([1.0, 2.0])
    with pytest.raises(BadRun, match="holds nothing of the run, which goes from 0 to 8 s"):
        Film(begin=9.0).times(loose_pile)


@can_draw
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
def test_an_mp4_has_its_length(loose_pile: Run, tmp_path: Path, capsys) -> None:
    path = tmp_path / "a.mp4"
    words = ["movie", str(loose_pile.folder), "--from", "2", "--until", "2.4", "--rate", "10"]
    with pytest.raises(SystemExit) as end:
        cli.main([*words, "--slow", "2", "--width", "161", "--out", str(path)])
    assert end.value.code == 0
    assert capsys.readouterr().out.splitlines() == ["9 pictures", str(path)]
    ask = ["ffprobe", "-v", "error", "-count_frames", "-show_entries",
           "stream=codec_name,width,nb_read_frames", "-of", "csv=p=0", str(path)]  # fmt: skip
    done = subprocess.run(ask, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "h264,160,9"


@can_draw
def test_what_cannot_be_made_is_said_first(loose_pile: Run, monkeypatch, capsys) -> None:
    monkeypatch.setattr(movie.shutil, "which", lambda name: None)
    for more, said in (
        ([], "mp4 needs ffmpeg"),
        (["--out", "a.avi"], "must end in .mp4 or .gif"),
        (["--slow", "0"], "--slow 0.0: must be positive"),
    ):
        with pytest.raises(SystemExit) as end:
            cli.main(["movie", str(loose_pile.folder), *more])
        (line,) = capsys.readouterr().err.splitlines()
        assert end.value.code == 2 and said in line
