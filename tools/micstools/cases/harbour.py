"""A breakwater of many blocks in a large basin: in layers, to plan what a machine has to hold, or
one by one on a slope in a given water, to run."""

import math
from dataclasses import dataclass
from pathlib import Path

from micstools.reading.reader import BadRun

PITCH = 1.5  # distance of the places where blocks are dropped, in heights of a block
CLEAR = 0.8  # of the drop above the water and below the top, likewise
LAYERS = 5  # blocks dropped at one place, as a rule
FALL = 4.0  # s, from one drop at a place to the next
CASE = Path(__file__).with_name("harbour.nml").read_text()
LIGHT = Path(__file__).with_name("harbour_light.nml").read_text()
SLOPE = 2.0  # of the bed, run over rise
FACET = 2.5  # edge of a cell of the bed, in heights of a block
TOP = 1.5  # of the water over the highest place on the slope, in heights of a block
CONTACT_TIME = 0.02  # s, of a block of 2 m
DROP = (
    "&drop shape = 'unit'  position = {x:.4f}, {y:.4f}, {z:.4f}  count = {count}"
    "  interval = {interval:g}  orientation = 'random'  seed = {seed} /\n"
)


@dataclass(frozen=True)
class Harbour:
    """What the case is made of; lengths in m."""

    length: tuple[float, float, float] = (200.0, 100.0, 20.0)
    spacing: float = 0.25  # of the cells
    water: float = 14.0
    blocks: int = 2000
    kind: str = "tetrapod"
    height: float = 2.0
    every: float = 0.0  # s from one block to the next, one by one in a given water; 0: in layers


def slope(harbour: Harbour) -> str:
    """The bed of a case one by one, a map of heights: flat, up from the toe, flat again."""
    x, y, _ = harbour.length
    toe = (y - _rows(harbour)[0] * PITCH * harbour.height) / 2
    n, m = (math.ceil(edge / (FACET * harbour.height)) for edge in (x, y))
    heights = [
        min(max(0.0, (k * y / m - toe) / SLOPE), harbour.water + harbour.height)
        for k in range(m + 1)
    ]
    lines = "\n".join(" ".join([f"{z:.6g}"] * (n + 1)) for z in heights)
    return (
        f"# slope of 1:{SLOPE:g} from y = {toe:g} m on\n"
        f"{n + 1} {m + 1} 0 0 {x / n!r} {y / m!r}\n{lines}\n"
    )


def _rows(harbour: Harbour) -> tuple[int, int]:
    """How many rows of places there are, and how many places in a row."""
    x, y, _ = harbour.length
    pitch = PITCH * harbour.height
    across, along = (y, x) if harbour.every else (x, y)
    most = int(along / pitch)
    rows = min(math.ceil(harbour.blocks / (LAYERS * most)), int(across / pitch))
    return rows, min(most, math.ceil(harbour.blocks / rows))


def one_by_one(harbour: Harbour, bed: str) -> str:
    """The case file: blocks dropped along the slope, row by row from its toe, layer by layer, on
    the bed of the file `bed`."""
    x, y, z = harbour.length
    pitch, clear = PITCH * harbour.height, CLEAR * harbour.height
    _check(harbour, min(x, y))
    rows, along = _rows(harbour)
    highest = (rows - 0.5) * pitch / SLOPE
    if highest > harbour.water - TOP * harbour.height:
        raise BadRun(
            f"--water {harbour.water:g}: {rows} rows of places reach {highest:g} m up the slope, "
            f"{TOP * harbour.height:g} m of water must stand over them; a longer x needs fewer rows"
        )
    places = [(i, j) for i in range(rows) for j in range(along)]
    full, more = divmod(harbour.blocks, len(places))
    every, last = harbour.every, harbour.every * harbour.blocks
    text = LIGHT.format(
        blocks=f"{harbour.blocks} blocks '{harbour.kind}'", height=harbour.height, every=every,
        slope=SLOPE, t_end=last + 60.0, frames=max(1.0, last / 20), rows=max(1.0, last / 200),
        restarts=max(60.0, last / 10), x=x, y=y, z=z, water=harbour.water, kind=harbour.kind,
        contact=CONTACT_TIME * math.sqrt(harbour.height / 2), bed=bed,
        cells=[max(1, round(n / harbour.spacing)) for n in harbour.length],
    )  # fmt: skip
    for number, (i, j) in enumerate(places):
        count = full + (number < more)
        if not count:
            continue
        text += DROP.format(
            x=x / 2 + (j - (along - 1) / 2) * pitch,
            y=y / 2 + (i - (rows - 1) / 2) * pitch,
            z=harbour.water + clear,
            count=count,
            interval=every * len(places),
            seed=f"{number + 1}  first_time = {every * number:g}",
        )
    return text


def _check(harbour: Harbour, along: float) -> None:
    """Sizes, and room for blocks in a row and over the water."""
    x, y, z = harbour.length
    pitch, clear = PITCH * harbour.height, CLEAR * harbour.height
    if not (min(*harbour.length, harbour.spacing, harbour.height) > 0 and harbour.blocks > 0):
        raise BadRun("size, spacing, height and number of blocks must be positive")
    if along < pitch or x < pitch:
        raise BadRun(f"a basin of {x:g} x {y:g} m has no room for blocks of {harbour.height:g} m")
    if not clear <= harbour.water <= z - 2 * clear:
        raise BadRun(
            f"--water {harbour.water:g}: must be {clear:g} to {z - 2 * clear:g} m, for blocks of "
            f"{harbour.height:g} m to be dropped above it"
        )


def case(harbour: Harbour) -> str:
    """The case file: blocks dropped on a strip across the middle of the basin, layer by layer."""
    x, y, z = harbour.length
    pitch, clear = PITCH * harbour.height, CLEAR * harbour.height
    _check(harbour, y)
    rows, along = _rows(harbour)
    places = [(i, j) for i in range(rows) for j in range(along)]
    full, more = divmod(harbour.blocks, len(places))
    waves = full + (more > 0)
    text = CASE.format(
        blocks=f"{harbour.blocks} blocks '{harbour.kind}'",
        height=harbour.height,
        waves=waves,
        x=x,
        y=y,
        z=z,
        t_end=FALL * waves + 10.0,
        cells=[max(1, round(n / harbour.spacing)) for n in harbour.length],
        water=harbour.water,
        kind=harbour.kind,
    )
    for number, (i, j) in enumerate(places):
        text += DROP.format(
            x=x / 2 + (i - (rows - 1) / 2) * pitch,
            y=y / 2 + (j - (along - 1) / 2) * pitch,
            z=harbour.water + clear,
            count=full + (number < more),
            interval=FALL,
            seed=number + 1,
        )
    return text
