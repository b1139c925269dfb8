"""Writes text files whole or not at all; tables whose texts a spreadsheet takes for texts."""

import contextlib
import csv
import io
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, BinaryIO


def write(path: Path, text: str | bytes) -> None:
    """Write a file so that a crash or a full disk leaves the old or the new one. Links stay
    links, and mode and owner stay those of the file that was there: one that a new file cannot
    stand for (of another owner, of several names, in a closed folder) is written in place."""
    place, content = path.resolve(), text if isinstance(text, bytes) else text.encode()
    old = place.stat() if place.exists() else None
    if old and not stat.S_ISREG(old.st_mode):  # a terminal, a pipe
        place.write_bytes(content)
        return
    new = place.with_name(f".mics-{secrets.token_hex(8)}")
    mode = stat.S_IMODE(old.st_mode) if old else 0o666
    try:
        with open(new, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:  # noqa: PTH123 - for its opener
            _put(file, content)
        if old is None or _stands_for(new, place, old):
            new.replace(place)
            # Let the new name outlive a power cut
            entry = os.open(place.parent, os.O_RDONLY)
            with contextlib.suppress(OSError):  # some file systems settle no folder
                os.fsync(entry)
            os.close(entry)
            return
    except PermissionError:
        if old is None:
            raise
    finally:
        new.unlink(missing_ok=True)
    with place.open("r+b") as file:
        _put(file, content)


def as_text(value: object) -> object:
    """A text that a spreadsheet would take for a formula behind an apostrophe, which lets it be a
    text; figures stay."""
    if not isinstance(value, str) or not re.match(r"\s*[=+\-@].", value):
        return value
    return value if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", value) else f"'{value}"


def table_text(rows: Iterable[dict[str, object]], names: Sequence[str]) -> str:
    """Rows as CSV under the names of their columns."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([as_text(row[name]) for name in names] for row in rows)
    return text.getvalue()


def write_table(path: Path, rows: Sequence[dict[str, object]]) -> Path:
    """Write rows with the same names as CSV."""
    write(path, table_text(rows, list(rows[0])))
    return path


def known(value: Any) -> Any:
    """The same without nan and infinite numbers, which JSON has not."""
    if isinstance(value, dict):
        return {k: known(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [known(v) for v in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def _put(file: BinaryIO, content: bytes) -> None:
    file.write(content)
    file.truncate()
    file.flush()
    os.fsync(file.fileno())


def _stands_for(new: Path, place: Path, old: os.stat_result) -> bool:
    """Has the new file all that the old one has, but its content?"""
    with contextlib.suppress(PermissionError):
        os.chown(new, old.st_uid, old.st_gid)
    shutil.copystat(place, new)
    os.utime(new)
    now = new.stat()
    return (now.st_uid, now.st_gid, 1) == (old.st_uid, old.st_gid, old.st_nlink)
