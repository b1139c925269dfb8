"""Variables of a case set from outside, `group.variable=value`, on a copy of its text."""

import re
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import f90nml

from micstools.reading.reader import BadRun

_FORM = re.compile(r"([A-Za-z]\w*)\.([A-Za-z]\w*)\s*=(.*)", re.DOTALL)
_LOGICALS = {".true.": True, "true": True, ".false.": False, "false": False}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_STRINGS = re.compile(r"'[^'\n]*'|\"[^\"\n]*\"|![^\n]*|\xa0")
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
    mark; blanks that do not break are blanks, but in strings."""
    data = path.read_bytes()
    if b"\0" in data:
        raise BadRun(f"{path}: is no text")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
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

    f90nml changes the first group of a name only, so each is handed to it alone.
    """
    places = [(start, end) for group, start, end in groups(text) if group == name]
    if not places:
        return text.rstrip("\n") + "\n\n" + str(f90nml.Namelist({name: variables})) + "\n"
    chosen = places if occurrence is None else [places[occurrence]]
    for start, end in reversed(chosen):
        text = text[:start] + _patched(text[start:end], name, variables) + text[end:]
    return text


def unset(text: str, name: str, variable: str, occurrence: int = 0) -> str:
    """Take a variable out of one of the groups of a name, so that it has its default."""
    places = [(start, end) for group, start, end in groups(text) if group == name]
    if occurrence >= len(places):
        return text
    start, end = places[occurrence]
    return text[:start] + _without(text[start:end], name, variable) + text[end:]


def _without(group: str, name: str, variable: str) -> str:
    """A group without a variable; its remarks stay if the variable stands on lines of its own."""
    wanted = _read(group)
    if wanted[name].pop(variable, None) is None:
        return group
    plain = _STRINGS.sub(lambda found: " " * len(found[0]), group)  # no `=` in texts and remarks
    found = re.search(rf"(?<![\w%]){variable}\s*=", plain, re.IGNORECASE)
    if found:
        ends = re.search(r"[A-Za-z]\w*\s*(\([^)]*\)\s*)?=|/|!", plain[found.end() :])
        stop = found.end() + (ends.start() if ends else 0)
        text = group[: found.start()] + group[stop:].lstrip(" ,")
        try:
            if _read(text) == wanted:
                return re.sub(r"\n[ \t]*\n", "\n", text)
        except BadRun:
            pass
    return str(wanted).rstrip("\n")


def _patched(group: str, name: str, variables: dict[str, Any]) -> str:
    """A group with variables set. f90nml keeps its remarks, but spoils a list with a repeated
    value, `2*0.01`: then the group is written anew."""
    with tempfile.TemporaryDirectory() as folder:
        before, after = Path(folder, "before.nml"), Path(folder, "after.nml")
        before.write_text(group + "\n")
        try:
            wanted = _read(group)
            wanted[name].update(f90nml.Namelist({name: variables})[name])
            f90nml.patch(str(before), {name: variables}, str(after))
        except BadRun:
            raise
        except Exception as error:  # f90nml raises what Python has for a text it cannot follow
            raise BadRun(f"&{name}: cannot be changed, write it anew ({error})") from error
        text = after.read_text().rstrip("\n")
    try:
        if _read(text) == wanted:
            return text
    except BadRun:
        pass
    return str(wanted).rstrip("\n")


def _read(group: str) -> f90nml.Namelist:
    """A group as f90nml understands it."""
    try:
        return f90nml.Parser().reads(group + "\n")
    except Exception as error:  # f90nml raises what Python has for a text it cannot follow
        words = " ".join(group.split())
        raise BadRun(f"{words[:60]}: cannot be understood ({type(error).__name__})") from error


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
    return _read(text[start:end])[group].get(variable)
