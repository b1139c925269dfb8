"""A film of a run: mp4 through ffmpeg, or gif."""

import contextlib
import itertools
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from micstools import labels, scene
from micstools.geometry import Array
from micstools.reader import BadRun, Run

VIEWS = ("front", "side", "top", "orbit")
KINDS = (".mp4", ".gif")
_COLOURS = 64  # of a gif


@dataclass(frozen=True)
class Film:
    """What is filmed, and how."""

    view: str = "front"  # one of VIEWS
    begin: float = 0.0  # [s]
    end: float = np.inf  # [s]
    slow: float = 1.0  # 2: half as fast as in truth
    rate: int = 25  # pictures a second
    width: int = 800  # [pixels]

    def times(self, run: Run) -> Array:
        """Time of each picture [s]."""
        time = run.bodies.time
        first, last = max(self.begin, float(time[0])), min(self.end, float(time[-1]))
        if not first < last:
            raise BadRun(f"the film from {self.begin:g} to {self.end:g} s holds nothing of the "
                         f"run, which goes from {time[0]:g} to {time[-1]:g} s")  # fmt: skip
        return np.arange(first, last + 1e-9, 1 / (self.rate * self.slow))


def require(path: Path) -> None:
    """Refuse a film that cannot be written, before anything is drawn."""
    if path.suffix not in KINDS:
        raise BadRun(f"{path}: must end in {' or '.join(KINDS)}")
    if path.suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise BadRun("mp4 needs ffmpeg: apt-get install ffmpeg, or give --out with the end .gif")


def pictures(run: Run, film: Film) -> Iterator[Image.Image]:
    """All pictures; the water is that of the nearest written field. From the top it would only veil
    the blocks and is left out."""
    low, high = run.grid.low, run.grid.high
    times = film.times(run)
    for k, t in enumerate(times):
        if film.view == "orbit":
            camera = scene.camera_around(low, high, -30 + 360 * k / len(times))
        else:
            camera = scene.camera_for(low, high, film.view)
        wet = run.field_times.size and film.view != "top"
        fields = run.fields(float(t)) if wet else None
        image = scene.frame(run, run.bodies.row(float(t)), fields, film.width, camera)
        said = f"t = {t:.2f} s" + (f", {film.slow:g} times slower" if film.slow != 1 else "")
        yield labels.with_header(image, said, [])


def write(run: Run, film: Film, path: Path) -> Path:
    """Make the film; its kind is that of the end of its name."""
    require(path)
    return _write_gif(run, film, path) if path.suffix == ".gif" else _write_mp4(run, film, path)


def _write_gif(run: Run, film: Film, path: Path) -> Path:
    small = (image.quantize(_COLOURS) for image in pictures(run, film))
    first = next(small)
    hold = 10 * round(100 / film.rate)  # a gif counts in hundredths of a second
    first.save(path, save_all=True, append_images=small, duration=hold, loop=0, optimize=False)
    return path


def _write_mp4(run: Run, film: Film, path: Path) -> Path:
    found = pictures(run, film)
    first = next(found)
    size = first.width // 2 * 2, first.height // 2 * 2  # as the code of the film wants it
    words = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
             "-s", f"{size[0]}x{size[1]}", "-r", str(film.rate), "-i", "-", "-c:v", "libx264",
             "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", str(path)]  # fmt: skip
    with subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin and process.stderr
        with contextlib.suppress(BrokenPipeError):  # then it says why
            for image in itertools.chain([first], found):
                process.stdin.write(image.crop((0, 0, *size)).tobytes())
            process.stdin.close()
        said = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        raise BadRun(f"{path}: ffmpeg ended with code {process.returncode}: {said[-200:]}")
    return path
