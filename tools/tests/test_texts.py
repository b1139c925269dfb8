"""README, guide, gallery, architecture and all other texts: what they show works, what they name is
there, the stages of a step are those of its code, the version to cite is that of the program."""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fences import fences
from micstools import cli
from micstools.cases import settings
from micstools.reading.reader import Run
from packages import HEIGHT, TOP

ROOT = Path(__file__).parents[2]
TEXTS = ["README.md", "docs/guide.md", "docs/gallery.md"]
GALLERY = ROOT / "docs" / "gallery.md"
PAGES = ["README.md", "CONTRIBUTING.md", "CITATION.cff", "verification/README.md"]
PAGES += sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))
PAGES += sorted(str(page.relative_to(ROOT)) for page in ROOT.glob("verification/cases/*/README.md"))
FOLDERS = ("src", "docs", "tools", "input", "verification")

# A path from the top, as `src/grid/grid.f90`, or, for Fortran, from src, as `grid/grid.f90`.
FROM_TOP = re.compile(rf"(?<![\w/.:-])(?:{'|'.join(FOLDERS)})/[\w./*-]*\w")
FROM_SRC = re.compile(rf"(?<![\w/.-])(?:{'|'.join(sorted(HEIGHT.keys() - {TOP}))})/[\w*]+\.f90")
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")
WORDS = {
    "README.md": 1800,
    "docs/theory.md": 6000,
    "docs/glossary.md": 600,
    "docs/decisions/*.md": 1300,
}
"""The most words of a text."""
VERSIONS = {
    "Makefile": r"^VERSION := (.*)$",
    "CITATION.cff": r"^version: (.*)$",
    "pyproject.toml": r'^version = "(.*)"$',
    "CHANGELOG.md": r"^## \[(\d.*)\]",
}
"""Where the version stands; in the changelog that of the newest release."""
MADE = ("verification/report",)  # by a run, not in the repository
STEP = (ROOT / "src/step.f90").read_text()
STAGES = 14


def missing(page: str, text: str) -> list[str]:
    """Paths in the text of a page that lead nowhere; those with NAME in them stand for any name."""
    found = set(FROM_TOP.findall(text)) | {f"src/{path}" for path in FROM_SRC.findall(text)}
    found = {path for path in found if "NAME" not in path and not path.startswith(MADE)}
    gone = [path for path in sorted(found) if not any(ROOT.glob(path))]
    here = (ROOT / page).parent
    return gone + [link for link in LINK.findall(text) if not (here / link).exists()]


@pytest.mark.parametrize("page", PAGES)
def test_every_file_named_is_there(page: str) -> None:
    assert missing(page, (ROOT / page).read_text()) == []


def test_a_file_that_is_gone_is_found() -> None:
    text = "`src/grid/gone.f90`, `grid/lost.f90`, `src/base/kinds.f90`, src/top*/a, cases/NAME"
    assert missing("README.md", text) == ["src/grid/gone.f90", "src/grid/lost.f90", "src/top*/a"]
    assert missing("docs/theory.md", "[a](no.md) [b](figures/pile.png)") == ["no.md"]


@pytest.mark.parametrize(("pattern", "most"), WORDS.items())
def test_texts_are_short(pattern: str, most: int) -> None:
    for page in ROOT.glob(pattern):
        assert len(page.read_text().split()) <= most, page


def test_one_version_is_built_cited_packed_and_described() -> None:
    found = {}
    for name, pattern in VERSIONS.items():
        line = re.search(pattern, (ROOT / name).read_text(), re.MULTILINE)
        assert line, name
        found[name] = line[1]
    assert len(set(found.values())) == 1, found


def test_head_calls_and_documentation_list_the_same_stages() -> None:
    head = re.findall(r"^!!     (\d+) +(\w+(?: \w+)?)  ", STEP, re.MULTILINE)
    calls = re.findall(r"^ +! (\d+) (.+)$", STEP, re.MULTILINE)
    page = (ROOT / "docs/architecture.md").read_text()
    table = re.findall(r"^\| (\d+) \| ([^|]+) \|", page, re.MULTILINE)
    assert [int(number) for number, _ in head] == list(range(1, STAGES + 1))
    assert calls == head
    assert table == head


def test_the_documentation_names_procedures_of_the_stages() -> None:
    page = (ROOT / "docs/architecture.md").read_text()
    for line in re.findall(r"^\| \d+ \|.+$", page, re.MULTILINE):
        files = [ROOT / name for name in re.findall(r"`(src/[\w/]+\.f90)`", line)]
        text = STEP + "".join(file.read_text() for file in files)
        text += (ROOT / "src/coupling/coupling.f90").read_text()
        text += (ROOT / "src/momentum/fluid_transport.f90").read_text()
        for name in re.findall(r"`([a-z_]+)`", line):
            assert re.search(rf"\b{name}\b", text), f"{name} of: {line[:40]}"


def test_every_case_has_its_picture_and_its_commands() -> None:
    text = GALLERY.read_text()
    cases = {path.name for path in (ROOT / "input").glob("*.nml")} - {"blocks_paper.nml"}
    assert set(re.findall(r"./mics < input/(\S+)", text)) == cases
    for figure in re.findall(r"\]\((figures/\S+)\)", text):
        assert (GALLERY.parent / figure).is_file()
    for _, commands in fences(GALLERY):
        case, folder = re.findall(r"input/(\S+)|plot (\S+)", commands)
        run = (ROOT / "input" / case[0]).read_text()
        assert settings.value(run, "run", "output") == folder[1]
        latest = float(re.findall(r"--times (?:\S+ )*?(\S+) --view", commands)[0])
        assert latest <= settings.value(run, "run", "t_end")


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
