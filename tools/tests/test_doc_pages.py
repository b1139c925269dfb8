"""The checks of the pages that `make docs` builds: a link or name that leads nowhere is found."""

from pathlib import Path, PurePosixPath

import pytest

from check_links import broken_links
from doc_pages import IN_SITE, ROOT, Links, Page, pages, with_links

PAGE = Page(PurePosixPath("docs/theory.md"), "page/theory")


def linked(text: str) -> tuple[str, list[str]]:
    """A text of docs/ with its links, and what is wrong with them."""
    links = Links(pages())
    return with_links(PAGE, text, links), links.problems


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("[x](../README.md)", "index.html"),
        ("[x](figures/pile.png)", "media/pile.png"),
        ("`src/grid/mixture.f90`", "module/mixture_m.html"),
        ("`grid/mixture.f90`", "module/mixture_m.html"),
        ("`mixture.f90`", "module/mixture_m.html"),
        ("`src/mics.f90`", "program/mics.html"),
        ("`input/blocks.nml`", "files/input/blocks.nml"),
    ],
)
def test_names_become_links(text: str, url: str) -> None:
    found, problems = linked(text)
    assert problems == []
    assert found.endswith(f"]({IN_SITE}/{url})")


@pytest.mark.parametrize("text", ["[x](../NOTHING.md)", "`grid/nothing.f90`", "`nothing.f90`"])
def test_names_of_no_file_are_found(text: str) -> None:
    found, problems = linked(text)
    assert found == text
    assert len(problems) == 1


@pytest.mark.parametrize(
    "text",
    [
        "[x](https://example.org/a.md)",
        "[x](#part)",
        "`case.nml`",
        "`law_NAME.f90`",
        "```\n`no/file.f90`\n```",
    ],
)
def test_what_is_left_alone(text: str) -> None:
    assert linked(text) == (text, [])


def test_all_texts_name_files_that_are_there() -> None:
    links = Links(pages())
    for page in pages():
        with_links(page, (ROOT / page.source).read_text(), links)
    assert links.problems == []


@pytest.mark.parametrize(
    ("link", "problem"),
    [
        ('<a href="b.html">', ""),
        ('<a href="b.html#part">', ""),
        ('<a href="https://example.org">', ""),
        ('<a href="c.html">', "no such file: c.html"),
        ('<a href="../a.html">', "no such file: ../a.html"),
        ('<a href="b.html#other">', "no such part: b.html#other"),
        ('<img src="c.png">', "no such file: c.png"),
        ('<script src="https://example.org/x.js"></script>', "loaded from a server"),
    ],
)
def test_broken_links(link: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(link)
    (tmp_path / "b.html").write_text('<p id="part">')
    found = broken_links(tmp_path)
    assert len(found) == (1 if problem else 0)
    assert all(problem in line for line in found)
