"""Opens result files, which may come from anybody and may still be written: what is no whole result
file of the program is told in one line with the file's name."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

T = TypeVar("T")

_WAITS = (0.1, 0.3, 1.0, 2.0)  # for a writer [s]
_PACKED = 1100  # bytes that one byte of a compressed dataset may stand for
_SMALL = 1_000_000  # bytes that need no room in the file before they are written
_NUMBERS = "fiub"  # kinds of numpy


class BadRun(Exception):
    """What was given is not the results that are wanted; the text says what is wrong."""


def take(path: Path, extract: Callable[[h5py.File], T], waits: Sequence[float] = _WAITS) -> T:
    """Open a file, take something out of it and close it; one that is caught mid-write is opened
    again after each of the `waits` [s]."""
    for wait in (*waits, None):
        try:
            with h5py.File(path, "r", locking=False) as h5:
                _require_own(h5)
                return extract(h5)
        except (OSError, RuntimeError) as error:
            if wait is None:
                raise BadRun(f"{path}: cannot be read ({_line(error)})") from error
            time.sleep(wait)
        except (LookupError, ValueError, TypeError, AttributeError, ArithmeticError,
                MemoryError) as error:  # fmt: skip
            raise BadRun(f"{path}: not a whole result file ({_line(error)})") from error
    raise AssertionError


def _line(error: Exception) -> str:
    return " ".join(str(error).strip("'\"").split())[:200] or type(error).__name__


def _require_own(h5: h5py.File) -> None:
    """Refuse links, data that lie in other files, and sizes that the file does not hold."""
    groups: list[h5py.Group] = [h5]
    seen = set()
    while groups:
        group = groups.pop()
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name} is a link")
            item = group[name]
            if isinstance(item, h5py.Group):
                place = h5py.h5o.get_info(item.id).addr
                if place not in seen:
                    groups.append(item)
                seen.add(place)
            elif isinstance(item, h5py.Dataset):
                if item.external or item.is_virtual:
                    raise ValueError(f"{name} lies in another file")
                if item.nbytes > _SMALL + _PACKED * item.id.get_storage_size():
                    raise OSError(f"{name} is not there")


def numbers(group: h5py.Group, name: str, *shape: int | None) -> Any:
    """The numbers of a dataset, which must have a shape; None stands for any length."""
    require_shape(group, name, *shape)
    return group[name][()]


def require_shape(group: h5py.Group, name: str, *shape: int | None) -> None:
    """Raise ValueError where a dataset holds no numbers of this shape."""
    found = group[name]
    fits = len(found.shape) == len(shape) and all(
        wanted in (None, n) for n, wanted in zip(found.shape, shape, strict=True)
    )
    if not fits or found.dtype.kind not in _NUMBERS:
        raise ValueError(f"{name} has shape {found.shape} of {found.dtype}")


def finite(values: Any, name: str) -> Any:
    """Coordinates or times, none of which may be missing."""
    if not (np.abs(values) < 1e20).all():
        raise ValueError(f"{name} holds what is no number")
    return values


def rising(values: Any, name: str, strictly: bool = False) -> Any:
    """Coordinates or times, which must be finite and rise."""
    steps = np.diff(finite(values, name))
    if (steps <= 0 if strictly else steps < 0).any():
        raise ValueError(f"{name} does not rise")
    return values


def indices(values: Any, name: str, of: int) -> Any:
    """Indices, from 0, of something of which there are `of`."""
    if values.size and (values.min() < 0 or values.max() >= of):
        raise ValueError(f"{name} leaves the list of {of}")
    return values.astype(np.int64)
