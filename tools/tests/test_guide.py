"""What README and guide show works: the Python example, the tools, files and options they name."""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fences import fences
from micstools import cli
from micstools.reading.reader import Run

ROOT = Path(__file__).parents[2]
TEXTS = ["README.md", "docs/guide.md", "docs/gallery.md"]


def test_the_example_in_python_runs(loose_pile: Run, tmp_path: Path) -> None:
    (example,) = [
        text for language, text in fences(ROOT / "docs" / "guide.md") if language == "python"
    ]
    if not os.access(ROOT / "mics", os.X_OK):
        pytest.skip("./mics is not built")
    (tmp_path / "input").symlink_to(ROOT / "input")
    (tmp_path / "mics-coarse").symlink_to(loose_pile.folder)
    done = subprocess.run(
        [sys.executable, "-c", example],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT / "tools"), "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert "60 x 20 x 40 cells" in done.stdout and "time of the run" in done.stdout
    assert Run(tmp_path / "mics-7").bodies.time[-1] == pytest.approx(0.2)
    assert "(40, 20, 60)" in done.stdout
    assert len((tmp_path / "series.csv").read_text().splitlines()) == 402
    assert (tmp_path / "scene.vtm").is_file()


@pytest.mark.parametrize("page", TEXTS)
def test_every_tool_and_option_named_is_there(page: str) -> None:
    text = (ROOT / page).read_text().replace("\\\n", " ")
    calls = re.findall(r"mics-tools (\w+)([^\n`#]*)", text)
    assert calls
    for name, words in calls:
        assert name in cli.COMMANDS, name
        parser = argparse.ArgumentParser()
        cli.find(name).arguments(parser)
        known = {option for action in parser._actions for option in action.option_strings}
        for option in re.findall(r"--[a-z-]+", words):
            assert option in known, f"mics-tools {name} {option}"


def test_every_case_run_is_there() -> None:
    for page in TEXTS:
        for case in re.findall(r"input/\w+\.(?:nml|txt)", (ROOT / page).read_text()):
            assert (ROOT / case).is_file(), f"{page}: {case}"


def test_the_table_of_tools_holds_tools() -> None:
    text = (ROOT / "docs" / "guide.md").read_text().partition("| command |")[2].partition("\n\n")[0]
    rows = [line.split("|")[1] for line in text.splitlines()[2:]]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert len(named) > 10
    assert named <= set(cli.COMMANDS)
