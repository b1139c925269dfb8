"""What the README shows in Python works as it stands there."""

import os
import subprocess
import sys
from pathlib import Path

from fences import fences
from micstools.reader import Run

ROOT = Path(__file__).parents[2]


def test_the_example_of_the_reader_runs(loose_pile: Run, tmp_path: Path) -> None:
    (example,) = [text for language, text in fences(ROOT / "README.md") if language == "python"]
    (tmp_path / "tools").symlink_to(ROOT / "tools")
    (tmp_path / "mics-coarse").symlink_to(loose_pile.folder)
    done = subprocess.run(
        [sys.executable, "-c", example],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
    )
    assert done.returncode == 0, done.stderr
    assert "60 x 20 x 40 cells" in done.stdout
    assert "(40, 20, 60)" in done.stdout
    assert len((tmp_path / "series.csv").read_text().splitlines()) == 402
    assert (tmp_path / "scene.vtm").is_file()
