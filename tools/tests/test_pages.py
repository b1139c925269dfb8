"""Files that the pages name are there, and the version to cite is that of the program."""

import re
from pathlib import Path

import pytest

from packages import HEIGHT, TOP

ROOT = Path(__file__).parents[2]
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
