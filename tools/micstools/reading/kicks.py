"""Acceleration of blocks that fall through water and touch nothing: a kick of the solver shows in
it. Weight and water change their velocity by .3 g at most over the time of a window, a kick by 1 g
and more (docs/decisions/cavity.md). A block that lands flat is slowed by 1 g in the last window
before it touches, and one that is let go with a speed takes the water along at once: neither counts
as untouched."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray

LIMIT = 1.0
"""From where a block was kicked [g]."""
_WINDOW = 0.22  # length of a window [sqrt(D/g)], D the length of the block
_DEPTH = 0.35  # of the centre under the water level, from which a block counts [D]
_CLEAR = 1.0  # before and after a window without touch, and after the release [windows]
_SAME = 1e-6  # relative, of two times


@dataclass(frozen=True)
class Largest:
    """The largest acceleration of an untouched block under water."""

    acceleration: float  # mean of a window [g]; nan: the rows are too far apart to tell
    block: int  # number, from 1
    time: float  # at which its window begins [s]
    window: float  # its length [s]
    rows: float  # so near to each other the rows must be [s]

    @property
    def good(self) -> bool | None:
        """Was no block kicked? None: not known."""
        return self.acceleration < LIMIT if np.isfinite(self.acceleration) else None

    @property
    def figures(self) -> str:
        """The figure with block and time; where it is not known, why."""
        if self.good is None:
            return f"not known (needs rows every {self.rows:.2g} s)"
        return f"{self.acceleration:.2g} g, block {self.block} at t = {self.time:.4g} s"

    @property
    def advice(self) -> str:
        """What to do where it is too large."""
        return f"smaller cells or step; look at the film at t = {self.time:.4g} s"

    def __str__(self) -> str:
        """The figure with block and time, and what to do where it is too large."""
        return self.figures if self.good is not False else f"{self.figures}: {self.advice}"


def window(run: Run, length: float) -> float:
    """Time over which the acceleration of a block of that length [m] is a mean [s]."""
    return _WINDOW * float(np.sqrt(length / np.linalg.norm(run.gravity)))


def largest(run: Run) -> Largest | None:
    """The largest acceleration of all untouched blocks; None without one under water."""
    if not _has_level(run):
        return None
    found = []
    for k in run.bodies.dropped:
        length = run.shapes[run.bodies.shape[k]].length
        values, known = _of_block(run, int(k), length, _CLEAR)
        if not np.isfinite(values).any():
            continue
        values = np.where(known, values, np.nan)
        row = int(np.nanargmax(values)) if known.any() else int(np.isnan(values).argmin())
        found.append(
            Largest(
                acceleration=float(values[row]),
                block=int(k) + 1,
                time=float(run.bodies.time[row]),
                window=window(run, length),
                rows=_rows_apart(run, length),
            )
        )
    return max(found, key=lambda one: np.nan_to_num(one.acceleration, nan=-1.0), default=None)


def acceleration(run: Run, length: float | None = None, clear: float = _CLEAR) -> Array:
    """Change of velocity over the window that begins at each row, over its length [g] (T, N).

    nan unless the block is free, its centre under water and nothing touches it in any row of the
    window or for `clear` windows before and after, and where rows are too far apart to tell.
    `length` [m] stands for that of the blocks."""
    b = run.bodies
    found = np.full((b.time.size, b.n), np.nan)
    if not _has_level(run):
        return found
    for k in b.dropped:
        own = length or run.shapes[b.shape[k]].length
        values, known = _of_block(run, int(k), own, clear)
        found[known, k] = values[known]
    return found


def _of_block(run: Run, k: int, length: float, clear: float) -> tuple[Array, Array]:
    """Acceleration in the window from each row on (T) [g], nan where the block does not count, and
    whether its rows are near enough to each other (T)."""
    b, span = run.bodies, window(run, length)
    time, row = b.time, np.arange(b.time.size)
    level = float(run.value("fluid", "water_level"))
    past = np.searchsorted(time, time - clear * span * (1 + _SAME))  # rows of the time to look at
    end = np.searchsorted(time, time + span * (1 - _SAME))  # the first at or after the end
    late = np.searchsorted(time, time + (1 + clear) * span * (1 - _SAME))
    whole = (end < row.size) & (time >= b.release_time[k] + clear * span * (1 - _SAME))
    whole &= _none(b.contacts[:, k] > 0, past, late)
    whole &= _none(b.position[:, k, 2] >= level - _DEPTH * length, row, end)
    far = np.zeros(row.size, dtype=bool)
    steps = np.zeros(time.size)  # that ended at each row of the bodies (T) [s]
    dt = run.series.dt[: steps.size]
    steps[: dt.size] = np.nan_to_num(dt)
    far[1:] = np.diff(time) > (1 + _SAME) * np.maximum(_rows_apart(run, length), steps[1:])
    later = [np.interp(time + span, time, b.velocity[:, k, d]) for d in range(3)]
    change = np.linalg.norm(np.stack(later, axis=1) - b.velocity[:, k], axis=1)
    values = np.where(whole, change / (span * np.linalg.norm(run.gravity)), np.nan)
    return values, whole & _none(far, np.minimum(past + 1, row + 1), late)


def _none(flags: NDArray[np.bool_], first: IntArray, last: IntArray) -> Array:
    """Is no flag (T) set from row `first` to row `last`, or to the last row there is (T)?"""
    total = np.concatenate([[0], np.cumsum(flags)])
    return np.asarray(total[np.minimum(last, flags.size - 1) + 1] == total[first])


def _rows_apart(run: Run, length: float) -> float:
    """Largest distance of rows that are not those of every step [s]: they must see the window, and
    every impact."""
    return min(window(run, length) / 2, float(run.value("contact", "contact_time")))


def _has_level(run: Run) -> bool:
    """Are there blocks, a fluid with a level, and weight?"""
    if not run.bodies.n:
        return False
    level = run.value("fluid", "water_level") is not None
    single = bool(run.value("fluid", "single_phase"))
    return run.physics == "coupled" and level and not single and bool(run.gravity.any())
