"""A change of a group leaves everything else as it stands: any layout, remarks anywhere."""

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import settings as settings_of_hypothesis
from hypothesis import strategies as some

from micstools import Case
from micstools.cases import settings
from micstools.reading import namelist
from micstools.reading.reader import BadRun

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
