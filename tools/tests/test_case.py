"""Cases as Python values: groups, units, files that keep their remarks, and runs of the program."""

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as settings_of_hypothesis
from hypothesis import strategies as some

from micstools import Case, Run
from micstools.cases import case as cases
from micstools.cases import settings
from micstools.reading import namelist
from micstools.reading.reader import BadRun

ROOT = Path(__file__).parents[2]
TEXT = """\
! A cube falls dry; a / and a & in a remark
&run title = 'it''s a / b & c' t_end = 0.2  physics = 'dry' dt = 0.01 output = 'out' /
&grid cells = 8, 8, 8 length = 0.2, 0.2, 0.2 /   ! the tank
&shape name = 'cube' kind = 'cube' size = 0.02 /
&body shape = 'cube' position = 0.05, 0.05, 0.0101 fixed = .true. /
&drop shape = 'cube'  ! the first
  position = 0.1, 0.1, 0.03 seed = 3 /
&drop shape = 'cube' position = 0.15, 0.1, 0.03 first_time = 0.1 /
"""


@pytest.fixture
def case() -> Case:
    return Case(TEXT)


def test_groups_are_attributes_and_lists(case: Case) -> None:
    assert case.run.t_end == 0.2 and case.run.title == "it's a / b & c"
    assert case.grid.cells == [8, 8, 8] and case.contact.friction == 0.6  # a default
    assert [drop.first_time for drop in case.drop] == [0, 0.1]
    assert case.body[0].fixed is True and case.fluid.water_level is None
    assert {"run", "drop", "contact"} <= set(dir(case))


def test_units_and_meanings_come_from_the_schema(case: Case) -> None:
    assert "[s]" in case.run.about("t_end") and "default 0.01" in case.run.about("dt")
    assert "'coupled'" in type(case.run).physics.__doc__
    assert "t_end: the simulated time [s]" in type(case.run).__doc__
    known = {name: set(cases.variables(name)) for name in cases.schema()["properties"]}
    assert all(known.values()) and {"position", "spread"} <= known["drop"]


def test_an_unchanged_case_is_the_same_text(case: Case) -> None:
    assert case.text == TEXT
    for path in sorted((ROOT / "input").glob("*.nml")):
        assert Case.read(path).text == settings.read(path), path


def test_changes_keep_the_rest(case: Case, tmp_path: Path) -> None:
    case.run.t_end = 0.4
    case.grid.cells = (4, 4, 4)
    case.drop[0].seed = 9
    case.contact.friction = 0.4
    case.drop.add(shape="cube", position=[0.1, 0.15, 0.05])
    del case.drop[1]
    path = case.write(tmp_path / "new.nml")
    text = path.read_text()
    assert "! A cube falls dry" in text and "! the first" in text and "! the tank" in text
    again = Case.read(path)
    assert again.run.t_end == 0.4 and again.grid.cells == [4, 4, 4]
    assert again.contact.friction == 0.4 and again.run.title == case.run.title
    assert [d.position for d in again.drop] == [[0.1, 0.1, 0.03], [0.1, 0.15, 0.05]]
    assert again.drop[0].seed == 9


def test_a_variable_goes_back_to_its_default(case: Case) -> None:
    del case.run.dt
    assert case.run.dt == 0.01 and "dt" not in Case(case.text).run.given
    assert Case(case.text).run.title == case.run.title


def test_groups_of_one_text_are_told_apart() -> None:
    """Two that are equal: the second is taken out."""
    twice = TEXT + "&body shape = 'cube' position = 0.05, 0.05, 0.0101 fixed = .true. /\n"
    case = Case(twice)
    assert case.body[0] == case.body[1] and case.body[0] != case.drop[0]
    del case.body[1]
    assert case.text.count("&body") == 1


@pytest.mark.parametrize(
    ("work", "said"),
    [
        (lambda c: c.run.tend, "&run has no variable tend: is t_end meant?"),
        (lambda c: setattr(c.contact, "fricton", 1), "no variable fricton: is friction meant?"),
        (lambda c: c.drops, "a case has no group drops: is drop meant?"),
        (lambda c: setattr(c, "drop", []), "change the list"),
    ],
)
def test_wrong_names_name_the_nearest(case: Case, work, said: str) -> None:
    with pytest.raises(AttributeError, match=said.replace("?", r"\?")):
        work(case)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("&dorp /", "&dorp: there is no such group: is drop meant?"),
        ("&run tend = 1 /", "&run has no variable tend"),
        ("&run t_end = 1 /\n&run t_end = 2 /", "&run stands twice"),
    ],
)
def test_a_text_that_is_no_case_is_told(text: str, said: str) -> None:
    with pytest.raises(BadRun, match=said.replace("?", r"\?")):
        Case(text)


def test_a_case_is_shown(case: Case) -> None:
    assert repr(case).startswith("Case it's a / b & c\n  &run title, t_end")
    assert repr(case.drop[1]) == "drop(shape='cube', position=[0.15, 0.1, 0.03], first_time=0.1)"
    shown = case._repr_html_()
    assert "<table>" in shown and "it&#x27;s a / b &amp; c" in shown
    assert "<b>seed</b>" in case.drop[0]._repr_html_() and "&amp;drop" in case.drop._repr_html_()


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    if not os.access(ROOT / "mics", os.X_OK):
        pytest.skip("./mics is not built")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.chdir(tmp_path)
    return ROOT / "mics"


def test_a_case_is_checked_and_run(case: Case, program: Path) -> None:
    plan = case.check()
    assert "time of the run" in plan and repr(plan) == str(plan)
    run = case.run()
    assert isinstance(run, Run) and run.folder == Path("out")
    assert run.bodies.time[-1] == pytest.approx(0.2)
    assert case.run(output="other", threads=1).folder == Path("other")
    case.contact.friction = -1
    case.drop[0].shape = "ball"
    for work in (case.check, case.run):
        with pytest.raises(BadRun) as error:
            work()
        assert "&contact friction = -1" in str(error.value) and "ball" in str(error.value)


def test_files_beside_the_case_are_found(case: Case, program: Path, tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "bed.txt").write_text("2 2 0 0 0.2 0.2\n0.0001 0.0001 0.0001 0.0001\n")
    case.bed.file = "bed.txt"
    assert "bed.txt" in Case.read(case.write(folder / "case.nml")).check()


def test_an_ensemble_of_a_case(case: Case, program: Path, capsys) -> None:
    for drop in case.drop:
        drop.spread = [0.005, 0.005, 0.0]
    found = case.ensemble(2, out="many", jobs=1, vary={"contact.friction": [0.4, 0.6]})
    assert len(found) == 4 and set(found.table["contact.friction"]) == {0.4, 0.6}
    assert [run.bodies.n for run in found] == [3] * 4
    lying = found.places
    assert len(lying) == 12 and lying.groupby("contact.friction").run.nunique().tolist() == [2, 2]
    assert "4 runs" in repr(found) and "<table" in found._repr_html_()
    first, *_ = found
    assert np.ptp([r.bodies.position[0, 1, 0] for r in found]) > 0 and first.bodies.n == 3
    with pytest.raises(BadRun, match="give another --out"):
        case.run.t_end = 0.3
        case.ensemble(2, out="many", jobs=1, vary={"contact.friction": [0.4, 0.6]})


NAMES = ("a", "place", "place_b")
plain = some.text("abc &/!=*,.0'", min_size=1, max_size=6).map(lambda text: text.strip() or "a")
numbers = some.integers(-99, 99) | some.floats(-9, 9).map(lambda v: round(v, 4))
values = plain | some.booleans() | some.lists(numbers, min_size=1, max_size=4)
gaps = some.sampled_from([" ", "  ", "\n  "])


@some.composite
def groups(draw: some.DrawFn) -> str:
    """The text of a group, with numbered remarks between its values."""
    remarks = 0

    def gap() -> str:
        nonlocal remarks
        if draw(some.booleans()):
            return draw(gaps)
        remarks += 1
        return f" ! <{remarks}> a = 'b' / &c\n "

    said = "&drop" + gap()
    for name in draw(some.lists(some.sampled_from(NAMES), max_size=4, min_size=1)):
        words = [settings._word(v) for v in all_of(draw(values))]
        if draw(some.booleans()):
            words = [f"{draw(some.integers(1, 3))}*{words[0]}", *words[1:]]
        comma = draw(some.sampled_from([",", ", ", " "]))
        said += (
            f"{name} = " + words[0] + "".join(comma + gap() + word for word in words[1:]) + gap()
        )
    return said + "/"


def all_of(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def written(text: str, name: str) -> list[str]:
    return [text[a.start : a.stop] for a in settings._assignments(text) if a.name == name]


def remarks(text: str) -> list[str]:
    return sorted(re.findall(r"! <\d+>.*", text))


@settings_of_hypothesis(max_examples=400, deadline=None, database=None)
@given(groups(), some.dictionaries(some.sampled_from(NAMES), some.none() | values, min_size=1))
def test_a_change_is_the_change_alone(text: str, wanted: dict[str, Any]) -> None:
    before = dict(namelist.read(text)["drop"])
    new = settings.patched(text, wanted)
    found = namelist.read(new)["drop"]
    alone = {name: value[0] if all_of(value)[1:] == [] and isinstance(value, list) else value
             for name, value in {**before, **wanted}.items() if value is not None}  # fmt: skip
    assert found == alone
    assert remarks(new) == remarks(text)
    assert settings.patched(new, wanted) == new
    for name in set(before) - set(wanted):
        assert written(new, name) == written(text, name)


def test_a_list_typed_with_a_pause_keeps_all_remarks() -> None:
    text = "&drop shape = 'c'  ! why\n  position = 0.1, 0.2, 0.3  ! place\n  count = 2 ! many\n/\n"
    half = settings.set_group(text, "drop", {"position": [0.5, 0.5]})
    whole = settings.set_group(half, "drop", {"position": [0.5, 0.5, 0.3]})
    assert half == text.replace("0.1, 0.2, 0.3", "0.5, 0.5")
    assert whole == text.replace("0.1, 0.2, 0.3", "0.5, 0.5, 0.3")
    case = Case(text)
    del case.drop[0].count
    assert case.text == text.replace("count = 2 ", "")


@pytest.mark.parametrize(
    "words", ["999999999*0.1", "1001*1", "0*1", "9999999999999999999*'a'", "a(99999999) = 1"]
)
def test_what_would_fill_the_memory_is_refused(words: str) -> None:
    for work in (settings.variables, lambda text: settings.value(text, "drop", "a")):
        with pytest.raises(BadRun, match="repeat count must be 1 to 1000|have no index"):
            work(f"&drop b = 1 a = {words} /")
