"""A breakwater of many blocks in a large basin, to plan what a machine has to hold."""

import math
from dataclasses import dataclass

from micstools.reading.reader import BadRun

PITCH = 1.5  # distance of the places where blocks are dropped, in heights of a block
CLEAR = 0.8  # of the drop above the water and below the top, likewise
LAYERS = 5  # blocks dropped at one place, as a rule
FALL = 4.0  # s, from one drop at a place to the next
CASE = """\
! {blocks} of {height:g} m in {waves} layers, dropped across a basin of {x:g} x {y:g} x {z:g} m
&run
  title = 'harbour'
  t_end = {t_end:g}
  dt = 0.02
  output = 'harbour-out'
  field_interval = 1.0
  history_interval = 0.1
  restart_interval = 5.0
/
&grid cells = {cells[0]}, {cells[1]}, {cells[2]}  length = {x:g}, {y:g}, {z:g} /
&boundary x_min = 'slip'  x_max = 'slip'  y_min = 'slip'  y_max = 'slip'  z_max = 'open' /
&fluid water_level = {water:g} /
&contact contact_time = 0.02 /
&shape name = 'unit'  kind = '{kind}'  size = {height:g}  density = 2400.0 /
"""
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


def case(harbour: Harbour) -> str:
    """The case file: blocks dropped on a strip across the middle of the basin, layer by layer."""
    x, y, z = harbour.length
    pitch, clear = PITCH * harbour.height, CLEAR * harbour.height
    if not (min(*harbour.length, harbour.spacing, harbour.height) > 0 and harbour.blocks > 0):
        raise BadRun("size, spacing, height and number of blocks must be positive")
    along = int(y / pitch)
    if along < 1 or x < pitch:
        raise BadRun(f"a basin of {x:g} x {y:g} m has no room for blocks of {harbour.height:g} m")
    if not clear <= harbour.water <= z - 2 * clear:
        raise BadRun(
            f"--water {harbour.water:g}: must be {clear:g} to {z - 2 * clear:g} m, for blocks of "
            f"{harbour.height:g} m to be dropped above it"
        )
    rows = min(math.ceil(harbour.blocks / (LAYERS * along)), int(x / pitch))
    along = min(along, math.ceil(harbour.blocks / rows))
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
