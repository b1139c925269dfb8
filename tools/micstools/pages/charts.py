"""Charts as SVG that follow the light or dark of the page and can be told apart in grey."""

from dataclasses import dataclass

import numpy as np

from micstools.pages.html import Markup, markup, tag
from micstools.shapes.geometry import Array

COLOURS = ("#d1495b", "#d98d1f", "#00879c", "#8560b8", "#5c9a78", "#e07a79", "#5b7aa6", "#a8727b")
DASHES = (None, "7 3", "2 2.5", "9 3 2 3")
WIDE, HIGH = 640, 256
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 12, 10, 46
_BINS = 300  # of a curve: more points than pixels show nothing


@dataclass(frozen=True)
class Curve:
    """A line of a chart."""

    x: Array
    y: Array
    order: int = 0  # chooses colour and dashes
    name: str = ""


@dataclass(frozen=True)
class Axes:
    """What a chart spans, and where that lies on it."""

    x: tuple[float, float]
    y: tuple[float, float]

    def across(self, x: Array) -> Array:
        """Places on the chart from left to right."""
        share = (np.asarray(x, float) - self.x[0]) / (self.x[1] - self.x[0])
        return _LEFT + share * (WIDE - _LEFT - _RIGHT)

    def down(self, y: Array) -> Array:
        """Places on the chart from the top down."""
        share = (np.asarray(y, float) - self.y[0]) / (self.y[1] - self.y[0])
        return HIGH - _BOTTOM - share * (HIGH - _TOP - _BOTTOM)


def colour(order: int) -> str:
    """Colour of the block dropped as the `order`-th, from 0."""
    return COLOURS[order % len(COLOURS)]


def dashes(order: int) -> str | None:
    """Dashes of the line of that block."""
    return DASHES[(order + order // len(COLOURS)) % len(DASHES)]


def ticks(low: float, high: float, most: int = 6) -> Array:
    """Round numbers between two bounds, at most so many."""
    span = high - low
    power = 10.0 ** np.floor(np.log10(span / most))
    step = next(s * power for s in (1, 2, 5, 10, 20) if span / (s * power) <= most)
    first = np.ceil(low / step - 1e-9)
    return np.asarray(step * np.arange(first, np.floor(high / step + 1e-9) + 1) + 0.0)  # no -0


def spanning(values: Array, zero: bool = False) -> tuple[float, float]:
    """Bounds of the finite values with a little room, with 0 where asked for."""
    found = np.asarray(values, float)
    found = found[np.isfinite(found)]
    low, high = (float(found.min()), float(found.max())) if found.size else (0.0, 1.0)
    low, high = (min(low, 0.0), max(high, 0.0)) if zero else (low, high)
    alike = high - low <= 1e-6 * max(abs(low), abs(high))  # but for rounding
    room = max(abs(high), 1.0) * 0.5 if alike else 0.04 * (high - low)
    return (low if zero and low == 0 else low - room), high + room


def lines(curves: list[Curve], x: str, y: str, *, limit: float | None = None,
          zero: bool = True, in_time: bool = True) -> Markup:  # fmt: skip
    """Curves over one axis; `limit` is a level to compare with. A chart `in_time` has a mark that
    moves with the player."""
    shown = [c.y for c in curves] + ([np.array([limit])] if limit is not None else [])
    axes = Axes(
        _bounds(np.concatenate([c.x for c in curves])), spanning(np.concatenate(shown), zero)
    )
    drawn = [
        tag("path", d=_path(axes, *_thinned(c)), class_="curve", stroke=colour(c.order),
            stroke_dasharray=dashes(c.order))
        for c in curves
    ]  # fmt: skip
    if limit is not None:
        at = f"{float(axes.down(np.array(limit))):.1f}"
        drawn.append(tag("line", class_="limit", x1=_LEFT, x2=WIDE - _RIGHT, y1=at, y2=at))
    if in_time:
        left, right = axes.across(np.array(axes.x))
        drawn.append(tag("line", class_="now", y1=_TOP, y2=HIGH - _BOTTOM, x1=0, x2=0, hidden=True,
                         data_left=left, data_right=right, data_from=axes.x[0],
                         data_to=axes.x[1]))  # fmt: skip
    return chart(axes, x, y, *drawn)


def _bounds(values: Array) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return low, high if high > low else low + 1.0


def _thinned(curve: Curve) -> tuple[Array, Array]:
    """The lowest and the highest point of each of `_BINS` parts of a long curve: no peak is
    lost."""
    x, y = np.asarray(curve.x, float), np.asarray(curve.y, float)
    known = np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) <= 2 * _BINS:
        return x, y
    bounds = np.linspace(0, len(x), _BINS + 1).astype(int)
    kept = {0, len(x) - 1}
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        kept |= {int(a + y[a:b].argmin()), int(a + y[a:b].argmax())}
    order = sorted(kept)
    return x[order], y[order]


def _path(axes: Axes, x: Array, y: Array) -> str:
    across, down = axes.across(x), axes.down(y)
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(across, down, strict=True))


def chart(axes: Axes, x: str, y: str, *drawn: Markup, whole: bool = False) -> Markup:
    """A frame with ticks, the names of both axes and what is drawn in it; `whole`: what runs up is
    counted."""
    grid = []
    for value in ticks(*axes.x):
        at = float(axes.across(np.array(value)))
        grid += [_text(at, HIGH - _BOTTOM + 18, value, "middle")]
    for value in ticks(*axes.y, most=5):
        if whole and value % 1:
            continue
        at = float(axes.down(np.array(value)))
        grid += [
            tag("line", class_="grid", x1=_LEFT, x2=WIDE - _RIGHT, y1=f"{at:.1f}", y2=f"{at:.1f}"),
            _text(_LEFT - 7, at + 4.5, value, "end"),
        ]
    frame = tag("path", class_="axis", d=f"M{_LEFT} {_TOP}V{HIGH - _BOTTOM}H{WIDE - _RIGHT}")
    under = tag("text", x, x=(WIDE + _LEFT - _RIGHT) / 2, y=HIGH - 3, text_anchor="middle")
    words = f"{y} against {x}" if x else f"histogram: {y}"
    picture = tag("svg", *grid, *drawn, frame, under, viewBox=f"0 0 {WIDE} {HIGH}", role="img",
                  aria_label=words)  # fmt: skip
    return tag("figure", tag("figcaption", y), picture, class_="chart")


def _text(x: float, y: float, value: float, anchor: str) -> Markup:
    return tag("text", f"{value:.6g}", x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def key(names: list[tuple[int, str]]) -> Markup:
    """What colour and dashes mean."""
    entries = [
        tag("li", tag("svg", tag("path", d="M0 5H34", class_="curve", stroke=colour(order),
                                 stroke_dasharray=dashes(order)), viewBox="0 0 34 10"), name)
        for order, name in names
    ]  # fmt: skip
    return tag("ul", *entries, class_="key")


def histogram(values: Array, name: str, marks: list[tuple[float, str]]) -> Markup:
    """How often values of a name occur, with marked values, each named."""
    low, high = spanning(np.concatenate([values, [m for m, _ in marks]]))
    bins = ticks(low, high, most=14)
    step = bins[1] - bins[0]
    edges = np.arange(np.floor(low / step), np.ceil(high / step) + 1) * step
    counts, _ = np.histogram(values, edges)
    axes = Axes((float(edges[0]), float(edges[-1])), (0.0, 1.12 * float(max(counts.max(), 1))))
    left, top = axes.across(edges), axes.down(counts)
    floor = HIGH - _BOTTOM
    bars = [
        tag("rect", class_="bar", x=f"{left[k] + 1:.1f}", width=f"{left[k + 1] - left[k] - 2:.1f}",
            y=f"{top[k]:.1f}", height=f"{floor - top[k]:.1f}")
        for k in range(len(counts)) if counts[k]
    ]  # fmt: skip
    for value, mark in marks:
        at = f"{float(axes.across(np.array(value))):.1f}"
        bars.append(tag("line", tag("title", f"{mark}: {value:.4g}"), x1=at, x2=at, y1=_TOP,
                        y2=floor, class_="median" if mark == "median" else "limit"))  # fmt: skip
    return chart(axes, "", name, *bars, whole=True)


def band(steps: Array, names: tuple[str, str], y_axis: tuple[float, float] | None = None) -> Markup:
    """A curve within the interval around it: `steps` (n, 4) are x, the value, and its interval;
    `names` are those of both axes."""
    x, middle, low, high = steps.T
    axes = Axes(_bounds(x), y_axis or spanning(np.concatenate([low, high])))
    outline = _path(axes, np.concatenate([x, x[::-1]]), np.concatenate([low, high[::-1]]))
    drawn = markup(
        tag("path", d=outline + "Z", class_="band"),
        tag("path", d=_path(axes, x, middle), class_="curve", stroke=COLOURS[2]),
    )
    return chart(axes, *names, drawn)
