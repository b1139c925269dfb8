"""A film of a run, mp4 or gif: each picture goes to ffmpeg as soon as it is drawn."""

import contextlib
import itertools
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from PIL import Image

from micstools.pictures import labels, scene
from micstools.pictures.reel import Reel
from micstools.reading.reader import BadRun, Run
from micstools.shapes.geometry import Array

VIEWS = ("front", "side", "top", "orbit")
KINDS = (".mp4", ".gif")
NO_ENCODER = "films need ffmpeg: pip install imageio-ffmpeg, or apt-get install ffmpeg"
_PALETTE = "split[a][b];[a]palettegen=max_colors=64:stats_mode=single[p];[b][p]paletteuse=new=1"
_ENCODING = {
    ".mp4": ["-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-crf", "20",
             "-movflags", "+faststart", "-f", "mp4"],
    ".gif": ["-vf", _PALETTE, "-loop", "0", "-f", "gif"],
}  # fmt: skip
_TOLD = 2.0  # seconds between two words on how far a film is


@dataclass(frozen=True)
class Film:
    """What is filmed, and how."""

    view: str = "front"  # one of VIEWS
    begin: float = 0.0  # [s]
    end: float = np.inf  # [s]
    slow: float = 1.0  # 2: half as fast as in truth; 0.04: 25 times as fast
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

    def caption(self, time: float) -> str:
        """What stands above the picture of that time [s]."""
        if self.slow == 1.0:
            return f"t = {time:.2f} s"
        if self.slow > 1.0:
            return f"t = {time:.2f} s, {self.slow:.3g} times slower"
        return f"t = {time:.2f} s, {1.0 / self.slow:.3g} times faster"


def encoder() -> str | None:
    """The path of ffmpeg: that of the package imageio-ffmpeg, else one of the system, else none."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):  # no package, or none for this machine
        return shutil.which("ffmpeg")


def require(path: Path) -> None:
    """Refuse a film that cannot be written, before anything is drawn."""
    if path.suffix not in KINDS:
        raise BadRun(f"{path}: must end in {' or '.join(KINDS)}")
    if encoder() is None:
        raise BadRun(NO_ENCODER)


def pictures(run: Run, film: Film) -> Iterator[Image.Image]:
    """All pictures; the water is that of the nearest written field. From the top it would only veil
    the blocks and is left out."""
    low, high = run.grid.low, run.grid.high
    times = film.times(run)
    orbit = film.view == "orbit"
    camera = (
        scene.camera_around(low, high, -30) if orbit else scene.camera_for(low, high, film.view)
    )
    reel = Reel(run, film.width, camera.aspect, water=film.view != "top")
    try:
        for k, t in enumerate(times):
            if orbit:
                camera = scene.camera_around(low, high, -30 + 360 * k / len(times))
            yield labels.with_header(reel.draw(float(t), camera), film.caption(float(t)), [])
    finally:
        reel.close()


def write(run: Run, film: Film, path: Path) -> Path:
    """Make the film; its kind is that of the end of its name. A film that does not come to its end
    leaves nothing, and an older one of that name as it was."""
    require(path)
    unfinished = path.with_name(f".{path.name}.part")
    try:
        _encode(_told(pictures(run, film), len(film.times(run))), film, path, unfinished)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path


def _told(found: Iterator[Image.Image], total: int) -> Iterator[Image.Image]:
    """The same pictures; tells on standard error how many are done, and how long the rest takes:
    a line that changes on a terminal, else a line now and then."""
    terminal, start, last = sys.stderr.isatty(), time.monotonic(), -_TOLD
    for done, image in enumerate(found, start=1):
        yield image
        now = time.monotonic() - start
        if now - last >= _TOLD or done == total:
            left = now / done * (total - done)
            text = f"{done} of {total} pictures, {left:.0f} s left"
            print(f"\r{text}\033[K" if terminal else text, end="" if terminal else "\n",
                  file=sys.stderr, flush=True)  # fmt: skip
            last = now
    if terminal:
        print(file=sys.stderr)


def _encode(found: Iterator[Image.Image], film: Film, path: Path, unfinished: Path) -> None:
    """Hand all pictures to ffmpeg, one by one; `path` is what the film is for."""
    first = next(found)
    size = first.width // 2 * 2, first.height // 2 * 2  # as the code of the film wants it
    words = [str(encoder()), "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
             "-s", f"{size[0]}x{size[1]}", "-r", str(film.rate), "-i", "-",
             *_ENCODING[path.suffix], str(unfinished)]  # fmt: skip
    with subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin and process.stderr
        try:
            _feed(process.stdin, itertools.chain([first], found), size)
        except BaseException:
            process.kill()
            raise
        said = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        raise BadRun(f"{path}: ffmpeg ended with code {process.returncode}: {said[-200:]}")


def _feed(pipe: IO[bytes], found: Iterator[Image.Image], size: tuple[int, int]) -> None:
    """Write the pictures, cut to a size, and close; an encoder that ends early says why itself."""
    for image in found:  # may itself meet a pipe that nobody reads: that of standard error
        try:
            pipe.write(image.crop((0, 0, *size)).tobytes())
        except BrokenPipeError:
            return
    with contextlib.suppress(BrokenPipeError):
        pipe.close()
