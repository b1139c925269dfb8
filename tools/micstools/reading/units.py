"""Units of the figures that people read: one set for a run, by the size of its blocks.

Result files, JSON, CSV and Python values stay in SI units; only text, charts and pictures use
these.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from micstools.reading.reader import Run

_TOGETHER = "\u00a0"  # between a figure and its unit: they stay on one line
_PLAIN = {_TOGETHER: " ", "²": "2", "³": "3", "°": "deg", "–": "-", "±": "+-"}


def figure(value: float, digits: int = 3) -> str:
    """A number in `digits`, never rounded to tens; no exponent from 1e-4 to 1e6, a dash for nan."""
    if not np.isfinite(value):
        return "–" if np.isnan(value) else str(value)
    rounded = float(f"{value:.{digits - 1}e}")
    if rounded and not 1e-4 <= abs(rounded) < 1e6:
        return f"{rounded:.{digits}g}"
    places = digits - 1 - int(np.floor(np.log10(abs(rounded) or 1.0)))
    return _without_zeros(f"{value:.{max(0, places)}f}")


def _without_zeros(text: str) -> str:
    """A number without zeros at the end of its decimals."""
    return text.rstrip("0").rstrip(".") if "." in text else text


@dataclass(frozen=True)
class Unit:
    """A unit and its size in SI."""

    name: str
    size: float = 1.0
    decimals: int | None = None  # of a place, which may be far from zero: a share of a block

    def of(self, value: Any) -> Any:
        """A number or an array in SI, in this unit."""
        return value / self.size

    def figure(self, value: float, digits: int = 3) -> str:
        """A value in SI as a figure without its unit; a place to its decimals, not to `digits`."""
        if self.decimals is None or not np.isfinite(value):
            return figure(self.of(value), digits)
        return _without_zeros(self.column([value])[0])

    def column(self, values: Iterable[float]) -> list[str]:
        """Values in SI as figures of a column, alike in decimals: those of a place, else as many
        as the largest needs for three digits."""
        found = np.array([self.of(v) for v in values], float)
        largest = np.abs(found[np.isfinite(found)]).max(initial=0.0) or 1.0
        usual = max(0, 2 - int(np.floor(np.log10(largest))))
        places = usual if self.decimals is None else self.decimals
        return [f"{round(v, places) + 0.0:.{places}f}" if np.isfinite(v) else figure(v)
                for v in found]  # fmt: skip

    def text(self, value: float, digits: int = 3) -> str:
        """A value in SI with its unit; a dash where it is nan."""
        return self._with_name(self.figure(value, digits))

    def row(self, values: Iterable[float], between: str = ", ", digits: int = 3) -> str:
        """Several values in SI and their unit once."""
        return self._with_name(between.join(self.figure(float(v), digits) for v in values))

    def plain(self, value: float, digits: int = 3) -> str:
        """The same as `text` in ASCII, for the terminal."""
        return ascii_of(self.text(value, digits))

    def _with_name(self, text: str) -> str:
        return text if text == "–" else f"{text}{_TOGETHER}{self.name}".rstrip()  # of nan


def ascii_of(text: str) -> str:
    """Text in ASCII: powers, dashes and the blanks before units."""
    for sign, plain in _PLAIN.items():
        text = text.replace(sign, plain)
    return text


@dataclass(frozen=True)
class Units:
    """The units of one run."""

    length: Unit
    place: Unit
    area: Unit
    volume: Unit
    mass: Unit
    force: Unit
    energy: Unit
    speed: Unit = Unit("m/s")
    time: Unit = Unit("s")
    angle: Unit = Unit("°")
    number: Unit = Unit("")

    def of_kind(self, kind: str) -> Unit:
        """The unit of a kind of quantity by its name here, as 'length'."""
        found: Unit = getattr(self, kind)
        return found


LABORATORY = Units(
    Unit("mm", 1e-3), Unit("mm", 1e-3, 1), Unit("cm²", 1e-4), Unit("cm³", 1e-6),
    Unit("kg"), Unit("N"), Unit("mJ", 1e-3)
)  # fmt: skip
SI = Units(Unit("m"), Unit("m", 1.0, 3), Unit("m²"), Unit("m³"), Unit("kg"), Unit("N"), Unit("J"))
SITE = Units(
    Unit("m"), Unit("m", 1.0, 2), Unit("m²"), Unit("m³"),
    Unit("t", 1e3), Unit("kN", 1e3), Unit("kJ", 1e3)
)  # fmt: skip
_SMALL, _LARGE = 0.2, 0.5  # [m] lengths of blocks that part the three
_TANK = 0.1  # of the longest side of the tank stands for the length of a block where there is none


def of_size(length: float) -> Units:
    """The units for blocks of a length [m]."""
    if length < _SMALL:
        return LABORATORY
    return SI if length < _LARGE else SITE


def of_run(run: Run) -> Units:
    """The units of a run: those of its largest free block, of any block where none is free, of its
    tank where there are no blocks."""
    shapes = zip(run.bodies.shape, run.bodies.fixed, strict=False)
    free = {name for name, fixed in shapes if not fixed} or set(run.bodies.shape)
    lengths = [run.shapes[name].length for name in free]
    tank = float((run.grid.high - run.grid.low).max())
    return of_size(max(lengths, default=_TANK * tank))
