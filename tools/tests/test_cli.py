"""`mics-tools`: commands help, refuse wrong use in one line, and set variables of a case."""

import os
import pty
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from calls import ROOT, mics_tools, python
from calls import program as stand_in
from micstools import cli
from micstools.cases import program as program_of_tools
from micstools.cases import settings
from micstools.reading.reader import BadRun, Run
from synthetic import Motion, write_run
from test_height_maps import ESRI

CASE = """\
! A case with a / and a & in a remark
&run title = 'a / b & c' t_end = 1.0 /
&grid cells = 1, 1, 1 length = 1.0, 1.0, 1.0 /
&drop shape = 'a' position = 0,0,0 ! first / of two
  seed = 3 /
&drop shape = 'b' position = 0,0,0 /
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """In place of mics: says how it was called and the case it got, refuses friction 9."""
    return stand_in(
        tmp_path / "a program",
        '#!/bin/sh\nread -r line\necho "$@: $line"\ngrep -q "friction = 9" && '
        "{ echo 'mics: &contact friction = 9: too much' >&2; exit 2; }\nexit 0\n",
    )


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_helps_with_examples(name: str, capsys) -> None:
    assert mics_tools([name, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"mics-tools {name}" in said.split("examples:")[1]


REFUSED = tomllib.loads(Path(__file__).with_name("refusals.toml").read_text())


@pytest.mark.parametrize("words", REFUSED)
def test_wrong_use_is_one_line(
    words: str, loose_pile: Run, program: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "CASE").write_text(CASE.replace("0,0,0", "0,0,0 spread = 0.1,0.1,0"))
    (tmp_path / "MAP.asc").write_text(ESRI)
    places = {"RUN": loose_pile.folder, "PROGRAM": program, "MAP": tmp_path / "MAP.asc"}
    places |= {name: tmp_path / name for name in ("CASE", "NEW")}
    assert mics_tools([str(places.get(word, word)) for word in shlex.split(words)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mics-tools") and REFUSED[words] in line, line
    assert not (tmp_path / "NEW").exists()


def test_settings_keep_the_rest_of_a_case() -> None:
    words = "drop.seed=9 contact.friction=0.4 grid.cells=2,3,4 run.title=it's run.x=true"
    text = settings.set_variables(CASE, map(settings.parse, words.split()))
    groups = [name for name, _, _ in settings.groups(text)]
    assert groups == ["run", "grid", "drop", "drop", "contact"]
    assert [settings.value(text, "drop", "seed", n) for n in (0, 1)] == [9, 10]
    assert "cells = 2, 3, 4 length" in text and "friction = 0.4" in text
    assert "! first / of two" in text and '"it\'s"' in text and "x = .true." in text


def test_every_drop_gets_a_seed_of_its_own(tmp_path: Path, capsys) -> None:
    """With one seed two groups of drops would draw the same numbers."""
    three = CASE + "&drop shape = 'c' position = 0,0,0 seed = 3 /\n"
    case = tmp_path / "case.nml"
    case.write_text(three)
    text = program_of_tools.case_text(case, ["drop.seed=7"])
    assert [settings.value(text, "drop", "seed", n) for n in range(3)] == [7, 8, 9]
    assert "&drop seed = 7, 8, 9: one for each of the 3 groups" in capsys.readouterr().err
    text = program_of_tools.case_text(case, ["drop.count=5"])
    assert [settings.value(text, "drop", "count", n) for n in range(3)] == [5, 5, 5]
    case.write_text(CASE.rsplit("&drop", 1)[0])
    one = program_of_tools.case_text(case, ["drop.seed=7"])
    assert settings.value(one, "drop", "seed") == 7 and capsys.readouterr().err == ""


def test_one_group_of_several_is_set() -> None:
    text = settings.set_group(CASE, "drop", {"seed": 8}, occurrence=1)
    assert "seed = 3 /" in text and text.index("seed = 8") > text.index("'b'")


def test_a_variable_is_taken_out() -> None:
    """The others stay as they were written, with their remarks."""
    text = (
        "&drop a = 1, 2,\n  3  ! of a\n  b = 'c = 4 / !', c = 5  ! kept\n  d = 6 /\n&drop c = 7 /"
    )
    for name, n, words in ("a", 0, "a = 1, 2,\n  3  "), ("d", 0, "d = 6 "), ("c", 1, "c = 7 "):
        assert settings.set_group(text, "drop", {name: None}, n) == text.replace(words, "")
    left = settings.set_group(text, "drop", {"c": None}, 0)
    assert [settings.value(left, "drop", name) for name in "bc"] == ["c = 4 / !", None]


TORN = "&drop a = 0.5*0.02 /"


@pytest.mark.parametrize(
    ("work", "said"),
    [
        (lambda: settings.value(TORN, "drop", "a"), "&drop a = 0.5.0.02 /: cannot be understood"),
        (lambda: settings.set_group(TORN, "drop", {"c": 1}), "0.5.0.02 /: cannot be understood"),
        (lambda: settings.set_group(CASE, "drop", {"a": None}, 2), "&drop 3: no such group"),
        (lambda: settings.variables("&grid cells = 3\n&drop b=1 &body /"), "must be one group"),
    ],
)
def test_a_group_that_cannot_be_read_is_told(work: Callable[[], object], said: str) -> None:
    with pytest.raises(BadRun, match=said):
        work()


@pytest.mark.parametrize("word", ["", "a", "a.b", "a.b=", "a b.c=1", "=3", "a.b.c=1"])
def test_a_setting_has_a_form(word: str) -> None:
    with pytest.raises(BadRun, match="must be group.variable=value"):
        settings.parse(word)


def test_choices_are_single_values() -> None:
    found = settings.parse_choices("contact.friction=0.4,0.6")
    assert [(s.name, s.value) for s in found] == [("contact.friction", v) for v in (0.4, 0.6)]


def test_the_program_gets_the_case_as_set(tmp_path: Path, program: Path) -> None:
    case = tmp_path / "my case.nml"
    case.write_text(CASE)
    words = ("check", case, "--program", program, "--set")
    done = python("-m", "micstools.cli", *words, "grid.cells=2,3,4")
    assert done.returncode == 0 and done.stdout.startswith("--check --plan ")
    assert done.stdout.endswith("/run.h5: ! A case with a / and a & in a remark\n")
    done = python("-m", "micstools.cli", *words, "contact.friction=9")
    assert (done.returncode, done.stderr) == (2, "mics: &contact friction = 9: too much\n")


def test_a_run_goes_on_and_keeps_its_time(tmp_path: Path, program: Path) -> None:
    case = tmp_path / "case.nml"
    case.write_text(CASE)
    more = ("--restart", "mics-out/restart-a.h5", "--max-wall", "01:30", "--quiet")
    for last in (), ("--set", "grid.cells=2,3,4"):
        words = ("micstools.cli", "run", case, "--program", program, *more, *last)
        done = python("-m", *words)
        assert done.returncode == 0
        assert done.stdout.startswith("--restart mics-out/restart-a.h5 --max-wall 01"), done.stdout


@pytest.mark.parametrize(
    ("more", "stdin", "variable"),
    [("", None, ""), ("", None, "CI"), ("", subprocess.DEVNULL, ""), ("--no-browser", None, ""),
     ("--quiet", None, "")],
)  # fmt: skip
def test_a_run_ends_with_its_page(
    more: str, stdin: int | None, variable: str, tmp_path: Path
) -> None:
    """Its path is told; where somebody sits before it, it is opened."""
    write_run(tmp_path / "done", Motion(t_end=0.1))
    (tmp_path / "case.nml").write_text(CASE)
    mics = stand_in(tmp_path / "mics", "#!/bin/sh\ncp -r done mics-out\n")
    browser = stand_in(tmp_path / "browser", f'#!/bin/sh\necho "$1" > {tmp_path}/opened\n')
    env = {k: v for k, v in os.environ.items() if k != "CI"} | {"BROWSER": str(browser)}
    env |= {"PYTHONPATH": str(ROOT / "tools"), variable or "MICS": str(mics)}
    ours, its = pty.openpty()
    words = [sys.executable, "-m", "micstools.cli", "run", "case.nml", "--program", mics]
    where = {"cwd": tmp_path, "env": env, "stdin": stdin or its, "stdout": its}
    assert subprocess.run([*words, *more.split()], **where).returncode == 0
    page, opened = tmp_path / "mics-out" / "report.html", tmp_path / "opened"
    assert page.exists() == (more != "--quiet")
    assert not page.exists() or b"mics-out/report.html (" in os.read(ours, 4096)
    assert opened.exists() == (not more + variable and stdin is None)
    assert not opened.exists() or opened.read_text().strip() == page.as_uri()
    os.close(ours)
    os.close(its)


def test_the_program_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Named, in MICS, that of the sources, on the path, beside the case or one folder above."""
    monkeypatch.setattr(program_of_tools, "BUILT", tmp_path / "nowhere" / "mics")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delenv("MICS", raising=False)
    case = tmp_path / "work" / "input" / "case.nml"
    with pytest.raises(BadRun, match="run make, set MICS, put it on the PATH"):
        program_of_tools.find(None, case)
    places = ("work/mics", "work/input/mics", "bin/mics", "nowhere/mics", "mine")
    for place in places[:4]:
        found = stand_in(tmp_path / place, "")
        assert program_of_tools.find(None, case) == found, place
    monkeypatch.setenv("MICS", str(stand_in(tmp_path / "mine", "")))
    assert program_of_tools.find(None, case) == tmp_path / "mine"
    assert program_of_tools.find(tmp_path / "bin/mics", case) == tmp_path / "bin/mics"
    monkeypatch.setenv("MICS", str(tmp_path / "gone"))
    with pytest.raises(BadRun, match=r"MICS = .*gone: is no program"):
        program_of_tools.find(None, case)
