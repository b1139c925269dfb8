"""Variables of a case set from outside, `group.variable=value`, on a copy of its text."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import f90nml

from micstools.reading import namelist
from micstools.reading.reader import BadRun

_FORM = re.compile(r"([A-Za-z]\w*)\.([A-Za-z]\w*)\s*=(.*)", re.DOTALL)
_LOGICALS = {".true.": True, "true": True, ".false.": False, "false": False}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_STRINGS = re.compile(r"'[^'\n]*'|\"[^\"\n]*\"|![^\n]*|\xa0")
_PIECES = re.compile(
    r"![^\n]*|(?P<name>[A-Za-z]\w*)\s*=|(?P<word>(?:\d+\*)?(?:'[^'\n]*'|\"[^\"\n]*\")+|[^\s,'\"!/=]+)"
)
_TOKENS = re.compile(r"'[^']*'|\"[^\"]*\"|![^\n]*|&\s*\w+|/")


@dataclass(frozen=True)
class Setting:
    """One variable and its value: numbers, logicals or text, a list where there are several."""

    group: str
    variable: str
    value: Any

    @property
    def name(self) -> str:
        """As in `contact.friction`."""
        return f"{self.group}.{self.variable}"


def read(path: Path) -> str:
    """The text of a case file as the program takes it: UTF-8, else Latin-1, without a byte-order
    mark."""
    data = path.read_bytes()
    if b"\0" in data:
        raise BadRun(f"{path}: is no text")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return plain(text)


def plain(text: str) -> str:
    """Lines that end as ours; blanks that do not break are blanks, but in strings."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return _STRINGS.sub(lambda found: " " if found[0] == "\xa0" else found[0], text)


def parse(word: str) -> Setting:
    """`group.variable=value`; several values are parted by commas."""
    group, variable, text = _parts(word)
    values = [_value(part) for part in _split(text)]
    return Setting(group, variable, values if len(values) > 1 else values[0])


def parse_choices(word: str) -> list[Setting]:
    """`group.variable=a,b,c`: a setting for each value."""
    group, variable, text = _parts(word)
    return [Setting(group, variable, _value(part)) for part in _split(text)]


def _parts(word: str) -> tuple[str, str, str]:
    found = _FORM.fullmatch(word.strip())
    if not found or not found[3].strip():
        raise BadRun(f"'{word}': must be group.variable=value, as in contact.friction=0.4")
    return found[1].lower(), found[2].lower(), found[3]


def _split(text: str) -> list[str]:
    return [text] if text.strip()[0] in "'\"" else text.split(",")


def _value(text: str) -> Any:
    text = text.strip()
    if text.lower() in _LOGICALS:
        return _LOGICALS[text.lower()]
    if _NUMBER.fullmatch(text):
        if text.lstrip("+-").isdigit():
            return int(text)
        return float(text.lower().replace("d", "e"))
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "'\"" else text


def groups(text: str) -> list[tuple[str, int, int]]:
    """Every group of a case in order: its name, where its `&` stands and where it ends."""
    found, name, start = [], "", -1
    for token in _TOKENS.finditer(text):
        if token[0][0] == "&" and start < 0:
            name, start = token[0][1:].strip().lower(), token.start()
        elif token[0] == "/" and start >= 0:
            found.append((name, start, token.end()))
            start = -1
    return found


def set_variables(text: str, settings: Iterable[Setting]) -> str:
    """The case with all settings; one of a group that is repeated holds for each occurrence, but
    seeds of several &drop count up from the one that is set, or all would draw the same numbers."""
    wanted: dict[str, dict[str, Any]] = {}
    for setting in settings:
        wanted.setdefault(setting.group, {})[setting.variable] = setting.value
    for name, variables in wanted.items():
        text = set_group(text, name, variables)
    seed = wanted.get("drop", {}).get("seed")
    drops = sum(name == "drop" for name, _, _ in groups(text))
    if isinstance(seed, int) and not isinstance(seed, bool) and drops > 1:
        for n in range(1, drops):
            text = set_group(text, "drop", {"seed": seed + n}, n)
    return text


def set_group(
    text: str, name: str, variables: dict[str, Any], occurrence: int | None = None
) -> str:
    """Set variables of every group of a name, or of one, counted from 0; add it if there is none.
    One whose value is none is taken out, so that it has its default."""
    places = [(start, end) for group, start, end in groups(text) if group == name]
    if not places:
        return text.rstrip("\n") + "\n\n" + group_text(name, variables) + "\n"
    if occurrence is not None and not 0 <= occurrence < len(places):
        raise BadRun(f"&{name} {occurrence + 1}: no such group in the case")
    for start, end in reversed(places if occurrence is None else [places[occurrence]]):
        text = text[:start] + patched(text[start:end], variables) + text[end:]
    return text


@dataclass(frozen=True)
class _Assignment:
    """Where a variable and its values stand in the text of a group."""

    name: str
    start: int
    end: int  # of `name =`
    words: list[tuple[int, int]] = field(default_factory=list)

    @property
    def stop(self) -> int:
        """The end of the last value."""
        return self.words[-1][1] if self.words else self.end


def _assignments(group: str) -> list[_Assignment]:
    found: list[_Assignment] = []
    for piece in _PIECES.finditer(group, group.index("&") + 1):
        if piece["name"]:
            found.append(_Assignment(piece["name"].lower(), *piece.span()))
        elif piece["word"] and found:
            found[-1].words.append(piece.span())
    return found


def patched(group: str, variables: dict[str, Any]) -> str:
    """A group with variables set, or taken out where their value is none; all else, every remark
    among it, stays as it stands."""
    before = _variables(group)
    variables = {
        name: value[0] if isinstance(value, list) and len(value) == 1 else value
        for name, value in variables.items()
    }
    wanted = {**before, **variables}
    for name, value in variables.items():
        if before.get(name) != value:
            group = _with(group, name.lower(), value)
    if _variables(group) != {name: value for name, value in wanted.items() if value is not None}:
        words = " ".join(group.split())
        raise BadRun(f"{words[:60]}: {', '.join(variables)} cannot be changed, write the text")
    return group


def _with(group: str, name: str, value: Any) -> str:
    """A group with one variable set, or taken out."""
    values = value if isinstance(value, list) else [] if value is None else [value]
    new = [_word(v) for v in values]
    found = [a for a in _assignments(group) if a.name == name]
    for old in reversed(found[:-1] if new else found):  # where it stands twice, the last one counts
        group = group[: old.start] + _without(group, old)
    if not new:
        return group
    if not found:
        return _added(group, f"{name} = {', '.join(new)}")
    old = next(a for a in _assignments(group) if a.name == name)
    kept = min(len(new), len(old.words))
    if not kept:
        return group[: old.end] + f" {', '.join(new)}" + group[old.end :]
    new[kept - 1 :] = [", ".join(new[kept - 1 :])] if len(new) > kept else new[kept - 1 :]
    if kept < len(old.words):
        end = old.words[kept - 1][1]
        rest = "".join(f"  {remark}\n" for remark in _remarks(group[end : old.stop]))
        group = group[:end] + rest + group[old.stop :]
    for (start, end), word in reversed(list(zip(old.words, new, strict=False))):
        if _value(group[start:end]) != _value(word):
            group = group[:start] + word + group[end:]
    return group


def _without(group: str, old: _Assignment) -> str:
    """What follows an assignment, after the remarks between its values."""
    rest = group[old.stop :].lstrip(" \t,")
    if group[: old.start].rpartition("\n")[2].strip() == "" and rest.startswith("\n"):
        rest = rest[1:].lstrip(" \t")  # of a line that would be empty
    return "".join(f"{remark}\n" for remark in _remarks(group[old.start : old.stop])) + rest


def _remarks(text: str) -> list[str]:
    return [piece[0] for piece in _PIECES.finditer(text) if piece[0][0] == "!"]


def _added(group: str, words: str) -> str:
    """A group with one more assignment, on a line of its own if the `/` has one."""
    body, line, last = group[:-1].rpartition("\n")
    if not line or last.strip():
        return f"{group[:-1].rstrip(' ')} {words} /"
    start = next((a.start for a in reversed(_assignments(group))), 0)
    indent = group[:start].rpartition("\n")[2] if start else ""
    return f"{body}\n{indent if indent and not indent.strip() else '  '}{words}\n{last}/"


def _word(value: Any) -> str:
    """A value as f90nml writes it."""
    return group_text("a", {"b": value}).partition("=")[2].rpartition("/")[0].strip()


def _read(group: str) -> f90nml.Namelist:
    """A group as f90nml understands it."""
    try:
        return namelist.read(group)
    except ValueError as error:
        raise BadRun(f"{' '.join(group.split())[:60]}: cannot be understood ({error})") from error


def _variables(group: str) -> dict[str, Any]:
    return dict(next(iter(_read(group).values()), {}))


def variables(group: str) -> dict[str, Any]:
    """What the text of one group gives."""
    found = list(_read(group).values())
    if len(found) != 1:
        raise BadRun(f"{' '.join(group.split())[:60]}: must be one group")
    return dict(found[0])


def group_text(name: str, variables: dict[str, Any]) -> str:
    """The text of a group that gives variables."""
    return str(f90nml.Namelist({name: variables}))


def value(text: str, group: str, variable: str, occurrence: int = 0) -> Any:
    """A variable of one of the groups of a name; none where the case does not give it."""
    places = [(start, end) for name, start, end in groups(text) if name == group]
    if occurrence >= len(places):
        return None
    start, end = places[occurrence]
    return _variables(text[start:end]).get(variable)
