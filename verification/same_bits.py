"""Compare two result folders bit by bit.

usage: python verification/same_bits.py RUN RUN

Left out is only what names the machine or the clock: /provenance, /timers and wall_time, and the
lock that a killed run leaves behind.
"""

import argparse
from pathlib import Path

import h5py
import numpy as np

LOCK = "run.lock"
LEFT_OUT = ("provenance", "timers", "series/wall_time")


def contents(path: Path) -> dict[str, np.ndarray]:
    """Every dataset and attribute of an HDF5 file that has to be the same, by its path."""
    found: dict[str, np.ndarray] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if name.startswith(LEFT_OUT):
            return
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()])
        for key, value in item.attrs.items():
            found[f"{name}@{key}"] = np.asarray(value)

    with h5py.File(path, "r", locking=False) as h5:
        h5.visititems(visit)
    return found


def differences(a: Path, b: Path) -> list[str]:
    """What differs between two result folders, one line per file or dataset."""
    files = [{p.name for p in folder.iterdir() if p.is_file()} - {LOCK} for folder in (a, b)]
    found = [f"{name}: only in one folder" for name in sorted(files[0] ^ files[1])]
    for name in sorted(files[0] & files[1]):
        if name.endswith((".h5", ".vtkhdf")):
            found += [f"{name}: {line}" for line in _in_file(a / name, b / name)]
    return found


def but_restarts(found: list[str]) -> list[str]:
    """Differences apart from restart files of another time or name."""
    return [line for line in found if not line.startswith("restart-")]


def _in_file(a: Path, b: Path) -> list[str]:
    first, second = contents(a), contents(b)
    found = [f"{name} only in one file" for name in sorted(first.keys() ^ second.keys())]
    for name in sorted(first.keys() & second.keys()):
        x, y = first[name], second[name]
        if x.shape != y.shape or x.dtype != y.dtype:
            found.append(f"{name}: {x.dtype} {x.shape} against {y.dtype} {y.shape}")
        elif x.tobytes() != y.tobytes() and x.dtype != object:
            found.append(f"{name}: {_how_much(x, y)}")
        elif x.dtype == object and not np.array_equal(x, y):
            found.append(f"{name}: other text")
    return found


def _how_much(x: np.ndarray, y: np.ndarray) -> str:
    if x.dtype.kind not in "fiu" or x.ndim == 0:
        return f"{x} against {y}"
    other = ~((x == y) | ((x != x) & (y != y)))
    with np.errstate(invalid="ignore"):
        largest = np.nanmax(np.abs(x.astype(float) - y.astype(float)), initial=0.0)
    where = np.argwhere(other)
    first = tuple(int(n) for n in where[0]) if len(where) else ()
    return f"{other.sum()} of {x.size} differ, by up to {largest:.3e}, first at {first}"


def main() -> None:
    """Print the differences; exit code 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, nargs=2)
    found = differences(*parser.parse_args().run)
    print("\n".join(found) or "the same bits")
    raise SystemExit(int(bool(found)))


if __name__ == "__main__":
    main()
