"""The tutorials work as they stand: cases are saved, commands and programs run in their order; so
does the notebook, which is kept without output."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from calls import ROOT, needs_mics, program
from fences import fences

PAGES = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
SAID = {
    "convergence": [
        r"impact_speed +0\.38\d+, 0\.36\d+, 0\.35\d* m/s  \(no order fits\)",
        r"impact_speed +0\.36\d+, 0\.36\d+, 0\.36\d* m/s  \(not monotone\)",
        r"impact at 0\.36 to 0\.37 m/s: not monotone\n",
    ],
    "crane": [
        r"27 free units, 11 of them at rest",
        r"layer coefficient of 1 layer \d\.\d+ by the ball",
        r"down the slope: \d\.\d+ m on average",
    ],
    "hopper": [
        r"current 0\.6 m/s: middle of the load at x = \d+\.\d m",
        r"current 1\.2 m/s: middle of the load at x = \d+\.\d m",
    ],
    "own_block": [
        r"3 parts were united: -22\.22%",
        r"cross is 3 cells long",
        r"numbers of the \d complete piles of 6",
        r"covered in half of the piles or more: \d+\.\d cm2",
    ],
    "reef_in_current": [
        r"x +-0\.005 to 0\.605 m",
        r"blocks  3, fixed: none",
        r"block 3: let go at x = 0\.\d+ m, lies at x = 0\.\d+ m",
        r"x = 0\.5 m: 0\.",
    ],
    "reef_list": [
        r"dropped +35, the last one at 136 s",
        r"\d+ of 12 \(\d+ %, \d+ to \d+\) of the free units lie within 0\.3 m",
        r"A3 354207\.\d+ 562108[12]\.\d+ 0\.\d+ 0\.\d+",
    ],
}
MADE = {
    "crane": ["input/check.html", "mics-lines/places.geojson"],
    "hopper": ["mics-slow/run.h5", "mics-fast/run.h5"],
    "reef_list": ["mics-reefs/places.geojson"],
    "convergence": ["mics-fall/3/result/run.h5"],
    "own_block": ["cross.txt", "mics-crosses/report.html"],
    "reef_in_current": ["slope.txt", "mics-reef/run.h5", "reef.vtm"],
}


def install(folder: Path) -> None:
    """What a reader finds in the folder of mics: the program, its cases, Python and the tools."""
    (folder / "mics").symlink_to(ROOT / "mics")
    shutil.copytree(ROOT / "input", folder / "input")
    for name, words in (("python", ""), ("mics-tools", "-m micstools.cli ")):
        text = f'#!/bin/sh\nexec "{sys.executable}" {words}"$@"\n'
        program(folder / ".venv" / "bin" / name, text)


def follow(page: Path, folder: Path) -> str:
    """Do what a page says, in a folder; all that was said."""
    said = ""
    for language, text in fences(page):
        if language == "fortran":
            named = re.match(r"! (\w+\.nml)\n", text)
            assert named, f"a case without its name: {text}"
            (folder / named[1]).write_text(text)
            continue
        words = {"sh": ["sh", "-e", "-c"], "python": [".venv/bin/python", "-c"]}[language]
        done = subprocess.run(
            [*words, text],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=200,
            env={**os.environ, "PYTHONPATH": str(ROOT / "tools"), "OMP_NUM_THREADS": "1"},
        )
        assert done.returncode == 0, f"{text}\n{done.stdout}"
        said += done.stdout
    return said


@needs_mics
@pytest.mark.cost(15)
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_tutorial_works(page: Path, tmp_path: Path) -> None:
    install(tmp_path)
    said = follow(page, tmp_path)
    for pattern in SAID[page.stem]:
        assert re.search(pattern, said), f"{pattern}\n{said}"
    assert [name for name in MADE[page.stem] if not (tmp_path / name).is_file()] == []
    assert f"](docs/tutorials/{page.name})" in (ROOT / "README.md").read_text()


NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))


@needs_mics
@pytest.mark.cost(15)
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "tools"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=300, resources=resources).execute()
    shown = [" ".join(str(out.get("data", out.get("text"))) for out in c.outputs) for c in cells]
    assert "image/png" in " ".join(shown) and "Dataset" not in shown[0]
    assert "<table" in shown[0] and "Coulomb" in shown[1] and "time of the run" not in shown[0]
    assert "heading_deg" in shown[3] and "10 runs" in " ".join(shown)
    assert f"](docs/tutorials/{path.name})" in (ROOT / "README.md").read_text()
