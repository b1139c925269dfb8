"""README, guide, gallery, architecture and all other texts: what they show works, what they name
is there, stages, versions and constants are those of the sources, links of built pages are good."""

import re
import tomllib
from pathlib import Path, PurePosixPath

import pytest

from calls import ROOT, needs_mics, python
from check_links import broken_links
from doc_pages import IN_SITE, Links, Page, pages, with_links
from fences import fences
from micstools import cli
from micstools.cases import settings
from micstools.commands.base import Parser
from micstools.reading.reader import Run
from packages import HEIGHT, TOP

TEXTS = ["README.md", "docs/guide.md", "docs/gallery.md"]
GALLERY = ROOT / "docs" / "gallery.md"
ROWS = tomllib.loads(Path(__file__).with_name("texts.toml").read_text())
PAGES = ["README.md", "CONTRIBUTING.md", "CITATION.cff", "verification/README.md"]
PAGES += sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))
PAGES += sorted(str(page.relative_to(ROOT)) for page in ROOT.glob("verification/cases/*/README.md"))
FOLDERS = ("src", "docs", "tools", "input", "verification")

# A path from the top, as `src/grid/grid.f90`, or, for Fortran, from src, as `grid/grid.f90`.
FROM_TOP = re.compile(rf"(?<![\w/.:-])(?:{'|'.join(FOLDERS)})/[\w./*-]*\w")
FROM_SRC = re.compile(rf"(?<![\w/.-])(?:{'|'.join(sorted(HEIGHT.keys() - {TOP}))})/[\w*]+\.f90")
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")
VERSIONS = ROWS["versions"]
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


@pytest.mark.parametrize(("pattern", "most"), ROWS["words"].items())
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


@needs_mics
def test_the_example_in_python_runs(loose_pile: Run, tmp_path: Path) -> None:
    (example,) = [
        text for language, text in fences(ROOT / "docs" / "guide.md") if language == "python"
    ]
    (tmp_path / "input").symlink_to(ROOT / "input")
    (tmp_path / "mics-coarse").symlink_to(loose_pile.folder)
    done = python("-c", example, cwd=tmp_path)
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
        known = Parser(name)._option_string_actions
        for option in re.findall(r"--[a-z-]+", words):
            assert option in known, f"mics-tools {name} {option}"


def test_the_table_of_tools_holds_tools() -> None:
    text = (ROOT / "docs" / "guide.md").read_text().partition("| command |")[2].partition("\n\n")[0]
    rows = [line.split("|")[1] for line in text.splitlines()[2:]]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert len(named) > 10
    assert named <= set(cli.COMMANDS)


PAGE = Page(PurePosixPath("docs/theory.md"), "page/theory")


def linked(text: str) -> tuple[str, list[str]]:
    """A text of docs/ with its links, and what is wrong with them."""
    links = Links(pages())
    return with_links(PAGE, text, links), links.problems


@pytest.mark.parametrize(("text", "url"), ROWS["links"])
def test_names_become_links(text: str, url: str) -> None:
    found, problems = linked(text)
    assert problems == []
    assert found.endswith(f"]({IN_SITE}/{url})")


@pytest.mark.parametrize("text", ["[x](../NOTHING.md)", "`grid/nothing.f90`", "`nothing.f90`"])
def test_names_of_no_file_are_found(text: str) -> None:
    found, problems = linked(text)
    assert found == text
    assert len(problems) == 1


@pytest.mark.parametrize("text", ROWS["alone"])
def test_what_is_left_alone(text: str) -> None:
    assert linked(text) == (text, [])


def test_all_texts_name_files_that_are_there() -> None:
    links = Links(pages())
    for page in pages():
        with_links(page, (ROOT / page.source).read_text(), links)
    assert links.problems == []


@pytest.mark.parametrize(("link", "problem"), ROWS["broken"])
def test_broken_links(link: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(link)
    (tmp_path / "b.html").write_text('<p id="part">')
    found = broken_links(tmp_path)
    assert len(found) == (1 if problem else 0)
    assert all(problem in line for line in found)


LIST = ROOT / "docs" / "constants.md"
DECLARED = re.compile(r"^ *real\([ws]p\), parameter(?:, \w+)* :: (.*)$", re.MULTILINE)
ROW = re.compile(r"^\| `([\w/]+\.f90)` `(\w+)` \| `([^`]+)` \|(.*)\|$", re.MULTILINE)
NO_CONSTANTS = {
    "base/kinds.f90": {"pi"},
    # what follows from geometry alone
    "shapes/armour_units.f90": {"cosine", "sine"}, "shapes/shapes_builtin.f90": {"golden"},
    "shapes/contact_sphere_placement.f90": {"turn"},
    # marks for "none"
    "shapes/surface_search.f90": {"nowhere"}, "case/case_types.f90": {"absent"},
    "liquid/extended_fraction.f90": {"unknown"}, "liquid/liquid_fill.f90": {"no_surface"},
    "grid/outflow.f90": {"elsewhere"}, "coupling/voxels.f90": {"no_hit"},
    "momentum/surface_heights.f90": {"no_height"},
}  # fmt: skip


def declared(text: str) -> dict[str, str]:
    """Single real constants of a source with their values, without the kind of the literals."""
    text = re.sub(r"&[ \t]*(?:!.*)?\n\s*", "", text)
    found = {}
    for line in DECLARED.findall(text):
        names = re.split(r",\s*(?=\w+(?:\([^)]*\))?\s*=[^=])", line.split("!")[0])
        for name, value in (each.split("=", 1) for each in names):
            if "(" not in name:
                found[name.strip()] = re.sub(r"_[ws]p\b", "", value).strip()
    return found


def constants(source: Path) -> dict[tuple[str, str], str]:
    """All that the page has to explain."""
    found = {}
    for path in sorted(source.rglob("*.f90")):
        file = str(path.relative_to(source))
        for name, value in declared(path.read_text()).items():
            if name not in NO_CONSTANTS.get(file, set()):
                found[file, name] = value
    return found


def explained(page: str) -> dict[tuple[str, str], str]:
    """Constants of the page with their values."""
    return {(file, name): value for file, name, value, _ in ROW.findall(page)}


def test_every_constant_is_on_the_page() -> None:
    found, told = constants(ROOT / "src"), explained(LIST.read_text())
    assert sorted(found.keys() - told.keys()) == [], "missing on the page"
    assert sorted(told.keys() - found.keys()) == [], "no longer in src"
    other = {key: (told[key], found[key]) for key in found if told[key] != found[key]}
    assert other == {}, "page and src differ"


def test_every_row_is_complete() -> None:
    """No cell is empty, and what is no constant is still there."""
    for file, name, _, rest in ROW.findall(LIST.read_text()):
        assert all(cell.strip() for cell in rest.split("|")), f"{file} {name}"
    for file, names in NO_CONSTANTS.items():
        assert names <= declared((ROOT / "src" / file).read_text()).keys(), file


def test_constants_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.f90").write_text(
        "  real(wp), parameter :: one = 1.0_wp/3.0_wp, two = max(1.0_wp, 2.0_wp)   !! three = 3\n"
        "  real(wp), parameter, public :: four = &   ! of\n    4.0e-2_wp\n"
        "  real(wp), parameter :: table(2) = [1.0_wp, 2.0_wp]\n"
        "  integer, parameter :: five = 5\n    real(sp), parameter :: six = 6.0_sp\n"
    )
    assert constants(tmp_path) == {
        ("a.f90", "one"): "1.0/3.0",
        ("a.f90", "two"): "max(1.0, 2.0)",
        ("a.f90", "four"): "4.0e-2",
        ("a.f90", "six"): "6.0",
    }
