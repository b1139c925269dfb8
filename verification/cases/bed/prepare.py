"""Beds as maps of heights and as an STL file, and the cases over them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

ANGLE = 20.0  # of the slope [degrees]
SLOPE = np.tan(np.radians(ANGLE))
FLAT = 0.02  # height of the flat bed [m]
GROOVE = 0.02  # height of the bottom of the groove [m]

DRY = """! {title}
! cost: {cost}
&run
  title = '{title}'
  physics = 'dry'
  t_end = {end}
  dt = 1.0e-2
  field_interval = 0.0
  restart_interval = 0.0
/
"""
WET = """! {title}
! cost: {cost}
&run
  title = '{title}'
  t_end = {end}
  dt = 5.0e-3
  field_interval = 0.1
  restart_interval = 0.0
/
"""


def heights(
    name: str,
    low: tuple[float, float],
    high: tuple[float, float],
    n: tuple[int, int],
    height: Callable[[float, float], float],
) -> None:
    """A map of n points over a rectangle."""
    x, y = (np.linspace(low[k], high[k], n[k]) for k in range(2))
    step = [(high[k] - low[k]) / (n[k] - 1) for k in range(2)]
    rows = [" ".join(f"{height(a, b):.17g}" for a in x) for b in y]
    head = f"{n[0]} {n[1]} {low[0]:.17g} {low[1]:.17g} {step[0]:.17g} {step[1]:.17g}"
    Path(name).write_text("\n".join(["# made by prepare.py", head, *rows, ""]))


def octahedra(name: str, centres: np.ndarray, radius: float) -> None:
    """Closed stones that float and hang over: octahedra turned at random, as one STL file."""
    rng = np.random.default_rng(3)
    lines = ["solid stones"]
    for centre in centres:
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.linalg.det(turn)
        for signs in np.array(np.meshgrid(*[[1, -1]] * 3)).reshape(3, -1).T:
            corners = centre + radius * (turn @ np.diag(signs)).T[:: int(np.prod(signs))]
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(f"{c:.17g}" for c in corner) for corner in corners]
            lines += ["endloop", "endfacet"]
    Path(name).write_text("\n".join([*lines, "endsolid stones", ""]))


def slope_case(name: str, mu: float, end: float, model: str, sphere: bool) -> None:
    """A flat box, and a sphere, put on the slope."""
    normal = np.array([np.sin(np.radians(ANGLE)), 0.0, np.cos(np.radians(ANGLE))])
    text = DRY.format(title=f"slope of 20 degrees, friction {mu:g}", cost="0.5 s", end=end)
    text += "&grid  cells = 55, 15, 30  length = 1.1, 0.3, 0.6 /\n&bed file = 'slope.txt' /\n"
    text += f"&contact model = '{model}'  wall_friction = {mu:g}  sleep = F /\n"
    stand = 0.01 if model == "surface" else 0.0111  # contact spheres reach beyond the box
    blocks = (("box", "0.04, 0.04, 0.02", stand), ("sphere", "0.04", 0.02))
    for k, (shape, size, rise) in enumerate(blocks[: 1 + sphere]):
        centre = [0.15, 0.08 + 0.13 * k, 0.45 - 0.15 * SLOPE] + rise * normal
        place = ", ".join(f"{c:.15g}" for c in centre)
        text += f"&shape name = '{shape}'  kind = '{shape}'  size = {size} /\n"
        text += f"&body shape = '{shape}'  position = {place}\n"
        text += f"  axis = 0, 1, 0  angle_deg = {ANGLE} /\n"
    Path(f"{name}.nml").write_text(text)


heights("slope.txt", (0.0, 0.0), (1.1, 0.3), (56, 16), lambda x, _: 0.45 - SLOPE * x)
heights("flat.txt", (-0.013, -0.02), (0.12, 0.13), (8, 6), lambda *_: FLAT)
heights("groove.txt", (0.0, 0.0), (0.1, 0.1), (21, 11), lambda x, _: GROOVE + abs(x - 0.05))
rough = np.random.default_rng(1)
heights(
    "rough.txt", (-0.01, -0.01), (0.11, 0.11), (25, 25), lambda *_: 0.015 + 0.012 * rough.random()
)
octahedra(
    "stones.stl",
    np.array([[0.025, 0.03, 0.02], [0.07, 0.03, 0.03], [0.03, 0.07, 0.05], [0.075, 0.072, 0.055]]),
    0.019,
)

slope_case("slope_stand", 0.4, 2.0, "surface", sphere=False)
slope_case("slope_stand_spheres", 0.4, 2.0, "spheres", sphere=False)
slope_case("slope_slide", 0.2, 0.6, "surface", sphere=True)

Path("groove.nml").write_text(
    DRY.format(title="a cube in a groove", cost="0.2 s", end=1.5)
    + """&grid  cells = 10, 10, 10  length = 0.1, 0.1, 0.1 /
&bed file = 'groove.txt' /
&shape name = 'cube'  kind = 'cube'  size = 0.02 /
&body shape = 'cube'  position = 0.0497, 0.05, 0.037  axis = 0, 1, 0  angle_deg = 44 /
"""
)

BLOCKS = """&contact model = '{model}' /
&shape name = 'cube'  kind = 'cube'  size = 0.02 /
&shape name = 'ball'  kind = 'sphere'  size = 0.02 /
&body shape = 'cube'  position = 0.03, 0.06, {cube:g} /
&body shape = 'ball'  position = 0.073, 0.041, {ball:g} /
"""
WAVE = (
    "&water min = 0, 0, 0  max = 0.06, 0.1, 0.07 /\n&water min = 0, 0, 0  max = 0.1, 0.1, 0.045 /\n"
)
TANK = "&grid  cells = 10, 10, 10  length = 0.1, 0.1, 0.1 /\n"
FLOORS = {
    "bed": TANK + "&bed file = 'flat.txt' /\n",
    "wall": f"&grid  cells = 10, 10, 8  length = 0.1, 0.1, 0.08  origin = 0, 0, {FLAT} /\n",
    "box": TANK + f"&shape name = 'floor'  kind = 'box'  size = 0.1, 0.1, {FLAT} /\n"
    f"&body shape = 'floor'  position = 0.05, 0.05, {FLAT / 2}  fixed = T /\n",
}
for floor in ("bed", "wall"):
    for model in ("surface", "spheres"):
        text = DRY.format(title=f"blocks on a flat {floor}", cost="0.1 s", end=0.5) + FLOORS[floor]
        text += BLOCKS.format(model=model, cube=FLAT + 0.02, ball=FLAT + 0.025)
        Path(f"flat_{floor}_{model}.nml").write_text(text)
for floor in ("bed", "box"):
    text = WET.format(title=f"a wave over a flat {floor}", cost="0.2 s", end=0.2)
    Path(f"flat_{floor}_wave.nml").write_text(text + FLOORS[floor] + WAVE)
for name, file, kind, level in (
    ("rough", "rough.txt", "heightmap", 0.053),
    ("stones", "stones.stl", "stl", 0.0871),
):
    Path(f"{name}.nml").write_text(
        WET.format(title=f"still water over a bed: {name}", cost="1 s", end=1.0)
        + "&grid  cells = 12, 11, 10  length = 0.1, 0.1, 0.1 /\n"
        + f"&bed file = '{file}'  kind = '{kind}' /\n&fluid water_level = {level} /\n"
    )

Path("drop.nml").write_text(
    WET.format(title="blocks dropped in water on a rough bed", cost="2 s", end=1.0)
    + """&grid  cells = 14, 14, 14  length = 0.1, 0.1, 0.1 /
&bed file = 'rough.txt' /
&fluid water_level = 0.0712 /
&shape name = 'hexapod'  kind = 'hexapod'  size = 0.01 /
&shape name = 'ball'  kind = 'sphere'  size = 0.016 /
&body shape = 'hexapod'  position = 0.04, 0.055, 0.05  axis = 1, 2, 3  angle_deg = 30 /
&drop shape = 'ball'  position = 0.075, 0.03, 0.045  first_time = 0.02 /
"""
)
