"""The layer that units form over a bed: its surface, thickness, layer coefficient, porosity and
packing, in two ways.

- `ball`: the surface on which a ball of the diameter D_n/2 rests, the spherical foot of a staff;
  of the bed, too.
- `mean`: the mean height of what is seen from above, of the bed in the gaps.

Definitions (The Rock Manual, CIRIA C683, 3.4.4): k_t = t/(n D_n), n_v = 1 - V/(A t),
N/A = n k_t (1 - n_v)/D_n^2, with the number of layers n, the area A along the slope of the bed, the
thickness t across it and the volume V of the N units. Both ways give one packing.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from micstools.piles import pile_form
from micstools.piles.maps import ground_map, height_map
from micstools.reading.overlap import Placed, images, present_bodies, without_machines
from micstools.reading.places import MEANINGS
from micstools.reading.reader import Run
from micstools.reading.units import Units, figure
from micstools.shapes.geometry import Array, volume_in_box

Corners = tuple[tuple[float, float], tuple[float, float]]
"""Lower and upper corner of a rectangle of the plan [m]."""
BALL = 0.5
"""Diameter of the ball, over D_n."""
FINE = 24
"""Squares of a map of the layer along D_n."""
THIN = 0.01
"""A layer is where it stands higher than this over the bed, over D_n."""
MOST_SQUARES = 4_000_000
"""Of a map; a larger layer has coarser ones."""

DEFINITIONS: dict[str, str] = MEANINGS["layer"]
"""What the numbers of a layer mean."""


@dataclass(frozen=True)
class Surface:
    """Thickness of a layer as one way of measuring finds it."""

    thickness: float  # t [m]
    coefficient: float  # k_t
    porosity: float  # n_v


@dataclass(frozen=True)
class Layer:
    """The layer over an area of the plan."""

    nominal_diameter: float  # D_n [m]
    area: float  # A [m2]
    units: float  # N
    layers: int  # n
    packing: float  # per 100 m2
    packing_density: float  # N/A D_n^2
    ball: Surface
    mean: Surface


@dataclass(frozen=True)
class Maps:
    """Heights (ny, nx) [m] on squares from a corner; the bed, and what lies on it."""

    low: Array  # (2) corner [m]
    step: float  # [m]
    bed: Array
    bed_ball: Array  # on which the ball rests without units
    seen: Array  # of units and bed
    ball: Array  # on which the ball rests
    covered: NDArray[np.bool_]  # by a unit, seen from above
    raised: NDArray[np.bool_]  # where the ball stands above the bed
    lean: Array  # area along the bed over that of the plan

    def outlines(self) -> dict[str, list[Array]]:
        """Closed lines (k, 2) [m] around the layer: by the ball, and around what is covered."""
        masks = {"ball": self.raised, "mean": self.covered}
        return {
            name: pile_form.outline(np.where(mask, 0.0, np.nan), self.low, self.step)
            for name, mask in masks.items()
        }


def nominal_diameter(bodies: Iterable[Placed]) -> float:
    """D_n50 [m]: edge of a cube with the volume of the unit at half of the total mass, units in the
    order of their masses."""
    pairs = sorted((b.shape.volume * b.shape.density, b.shape.volume) for b in bodies)
    mass, volume = np.array(pairs).T
    half = int(np.searchsorted(mass.cumsum(), 0.5 * mass.sum() * (1 - 1e-12)))
    return float(np.cbrt(volume[half]))


def parted(run: Run, row: int = -1) -> tuple[dict[int, Placed], dict[int, Placed]]:
    """The units of a layer by their number, and fixed bodies of shapes that no free one has: these
    belong to the ground. Machines are neither."""
    bodies, b = present_bodies(run, row), run.bodies
    bodies = without_machines(run, bodies)
    free = {b.shape[k] for k in range(b.n) if not b.fixed[k]} or set(b.shape)
    units = {k: body for k, body in bodies.items() if b.shape[k] in free}
    return units, {k: body for k, body in bodies.items() if k not in units}


def on_ball(heights: Array, step: float, radius: float) -> Array:
    """Lowest point [m] of a ball that rests on `heights` (ny, nx), its centre above the middle of
    each square of `step` [m]: the largest of h(p) + sqrt(r^2 - |p - q|^2) - r."""
    reach = int(radius / step)
    padded = np.pad(heights, reach, constant_values=-np.inf)
    rows, columns = heights.shape
    found = np.array(heights)
    for j in range(-reach, reach + 1):
        for i in range(-reach, reach + 1):
            rest = radius**2 - (i * i + j * j) * step**2
            if rest >= 0:
                part = padded[reach + j : reach + j + rows, reach + i : reach + i + columns]
                np.maximum(found, part + (np.sqrt(rest) - radius), out=found)
    return found


def lean(bed: Array, step: float, width: float) -> Array:
    """Area along a bed (ny, nx) [m] over that of the plan, on squares of `step` [m]: by the slope
    of the mean heights of parts about a `width` [m] wide."""
    parts = [np.array_split(np.arange(n), max(2, round(n * step / width))) for n in bed.shape]
    means = np.array([[bed[np.ix_(y, x)].mean() for x in parts[1]] for y in parts[0]])
    middles = [[step * part.mean() for part in along] for along in parts]
    found = np.hypot(1, np.hypot(*np.gradient(means, *middles)))
    y, x = (np.repeat(np.arange(len(along)), [len(part) for part in along]) for along in parts)
    return np.asarray(found[np.ix_(y, x)])


def maps(run: Run, diameter: float, row: int = -1, step: float | None = None,
         area: Corners | None = None) -> Maps:  # fmt: skip
    """The surfaces around the units of a run, and over an `area`, on squares of `step` [m], by
    default a 24th of their nominal `diameter` [m]."""
    units, others = parted(run, row)
    blocks = images(run, units.values())
    points = np.concatenate([body.points for body in blocks])[:, :2]
    if area is not None:
        points = np.concatenate([points, np.array(area)])
    low = np.maximum(run.grid.low, [*points.min(axis=0) - diameter, -np.inf])
    high = np.minimum(run.grid.high, [*points.max(axis=0) + diameter, np.inf])
    least = float(np.sqrt(np.prod((high - low)[:2]) / MOST_SQUARES))
    step = step or max(diameter / FINE, least)
    top = height_map(blocks, low, high, step)
    ground = ground_map(run, low, high, step)
    held = height_map(images(run, others.values()), low, high, step)
    bed = np.fmax(ground, held)
    seen, radius = np.fmax(top, bed), BALL * diameter / 2
    ball, bed_ball = on_ball(seen, step, radius), on_ball(bed, step, radius)
    covered = np.isfinite(top) & (top > bed)
    return Maps(low[:2], step, bed, bed_ball, seen, ball, covered,
                ball > bed_ball + THIN * diameter, lean(ground, step, 2 * diameter))  # fmt: skip


def layer(run: Run, found: Maps, diameter: float, row: int = -1, layers: int | None = None,
          area: Corners | None = None) -> Layer:  # fmt: skip
    """The layer over an `area` in the tank, by default where the ball stands above the bed."""
    units, _ = parted(run, row)
    if area is None:
        inside = found.raised
        size = float(inside.sum()) * found.step**2
        volumes = [body.shape.volume for body in units.values()]
        count = float(len(units))
    else:
        # Squares whose middle lies in the area
        y, x = (found.low[1 - k] + (np.arange(n) + 0.5) * found.step
                for k, n in enumerate(found.seen.shape))  # fmt: skip
        (x0, y0), (x1, y1) = area
        inside = ((y >= y0) & (y < y1))[:, None] & ((x >= x0) & (x < x1))
        low, high = (np.array([*corner, end]) for corner, end in zip(area, (-np.inf, np.inf),
                                                                     strict=True))  # fmt: skip
        size = float(np.prod((high - low)[:2]))
        shown = images(run, units.values())
        volumes = [volume_in_box(body.tets, low, high) for body in shown]
        shares = [v / b.shape.volume for v, b in zip(volumes, shown, strict=True)]
        count = float(sum(shares))
    along = found.lean[inside].mean() if inside.any() else 1.0
    size *= along
    thick = [
        float(np.sum((one - other)[inside])) / max(1, int(inside.sum())) / along
        for one, other in ((found.ball, found.bed_ball), (found.seen, found.bed))
    ]
    n = layers or max(1, round(thick[0] / diameter))
    ball, mean = (_surface(t, n * diameter, sum(volumes), size) for t in thick)
    packing = count / size if size else float("nan")
    return Layer(diameter, size, count, n, 100 * packing, packing * diameter**2, ball, mean)


def of_run(run: Run, row: int = -1, layers: int | None = None,
           area: Corners | None = None) -> tuple[Maps, Layer] | None:  # fmt: skip
    """The layer of a run and its maps; none where no unit is released."""
    units, _ = parted(run, row)
    if not units:
        return None
    diameter = nominal_diameter(units.values())
    found = maps(run, diameter, row, area=area)
    return found, layer(run, found, diameter, row, layers, area)


def words(found: Layer, units: Units) -> list[str]:
    """The layer in two sentences."""
    length = units.length
    ways = ((found.ball, "by the ball"), (found.mean, "on average"))
    thick = ", ".join(f"{length.text(one.thickness)} {way}" for one, way in ways)
    coefficient = ", ".join(f"{one.coefficient:.3g} {way}" for one, way in ways)
    void = ", ".join(f"{100 * one.porosity:.3g}\u00a0% {way}" for one, way in ways)
    count = "1 layer" if found.layers == 1 else f"{found.layers} layers"
    return [
        f"{figure(found.units)} units of D_n = {length.text(found.nominal_diameter)} over "
        f"{units.area.text(found.area)}: {figure(found.packing * units.area.size)} per "
        f"100\u00a0{units.area.name}, packing density "
        f"{found.packing_density:.3g}.",
        f"Thickness {thick}; layer coefficient of {count} {coefficient}; porosity {void}.",
    ]


def _surface(thickness: float, whole: float, volume: float, area: float) -> Surface:
    """By a thickness, the thickness `whole` of solid cubes, and the volume of the units [m3]."""
    room = area * thickness
    porosity = 1 - volume / room if room > 0 else float("nan")
    return Surface(thickness, thickness / whole, porosity)
