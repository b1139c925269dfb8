"""The packages of the Fortran sources: which uses which, what must not be, and a picture of it.

A package is a folder of `src`; files at its top are the package `top`. A file may use files of its
own package and of packages in lower layers. Packages of one layer know nothing of each other, and
no files use one another in a circle.
"""

import re
import tomllib
from collections import Counter
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

TOP = "top"
DATA = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())
HEIGHT = {package: height for height, layer in enumerate(DATA["layers"]) for package in layer}

MODULE = re.compile(r"^\s*(?:module|program)\s+(\w+)\s*$", re.MULTILINE | re.IGNORECASE)
USE = re.compile(
    r"^\s*(?:use\b(?:\s*,\s*\w+)?\s*(?:::)?|submodule\s*\()\s*(\w+)", re.MULTILINE | re.IGNORECASE
)

Imports = dict[str, set[str]]
"""The files that a file uses, all named from `src`, as in {'case/case_types.f90': {...}}."""


def imports(source: Path) -> Imports:
    """Which file uses which; modules from elsewhere, as those of HDF5, are left out.

    A submodule uses its module.
    """
    texts = {str(p.relative_to(source)): p.read_text() for p in sorted(source.rglob("*.f90"))}
    homes: dict[str, str] = {}
    for file, text in texts.items():
        for name in MODULE.findall(text):
            homes[name.lower()] = file
    found: Imports = {}
    for file, text in texts.items():
        used = {homes[name.lower()] for name in USE.findall(text) if name.lower() in homes}
        found[file] = used - {file}
    return found


def package_of(file: str) -> str:
    """The package of a file named from `src`."""
    return file.split("/")[0] if "/" in file else TOP


def faults(found: Imports) -> list[str]:
    """What is against the order of the packages, a line each, and the first circle among files."""
    lines = [
        f"{package}: no such package in packages.toml"
        for package in sorted({package_of(file) for file in found} - HEIGHT.keys())
    ]
    for file, used in sorted(found.items()):
        for other in sorted(used):
            above, below = package_of(file), package_of(other)
            if above == below or not {above, below} <= HEIGHT.keys():
                continue
            if HEIGHT[above] <= HEIGHT[below]:
                lines.append(f"{file} uses {other}: {below} is not below {above}")
    try:
        TopologicalSorter(found).prepare()
    except CycleError as error:
        lines.append("a circle: " + " uses ".join(reversed(error.args[1])))
    return lines


def arrows(found: Imports) -> Counter[tuple[str, str]]:
    """How many times files of one package use a file of another one."""
    pairs = (
        (package_of(file), package_of(other)) for file, used in found.items() for other in used
    )
    return Counter(pair for pair in pairs if pair[0] != pair[1])


BANDS, BOXES, CONTENT, COLOURS = (DATA[name] for name in ("bands", "boxes", "content", "colours"))
GREY = "#555555"
TALL = 0.58
ALONG = 0.42  # of an arrow is before its count


def picture(found: Imports) -> Figure:
    """The packages in their layers; an arrow runs from the user to the used and bears its count."""
    counts, files = arrows(found), Counter(package_of(file) for file in found)
    figure = Figure(figsize=(10.5, 10.0))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set_xlim(0.7, 12.6)
    axis.set_ylim(-0.45, 10.85)
    axis.axis("off")
    for package, height in BANDS.items():
        up = package in ("paper", "setup", TOP)
        others = [
            (b if up else a, n) for (a, b), n in counts.items() if package == (a if up else b)
        ]
        others.sort(key=lambda pair: -HEIGHT[pair[0]])
        words = ",  ".join(f"{other} {n}" for other, n in others)
        title = f"{package} ({files[package]} files): {CONTENT[package]}"
        _box(axis, package, (6.65, height, 11.3), title, f"{'uses' if up else 'used by'}  {words}")
    for package, place in BOXES.items():
        _box(axis, package, place, f"{package} ({files[package]} files)", CONTENT[package])
    for (user, used), n in sorted(counts.items()):
        if user in BOXES and used in BOXES:
            _arrow(axis, user, used, n)
    return figure


def _box(
    axis: Axes, package: str, place: tuple[float, float, float], title: str, words: str
) -> None:
    x, y, wide = place
    box = FancyBboxPatch(
        (x - wide / 2, y - TALL / 2), wide, TALL, boxstyle="round,pad=0,rounding_size=0.08",
        facecolor="#f4f4f4", edgecolor=COLOURS.get(package, GREY), linewidth=1.3, zorder=3,
    )  # fmt: skip
    axis.add_patch(box)
    _say(axis, x, y + 0.12, title, fontsize=10, weight="bold")
    _say(axis, x, y - 0.14, words, fontsize=8, color="#333333")


def _say(axis: Axes, x: float, y: float, words: str, **style: Any) -> None:
    axis.text(x, y, words, **{"ha": "center", "va": "center", "zorder": 4, **style})


def _arrow(axis: Axes, user: str, used: str, n: int) -> None:
    """From the lower edge of the user to the upper edge of the used, with the count on it."""
    x_start, x_end = DATA["ends"].get(user, {}).get(used, (BOXES[user][0], BOXES[used][0]))
    start = (x_start, BOXES[user][1] - TALL / 2)
    end = (x_end, BOXES[used][1] + TALL / 2)
    colour = COLOURS.get(user, GREY)
    line = FancyArrowPatch(
        start, end, arrowstyle="-|>,head_length=7,head_width=3.5", shrinkA=0, shrinkB=0,
        color=colour, linewidth=0.8 + 0.07 * n, zorder=1,
    )  # fmt: skip
    axis.add_patch(line)
    x, y = (a + ALONG * (b - a) for a, b in zip(start, end, strict=True))
    behind = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    _say(axis, x, y, str(n), fontsize=9, color=colour, zorder=2, bbox=behind)
