"""Numbers of a pile, of the true shapes at one row of a run: lengths in m, speeds in m/s."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from micstools.piles import layer, pile_form
from micstools.piles.maps import bed_volume, ground_map, height_map
from micstools.piles.options import Options
from micstools.reading import block_numbers, rest
from micstools.reading.overlap import find_contacts, images, present_bodies, without_machines
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import SI, Unit, Units, ascii_of
from micstools.shapes.geometry import Array


@dataclass(frozen=True)
class PileNumbers:
    """What is counted and measured of a pile."""

    blocks: int  # released
    on_floor: int  # of them, dropped and touching the floor or the bed
    plan_area: float  # covered, seen from above [m2]
    top: float  # highest point [m]
    coordination: float  # blocks that touch a block, on average
    centre: tuple[float, float, float]  # of mass [m]
    spread: tuple[float, float]  # standard deviation of the centroids in x and y [m]
    time_to_rest: float  # [s]; nan where the blocks still move
    fall_time: float  # of the first block that is let go, until it touches something [s]
    fall_speed: float  # its largest speed until then [m/s]
    terminal_speed: float  # its speed once that has settled; nan of a short fall [m/s]
    fall_drift: float  # its way until then, seen from above [m]
    impact_speed: float  # largest speed of a dropped block at its first touch [m/s]
    contact_force: float  # largest on a free block, a mean over a step [N]
    peak_force: float  # the same within a step: an impact's impulse over contact_time [N]
    slopes: tuple[float, float, float, float]  # of the sides towards -x, +x, -y, +y [degrees]
    attitude_randomness: float  # of the free blocks of the commonest shape; 0 alike, 1 random
    porosity: float
    box: tuple[float, ...]  # its low and its high corner [m]
    height: float  # largest, of the top above the floor or the bed under it [m]
    layer_thickness: float  # mean of the same over the plan area [m], upright
    layer_porosity: float
    footprint: float  # the smallest convex plan that holds the pile [m2]
    thickness_ball: float  # of the layer as `piles.layer` defines it, by the ball [m]
    coefficient_ball: float  # layer coefficient of as many layers as fit best
    porosity_ball: float
    packing: float  # units per 100 m2 of the layer


KINDS = {
    "plan_area": "area", "top": "place", "centre": "place", "spread": "length",
    "time_to_rest": "time", "fall_time": "time", "fall_speed": "speed", "fall_drift": "length",
    "terminal_speed": "speed",
    "impact_speed": "speed", "contact_force": "force",
    "peak_force": "force", "slopes": "angle", "box": "place", "height": "length",
    "layer_thickness": "length", "footprint": "area", "thickness_ball": "length",
}  # fmt: skip
"""What the numbers that have a unit are, as `Units` names it."""
MEANING = {
    "porosity": ", of the box above the bed",
    "layer_porosity": ", of the plan area times the thickness on average",
    "porosity_ball": ", of the layer by the ball",
}
"""Of numbers that are taken for each other."""


def unit(units: Units, name: str) -> Unit:
    """The unit of a number by its name, as `top`, or of a part of it, as `box_x_min`."""
    kind = KINDS.get(name) or KINDS.get(name.split("_")[0], "number")
    return units.of_kind(kind)


def si_units(names: Iterable[str]) -> dict[str, str]:
    """The SI unit of each number that has one, as files hold it."""
    found = {name: ascii_of(unit(SI, name).name) for name in names}
    return {name: text for name, text in found.items() if text}


def words(units: Units, name: str, values: Iterable[float]) -> str:
    """A number by its name, or its parts, with its unit, in ASCII."""
    return ascii_of(unit(units, name).row(values, digits=5))


def numbers(
    run: Run, step: float, row: int = -1, box: tuple[Array, Array] | None = None,
    told: Options = Options(),  # noqa: B008 (it is frozen)
) -> PileNumbers:  # fmt: skip
    """The numbers of a pile; its plan area is counted on squares of `step` [m], its porosity in a
    `box`, by default that around the pile; layers and area of its layer as `told`."""
    b = run.bodies
    if not b.n:
        raise BadRun(f"{run.folder} holds no blocks: there is no pile to look at")
    row = row % len(b.time)
    bodies, seen = present_bodies(run, row), find_contacts(run, row)
    bodies = without_machines(run, bodies)
    if not layer.parted(run, row)[0]:
        raise BadRun(f"{run.folder}: no block is let go at t = {b.time[row]:g} s: there is no pile")
    blocks = images(run, bodies.values())
    top = height_map(blocks, run.grid.low, run.grid.high, step)
    here = list(bodies)
    mass, place = b.mass[here], np.array([body.position for body in bodies.values()])
    # Through periodic sides, around the middle of all
    period = np.where(run.period > 0, run.period, np.inf)
    turn = 2 * np.pi * place / period
    middle = run.period / (2 * np.pi) * np.arctan2(mass @ np.sin(turn), mass @ np.cos(turn))
    place -= run.period * np.round((place - middle) / period)
    x, y, z = (float(v) for v in run.into_tank(mass @ place / mass.sum()))
    away = np.where(run.period > 0, (run.grid.low + run.grid.high) / 2 - middle, 0) / step
    low, high = box or pile_form.around(blocks, run.grid.low, run.grid.high)
    ground = ground_map(run, run.grid.low, run.grid.high, step)
    thickness, height = pile_form.layer(top, ground)
    top, ground = (np.roll(m, away[1::-1].round().astype(int), (0, 1)) for m in (top, ground))
    highest = max(float(body.points[:, 2].max()) for body in blocks)
    if not len(run.bed[1]):
        height = highest - float(run.grid.low[2])  # exact
    area = float(np.isfinite(top).sum() * step**2)
    volume = sum(body.shape.volume for body in bodies.values())
    measured = layer.of_run(run, row, told.layers, told.corners(run))
    found = measured[1] if measured else None
    ball = found.ball if found else layer.Surface(*[float("nan")] * 3)
    struck = block_numbers.of_blocks(run)
    return PileNumbers(
        blocks=len(bodies),
        on_floor=sum(seen.on_floor(int(k)) for k in b.dropped),
        plan_area=area,
        top=highest,
        coordination=2 * sum(bodies.keys() >= {*pair} for pair in seen.blocks) / len(bodies),
        centre=(x, y, z),
        spread=(float(place[:, 0].std()), float(place[:, 1].std())),
        time_to_rest=time_to_rest(run),
        fall_time=struck[0].fall_time if struck else float("nan"),
        fall_speed=struck[0].fastest if struck else float("nan"),
        terminal_speed=struck[0].terminal if struck else float("nan"),
        fall_drift=struck[0].drift if struck else float("nan"),
        impact_speed=impact_speed(run),
        contact_force=max((k.contact_force for k in struck), default=float("nan")),
        peak_force=max((k.peak_force for k in struck), default=float("nan")),
        slopes=pile_form.slopes(top - ground, step),
        attitude_randomness=_randomness(run, row),
        porosity=pile_form.porosity(blocks, low, high, bed_volume(run, low, high, step)),
        box=tuple(float(v) for v in (*low, *high)),
        height=height,
        layer_thickness=thickness,
        layer_porosity=1 - volume / (area * thickness) if area * thickness > 0 else float("nan"),
        footprint=pile_form.footprint(top, step),
        thickness_ball=ball.thickness,
        coefficient_ball=ball.coefficient,
        porosity_ball=ball.porosity,
        packing=found.packing if found else float("nan"),
    )


def _randomness(run: Run, row: int) -> float:
    """How differently the free blocks of the commonest shape lie."""
    b = run.bodies
    free = [int(k) for k in b.dropped if b.present(row)[k]]
    if not free:
        return float("nan")
    ((name, _),) = Counter(b.shape[k] for k in free).most_common(1)
    alike = [k for k in free if b.shape[k] == name]
    return pile_form.attitude_randomness(run.shapes[name], b.quaternion[row, alike])


def time_to_rest(run: Run) -> float:
    """Time [s] after which every free block stays; nan where one moves or is still to come."""
    if run.bodies.to_come(-1).any():
        return float("nan")
    times = [found.time for found in rest.of_blocks(run)]
    return float(np.max(times, initial=0.0))


def impact_speed(run: Run) -> float:
    """Largest speed [m/s] of a dropped block before its first touch; nan without one."""
    found = run.bodies.impact_speed[run.bodies.dropped]
    return float(np.nanmax(found)) if np.isfinite(found).any() else float("nan")
