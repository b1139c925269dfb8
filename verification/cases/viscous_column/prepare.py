"""Two case files for each column and each dropped body: the default step, and a tenth of it."""

from dataclasses import dataclass
from pathlib import Path

LIQUIDS = {  # density [kg/m3], viscosity [Pa s]
    "oil": (900.0, 0.09),
    "syrup": (1300.0, 1.0),
    "glycerine": (1260.0, 1.4),
    "honey": (1400.0, 10.0),
    "thin": (1000.0, 0.01),
    "thick": (1000.0, 1.0),
}
AIR = 1.82e-5  # viscosity [Pa s]
PLANE = ((60, 1, 40), (0.3, 0.02, 0.2))  # cells, lengths [m]
WIDE = ((120, 1, 40), (0.6, 0.02, 0.2))
SPACE = ((30, 20, 20), (0.3, 0.2, 0.2))
TANK = ((24, 24, 40), (0.12, 0.12, 0.2))
COLUMN = ((0.0, 0.0, 0.0), (0.1, 0.02, 0.15))  # corners [m]
ISLAND = ((0.25, 0.0, 0.0), (0.35, 0.02, 0.15))
CORNER = ((0.0, 0.0, 0.0), (0.1, 0.1, 0.15))
END, EARLY, LATE = 0.4, 0.25, 2.0  # s; the energy is largest before 0.25 s
C_ISMAC, MICS = "momentum = 'c_ismac'", "coupling = 'mics'"
STEPS = {"whole": 1, "tenth": 10}
SPARED = (31, 31)  # s that runs state which the quick level leaves out; they take less


@dataclass(frozen=True)
class Collapse:
    """A column, or with `body` a drop into a tank."""

    liquid: str
    walls: str = "slip"
    top: str = "open"
    gas: float = AIR
    tank: tuple[tuple[int, ...], tuple[float, ...]] = PLANE
    corners: tuple[tuple[float, ...], tuple[float, ...]] = COLUMN
    body: str = ""
    numerics: str = ""
    late: bool = False  # the run with the default step goes on until next to nothing moves
    cost: tuple[float, float] = (0.5, 2)  # s, of the default step and of a tenth


COLLAPSES = {
    "oil_slip": Collapse("oil", cost=SPARED),
    "oil_no_slip": Collapse("oil", "no_slip", cost=SPARED),
    "syrup_slip": Collapse("syrup", cost=SPARED),
    "syrup_no_slip": Collapse("syrup", "no_slip"),
    "glycerine_no_slip": Collapse("glycerine", "no_slip"),
    "glycerine_slip_closed": Collapse("glycerine", top="slip", cost=SPARED),
    "glycerine_wide": Collapse("glycerine", tank=WIDE, corners=ISLAND, cost=SPARED),
    "honey_slip": Collapse("honey"),
    "honey_no_slip": Collapse("honey", "no_slip", late=True),
    "honey_no_slip_closed": Collapse("honey", "no_slip", "no_slip"),
    "honey_wide": Collapse("honey", tank=WIDE, corners=ISLAND, cost=(1, 4)),
    "honey_space": Collapse("honey", "no_slip", tank=SPACE, corners=CORNER, cost=(1, 3)),
    "oil_space": Collapse("oil", "no_slip", tank=SPACE, corners=CORNER, cost=SPARED),
    "equal_thin": Collapse("thin", gas=0.01),
    "equal_thick": Collapse("thick", gas=1.0, cost=(1, 3)),
    "oil_thick_gas": Collapse("oil", gas=0.01),
    "honey_thick_gas": Collapse("honey", gas=0.01, cost=SPARED),
    "sphere_honey": Collapse("honey", tank=TANK, body="sphere", cost=SPARED),
    "cube_honey": Collapse("honey", tank=TANK, body="cube", cost=(2, 6)),
    "honey_no_slip_c_ismac": Collapse("honey", "no_slip", numerics=C_ISMAC, cost=SPARED),
    "equal_thick_c_ismac": Collapse("thick", gas=1.0, numerics=C_ISMAC, cost=SPARED),
    "honey_no_slip_mics": Collapse("honey", "no_slip", numerics=MICS, cost=SPARED),
    "equal_thick_mics": Collapse("thick", gas=1.0, numerics=MICS, cost=SPARED),
    "cube_honey_mics": Collapse("honey", tank=TANK, body="cube", numerics=MICS, cost=SPARED),
}


def numbers(values: tuple[float, ...]) -> str:
    """As a case file has them."""
    return ", ".join(f"{value:g}" for value in values)


def text(name: str, what: Collapse, step: str) -> str:
    """The case file."""
    density, viscosity = LIQUIDS[what.liquid]
    (cells, length), divided = what.tank, STEPS[step]
    end = EARLY if divided > 1 or what.numerics else END
    if what.late and divided == 1:
        end = LATE
    walls = {side: what.walls for side in ("x_min", "x_max", "y_min", "y_max", "z_min")}
    walls |= {"y_min": "slip", "y_max": "slip"} if cells[1] == 1 else {}
    sides = "  ".join(f"{side} = '{kind}'" for side, kind in (walls | {"z_max": what.top}).items())
    low, high = (numbers(corner) for corner in what.corners)
    inside = f"&water  min = {low}  max = {high} /"
    if what.body:
        inside = f"""&shape  name = 'body'  kind = '{what.body}'  size = 0.03  density = 2500.0 /
&drop  shape = 'body'  position = 0.061, 0.0592, 0.16  orientation = 'random' /"""
    called = name.replace("_", " ")
    return f"""! {called}: {"the default step" if divided == 1 else "a tenth of it"}.
! cost: {what.cost[divided > 1]:g} s
&run
  title = '{called}'  t_end = {end:g}
  dt = {0.01 / divided:g}  cfl_max = {0.5 / divided:g}
  field_interval = 0.0  restart_interval = {end:g}
/
&grid  cells = {numbers(cells)}  length = {numbers(length)} /
&boundary  {sides} /
&fluid  liquid_density = {density:g}  liquid_viscosity = {viscosity:g}
  gas_viscosity = {what.gas:g}{"  water_level = 0.12" if what.body else ""} /
{inside}
{f"&numerics  {what.numerics} /" if what.numerics else ""}
"""


for name, what in COLLAPSES.items():
    for step in STEPS:
        if step == "whole" or not what.numerics:
            Path(f"{name}_{step}.nml").write_text(text(name, what, step))
