"""The copy of a case that a run is made from, and what the files held that it names."""

import functools
import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from micstools import files
from micstools.cases import settings
from micstools.reading.reader import BadRun

_FILES = (("shape", "file"), ("drop", "file"), ("bed", "file"), ("fluid", "initial_state"),
          ("body", "motion"), ("start", "file"))  # fmt: skip


def from_here(text: str, folder: Path) -> str:
    """A case of a folder as it can stand in another: a file that lies beside the case, where the
    program looks first, gets its path from where we are."""
    if folder == Path():
        return text
    with suppress(BadRun):  # what is wrong with a group the program tells
        for group, variable, n, name in list(_named(text)):
            if not name.is_absolute() and (folder / name).exists():
                text = settings.set_group(text, group, {variable: str(folder / name)}, n)
    return text


def keep(case: Path, text: str) -> None:
    """Write a case where there is none yet, and the checksums of the files that it names into
    `files.json` beside it; refuse one that is there and differs in either."""
    said, sums = case.with_name("files.json"), checksums(text)
    if case.exists():
        if case.read_text() != text:
            raise BadRun(f"{case} is another case, seed or setting than asked for: "
                         "give another --out")  # fmt: skip
        before = json.loads(said.read_text()) if said.exists() else {}
        for name, found in sums.items():
            if before.get(name, found) != found:
                raise BadRun(f"{name} has changed since {case} was run: give another --out")
    case.parent.mkdir(parents=True, exist_ok=True)
    if not case.exists():
        files.write(case, text)
    if sums and not said.exists():
        files.write(said, json.dumps(sums, indent=2) + "\n")


def checksums(text: str) -> dict[str, str]:
    """SHA-256 of each file that a case names, by its name; a path is taken from where we are."""
    found = {}
    for _, _, _, path in _named(text):
        if path.is_file():
            about = path.stat()
            found[str(path)] = _sum(path.resolve(), about.st_mtime_ns, about.st_size)
    return found


def _named(text: str) -> Iterator[tuple[str, str, int, Path]]:
    """Every file that a case names: group, variable, which of the groups of that name, path."""
    names = [name for name, _, _ in settings.groups(text)]
    for group, variable in _FILES:
        for n in range(names.count(group)):
            path = Path(str(settings.value(text, group, variable, n) or "").strip())
            if path.name:
                yield group, variable, n, path


@functools.lru_cache
def _sum(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
