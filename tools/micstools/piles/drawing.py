"""Planned beside built, as it is drawn for a site: the plan of a layer in coordinates of a survey,
and a section through it."""

import base64
import io
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.transforms import Affine2D

from micstools import files
from micstools.piles import pile
from micstools.piles.handover import Handover
from micstools.piles.layer import Layer, Maps
from micstools.piles.placing import Area
from micstools.reading.overlap import Placed
from micstools.reading.places import Place, Survey, is_within
from micstools.reading.reader import BadRun, Run
from micstools.shapes.geometry import Array
from micstools.shapes.height_maps import SURVEY

COEFFICIENTS = {"cube": 1.10, "tetrapod": 1.02}
"""Layer coefficients k_t of a design. Source: The Rock Manual (CIRIA C683), table 3.11."""
_GOOD, _BAD, _PLAIN, _HELD = "#4d9a6a", "#d1495b", "#8fa6b8", "#b9b9b9"
_WATER = "#2f86c6"
_RAMP = LinearSegmentedColormap.from_list(
    "cover", ["#fafaf7", "#baded5", "#60b0b8", "#266e96", "#162a5c"]
)
matplotlib.rcParams["text.parse_math"] = False  # a $ in a name is one
_WIDE = 7.1  # of a figure, that of an A4 page between its margins [inch]
_MANY = 200  # units: of more no names are written
_FLAT = 0.05  # slope below which there is none to draw a section down


def plan(given: Handover) -> Figure:
    """Units from above with their names, coloured by whether they lie within the tolerance around
    their planned place, and arrows from that; contours of the bed; ticks in the survey [m]."""
    assert given.measured
    maps, within = given.measured[0], given.within
    ny, nx = maps.bed.shape
    high = maps.low + maps.step * np.array([nx, ny])
    around = np.array([maps.low, high, [maps.low[0], high[1]], [high[0], maps.low[1]]])
    bodies = given.bodies
    corners = np.concatenate([given.survey.of(around), *map(given.hull, bodies.values())])
    size = np.ptp(corners, axis=0)
    figure = Figure(figsize=(_WIDE, min(9.5, 0.9 + (_WIDE - 0.9) * size[1] / size[0])),
                    layout="constrained")  # fmt: skip
    axes = figure.add_subplot(aspect="equal")
    x, y = (maps.low[d] + (np.arange(n) + 0.5) * maps.step for d, n in enumerate((nx, ny)))
    at = given.survey.of(np.stack(np.meshgrid(x, y), axis=-1))
    level = maps.bed_ball + given.survey.origin[2]
    if np.ptp(level) > 0:
        lines = axes.contour(at[..., 0], at[..., 1], level, 10, colors="#b79c6c", linewidths=0.5,
                             zorder=0)  # fmt: skip
        axes.clabel(lines, fontsize=6)
    axes.add_collection(PolyCollection([given.hull(body) for body in bodies.values()],
                        facecolors=[_colour(given, given.places[k]) for k in bodies],
                        edgecolors="#333333", linewidths=0.5, alpha=0.8))  # fmt: skip
    shown = [given.places[k] for k in bodies]
    for p in shown if len(shown) <= _MANY else []:
        axes.text(p.x, p.y, p.name or str(p.unit), fontsize=6, ha="center", va="center",
                  bbox={"pad": 0.4, "color": "white", "alpha": 0.6, "lw": 0})  # fmt: skip
    free = [p for p in shown if not p.fixed]
    if within and free:
        start = np.array([[p.plan_x, p.plan_y] for p in free])
        way = np.array([[p.x, p.y] for p in free]) - start
        axes.quiver(*start.T, *way.T, angles="xy", scale_units="xy", scale=1, width=0.003, zorder=2)
        wide = np.full(len(free), 2 * within.tolerance)
        axes.add_collection(EllipseCollection(wide, wide, 0 * wide, units="xy", offsets=start,
                            offset_transform=axes.transData, facecolors="none", edgecolors="black",
                            linewidths=0.5, linestyles=":"))  # fmt: skip
    axes.annotate("N", (0.97, 0.98), (0.97, 0.9), xycoords="axes fraction", ha="center",
                  arrowprops={"arrowstyle": "->"})  # fmt: skip
    _survey_axes(axes, corners)
    keys: list[Patch | Line2D] = [Patch(color=_PLAIN, label="as built")]
    if within:
        ring = Line2D([], [], ls=":", color="black", label="tolerance around the planned place")
        keys = [Patch(color=_GOOD, label="within it"), Patch(color=_BAD, label="farther off"), ring]
    figure.legend(handles=keys, loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    return figure


def over_plan(values: Array, top: float, name: str, run: Run, survey: Survey,
              areas: Sequence[Area]) -> Figure:  # fmt: skip
    """A map (ny, nx) of the plan of the tank in colours from 0 to `top`, with areas, those that
    nobody gave dashed, and an arrow of the current; ticks in the survey [m]."""
    low, high = run.grid.low[:2], run.grid.high[:2]
    corners = survey.of(np.array([low, high, [low[0], high[1]], [high[0], low[1]]]))
    wide, tall = np.ptp(corners, axis=0)
    figure = Figure(figsize=(4.6, float(np.clip(1.3 + 3.6 * tall / wide, 1.9, 6))),
                    layout="constrained")  # fmt: skip
    axes = figure.add_subplot(aspect="equal")
    axes.set_title(name, fontsize=8)
    place = Affine2D().rotate_deg(survey.north).translate(*survey.origin[:2]) + axes.transData
    image = axes.imshow(values, _RAMP, extent=(low[0], high[0], low[1], high[1]), origin="lower",
                        vmin=0, vmax=top or 1, transform=place)  # fmt: skip
    figure.colorbar(image, location="bottom", shrink=0.5, aspect=30).ax.tick_params(labelsize=7)
    for area in areas:
        axes.add_patch(Rectangle(area.low, *np.subtract(area.high, area.low), fill=False, ec=_BAD,
                       lw=1.5, ls="-" if area.given else "--", transform=place))  # fmt: skip
    if (current := run.current[:2]).any():
        start = low + 0.04 * (size := (high - low).max())
        ends = survey.of(start + np.array([[0.0], [0.1 * size]]) * current / np.hypot(*current))
        axes.quiver(*ends[0], *(ends[1] - ends[0]), angles="xy", scale_units="xy", scale=1,
                    width=0.012, color=_WATER)  # fmt: skip
    _survey_axes(axes, corners)
    return figure


def _survey_axes(axes: Axes, corners: Array) -> None:
    """Axes around corners (n, 2) in a survey [m]."""
    axes.set_xlim(corners[:, 0].min(), corners[:, 0].max())
    axes.set_ylim(corners[:, 1].min(), corners[:, 1].max())
    far = bool((np.abs(corners) > SURVEY).any())
    axes.set_xlabel("easting [m]" if far else "x [m]", fontsize=8)
    axes.set_ylabel("northing [m]" if far else "y [m]", fontsize=8)
    _plain(axes)


def section(given: Handover) -> Figure:
    """A cut through units and bed along a line, with the still water and, where a coefficient is
    known of the shape, the design surface n k_t D_n over the bed, at right angles to its slope."""
    assert given.measured
    maps, found = given.measured
    start, end = _line(given, maps)
    way = float(np.linalg.norm(end - start))
    along = (end - start) / (way or 1.0)
    s = np.linspace(0, way, 600)
    column, row = ((start + s[:, None] * along - maps.low) / maps.step).astype(int).T
    inside = (row >= 0) & (row < maps.bed.shape[0]) & (column >= 0) & (column < maps.bed.shape[1])
    if inside.sum() < 2:
        raise BadRun(f"--section {' '.join(f'{v:g}' for v in (*start, *end))}: misses the units")
    s, row, column = s[inside], row[inside], column[inside]
    up = given.survey.origin[2]
    bed, smooth = maps.bed[row, column] + up, maps.bed_ball[row, column] + up
    water = pile.still_level(given.run)
    tops = [float(body.points[:, 2].max()) for body in given.bodies.values()]
    low, high = bed.min() - found.nominal_diameter, max([bed.max(), *(top + up for top in tops)])
    if water is not None and water + up > low:
        high = max(high, min(water + up, high + 2 * found.nominal_diameter))
    high += 0.5 * found.nominal_diameter
    tall = 0.9 + (_WIDE - 0.7) * (high - low) / np.ptp(s)
    figure = Figure(figsize=(_WIDE, float(np.clip(tall, 2.2, 8))), layout="constrained")
    axes = figure.add_subplot(aspect="equal", ylim=(low, high), xlim=(s[0], s[-1]))
    axes.fill_between(s, bed, low, color="#d8ccb4", label="bed")
    for k, body in given.bodies.items():
        cut = _cut(body, start, along)
        cut[..., 1] += up
        axes.add_collection(
            LineCollection(list(cut), colors=_colour(given, given.places[k]), lw=1.3)
        )
    if water is not None and low < water + up < high:
        axes.axhline(water + up, color=_WATER, lw=0.9, ls="--", label="water")
    if thickness := _design(given, found, s, smooth):
        axes.plot(s, smooth + thickness, color="#d98d1f", lw=0.9, ls="-.", label="design surface")
    ends = ["{:.2f}, {:.2f}".format(*given.survey.of(point)) for point in (start, end)]
    axes.set_xlabel(f"from {ends[0]} to {ends[1]} [m]")
    axes.set_ylabel("level [m]")
    _plain(axes)
    figure.legend(loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    return figure


def _colour(given: Handover, p: Place) -> str:
    if p.fixed:
        return _HELD
    if not given.within:
        return _PLAIN
    return _GOOD if is_within(p, given.within.tolerance) else _BAD


def _plain(axes: Axes) -> None:
    """All digits of a survey on the ticks."""
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.tick_params(labelsize=7)
    axes.tick_params(axis="y", labelrotation=90)


def _line(given: Handover, maps: Maps) -> tuple[Array, Array]:
    """The ends (2) of the section in the tank: those that were given, else down the mean slope of
    the bed through the middle of the layer, along x where it is flat."""
    if given.told.section:
        x0, y0, x1, y1 = given.told.section
        return np.array([x0, y0]), np.array([x1, y1])
    row, column = np.nonzero(maps.raised if maps.raised.any() else maps.bed_ball > -np.inf)
    middle = maps.low + maps.step * np.array([column.mean() + 0.5, row.mean() + 0.5])
    fit = np.stack([column, row, np.ones(len(row))], axis=1) * [maps.step, maps.step, 1]
    slope = -np.linalg.lstsq(fit, maps.bed_ball[row, column], rcond=None)[0][:2]
    steep = float(np.linalg.norm(slope))
    along = slope / steep if steep > _FLAT else np.array([1.0, 0.0])
    at = (np.stack([column, row], axis=1) + 0.5) * maps.step + maps.low - middle
    reach = at @ along
    return middle + reach.min() * along, middle + reach.max() * along


def _cut(body: Placed, start: Array, along: Array) -> Array:
    """Lines (m, 2, 2) in which an upright plane cuts the surface of a body: way along the plane and
    height [m]."""
    points = body.triangles
    off = (points[..., :2] - start) @ np.array([-along[1], along[0]])
    way = np.stack([(points[..., :2] - start) @ along, points[..., 2]], axis=-1)
    found = []
    for corners, d in zip(way, off, strict=True):
        pairs = [(i, (i + 1) % 3) for i in range(3) if (d[i] > 0) != (d[(i + 1) % 3] > 0)]
        if pairs:
            found.append(
                [corners[i] + (corners[j] - corners[i]) * d[i] / (d[i] - d[j]) for i, j in pairs]
            )
    return np.array(found).reshape(-1, 2, 2)


def _design(given: Handover, found: Layer, s: Array, bed: Array) -> float:
    """Height of the design surface over the bed [m]; 0 where none is known."""
    free = {given.places[k].shape for k in given.bodies if not given.places[k].fixed}
    kinds = {str(g["name"]).strip(): str(g["kind"]).strip() for g in given.run.parameters["shape"]}
    known = {COEFFICIENTS.get(kinds.get(name, "")) for name in free}
    if len(known) != 1 or not (coefficient := known.pop()):
        return 0.0
    slope = float(np.polyfit(s, bed, 1)[0])
    return found.layers * coefficient * found.nominal_diameter * math.hypot(1, slope)


def write(given: Handover, path: Path) -> Path:
    """Plan and, beside it, section as files of the ending of `path`, svg or pdf."""
    if not given.measured:
        return path
    for figure, name in (
        (plan(given), path),
        (section(given), path.with_stem(f"{path.stem}-section")),
    ):
        files.write(name, drawn(figure, path.suffix[1:]))
    return path


def drawn(figure: Figure, form: str) -> bytes:
    """A figure as a file, the same bytes for the same figure."""
    file = io.BytesIO()
    date = {"svg": "Date", "pdf": "CreationDate"}[form]
    with matplotlib.rc_context({"svg.hashsalt": "mics"}):
        figure.savefig(file, format=form, metadata={date: None})
    return file.getvalue()


def uri(figure: Figure) -> str:
    """A figure as an address that holds it."""
    return "data:image/svg+xml;base64," + base64.b64encode(drawn(figure, "svg")).decode()
