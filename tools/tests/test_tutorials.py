"""The tutorials work as they stand: cases are saved, commands and programs run in their order; so
does the notebook, which is kept without output."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from calls import ROOT, needs_mics, program
from fences import fences

PAGES = sorted((ROOT / "docs").glob(os.environ.get("PAGES", "tutorials/*.md")))
EXPECTED = tomllib.loads(Path(__file__).with_name("tutorials.toml").read_text())


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
            timeout=3000 if page.stem == "gallery" else 200,
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
    for pattern in EXPECTED[page.stem]["said"]:
        assert re.search(pattern, said), f"{pattern}\n{said}"
    assert [name for name in EXPECTED[page.stem]["made"] if not (tmp_path / name).is_file()] == []
    assert f"]({page.relative_to(ROOT)})" in (ROOT / "README.md").read_text()


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
