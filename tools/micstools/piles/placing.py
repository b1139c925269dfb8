"""Where the blocks of an ensemble end: their centre, how far they scatter, and how many lie outside
of an area."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from micstools.reading.places import ends as unit_ends
from micstools.reading.reader import Run
from micstools.reading.units import Unit, Units
from micstools.shapes.geometry import Array

NUMBERS = ("centre_x", "centre_y", "spread_x", "spread_y", "half_within", "most_within", "outside")
DRAWS = 1000  # of the bootstrap


@dataclass(frozen=True)
class Area:
    """A rectangle of the plan."""

    low: tuple[float, float]  # corner [m]
    high: tuple[float, float]
    given: bool  # by the user; else it is that of the drops

    def share_outside(self, places: Array) -> float:
        """Share of some places (n, 2) [m] that are not in it; nan without a place."""
        out = ((places < self.low) | (places > self.high)).any(axis=1)
        return float(out.mean()) if out.size else float("nan")


@dataclass(frozen=True)
class Placing:
    """Where the released free blocks of some runs lie at the end, seen from above; one out of
    the tank lies where it passed the side."""

    blocks: int
    left_out: int  # free blocks that were not released
    centre: tuple[float, float]  # mean of the centroids [m]
    spread: tuple[float, float]  # their standard deviation in x and y [m]
    half_within: float  # so far from the centre lie half of them at most [m]
    most_within: float  # and 90 % [m]
    area: Area
    outside: float  # share of the centroids outside of the area
    outside_of_runs: tuple[float, float]  # 5 and 95 % of that share in single runs
    interval_95: dict[str, tuple[float, float]]  # of each number, see `placing`


def ends(run: Run) -> Array:
    """Centroids (n, 2) [m] of the released free blocks at the end; ways through a period go on."""
    return unit_ends(run)[_released(run), :2]


def _starts(run: Run) -> Array:
    """Where they are let go (n, 3) [m]."""
    b, which = run.bodies, _released(run)
    rows = np.searchsorted(b.time, b.release_time[which] - 1e-12)
    return np.asarray(b.position[np.minimum(rows, b.time.size - 1), which])


def waiting(run: Run) -> int:
    """How many free blocks were not released."""
    return len(run.bodies.dropped) - len(_released(run))


def _released(run: Run) -> Array:
    b = run.bodies
    return np.array([int(k) for k in b.dropped if b.released(-1)[k]], dtype=int)


def drop_area(runs: Sequence[Run]) -> Area:
    """The rectangle around all places where blocks are let go, half a block larger on each side."""
    starts = np.concatenate([run.into_tank(_starts(run))[:, :2] for run in runs])
    shapes = [run.shapes[run.bodies.shape[k]] for run in runs for k in _released(run)]
    margin = max((shape.length / 2 for shape in shapes), default=0.0)
    if not shapes:
        return Area((np.nan, np.nan), (np.nan, np.nan), False)
    low, high = np.min(starts, axis=0) - margin, np.max(starts, axis=0) + margin
    return Area((float(low[0]), float(low[1])), (float(high[0]), float(high[1])), False)


def placing(runs: Sequence[Run], area: Area) -> Placing | None:
    """Of all blocks of the runs; none without a block. Intervals are those of the bootstrap over
    runs, whose blocks are not independent of each other: B. Efron, R. J. Tibshirani (1993), An
    introduction to the bootstrap, 13.3; nan of one run."""
    each = [places for run in runs if len(places := ends(run))]
    if not each:
        return None
    found = _numbers(each, area)
    draws = np.random.default_rng(1).integers(len(each), size=(DRAWS, len(each)))
    drawn = [_numbers([each[k] for k in draw], area) for draw in draws] if len(each) > 1 else []
    bounds = (
        np.percentile(drawn, [2.5, 97.5], axis=0).T if drawn else np.full((len(found), 2), np.nan)
    )
    low, high = np.percentile([area.share_outside(one) for one in each], [5, 95])
    x, y, sx, sy, half, most, outside = (float(v) for v in found)
    return Placing(
        blocks=sum(map(len, each)), left_out=sum(map(waiting, runs)), centre=(x, y),
        spread=(sx, sy), half_within=half, most_within=most, area=area, outside=outside,
        outside_of_runs=(float(low), float(high)),
        interval_95={k: (float(a), float(b)) for k, (a, b) in zip(NUMBERS, bounds, strict=True)},
    )  # fmt: skip


def _numbers(each: Sequence[Array], area: Area) -> Array:
    """The NUMBERS of the places (n, 2) of some runs."""
    places = np.concatenate(each)
    centre = places.mean(axis=0)
    within = np.percentile(np.linalg.norm(places - centre, axis=1), [50, 90])
    return np.array([*centre, *places.std(axis=0), *within, area.share_outside(places)])


def words(found: Placing, units: Units) -> str:
    """Where blocks lie, in a sentence or two."""
    length = units.length
    point = ", ".join(_at("xy"[d], found.centre[d : d + 1], units.place) for d in (0, 1))
    point += f"\u00a0{length.name}"
    sx, sy = (length.figure(v) for v in found.spread)
    if found.blocks == 1:
        place = f"One block lies at {point}."
        return place + _outside(found, units.place)
    said = (
        f"{found.blocks} blocks lie around {point}, with a standard "
        f"deviation of {sx} and {sy} {length.name} along x and y; half of them within "
        f"{length.text(found.half_within)} of that point, 90 % within "
        f"{length.text(found.most_within)}."
    )
    return said + _outside(found, units.place)


def _outside(found: Placing, place: Unit) -> str:
    """The share of blocks outside of the area."""
    area = found.area
    low, high = (f"{100 * v:.0f}" for v in found.outside_of_runs)
    x, y = (_at("xy"[d], (area.low[d], area.high[d]), place) for d in (0, 1))
    which = "wanted area" if area.given else "area of the drops"
    left = f"; left out: {found.left_out} not released" if found.left_out else ""
    low_95, high_95 = (100 * v for v in found.interval_95["outside"])
    sure = f"; 95 % interval {low_95:.0f} to {high_95:.0f} %" if low_95 == low_95 else ""
    return (
        f" {100 * found.outside:.0f} % of them ({low} to {high} % in 90 % of the runs{sure}) lie "
        f"outside the {which}, {x}, {y}\u00a0{place.name}{left}."
    )


def _at(axis: str, values: Sequence[float], place: Unit) -> str:
    """As in `x = 16.3 to 23.7`."""
    return f"{axis}\u00a0=\u00a0" + " to ".join(place.figure(v) for v in values)
