"""Case files for bounces: restitutions on a wall and between blocks, a ball under gravity, and
springs of a power law with a dashpot."""

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
HEAD = Path(__file__).with_name("head.txt").read_text()
TANK = "&grid  cells = 70, 20, 20  length = 0.7, 0.2, {height:g} /\n"
NO_WEIGHT = "&fluid gravity = 0.0, 0.0, 0.0 /\n"
SHAPES = """&shape name = 'sphere'  kind = 'sphere'  size = 0.04 /
&shape name = 'cube'  kind = 'cube'  size = 0.03 /
&shape name = 'slab'  kind = 'box'  size = 0.06, 0.06, 0.03 /
"""
DOWN = 0.3  # [m/s]
EDGE = "axis = 1, 0, 0  angle_deg = 45"
ACROSS = "axis = 0, 1, 0  angle_deg = 45"
CORNER = "axis = -1, 1, 0  angle_deg = 54.735610317245346"
ON_FLOOR = (("sphere", ""), ("cube", ""), ("cube", EDGE), ("cube", CORNER))
PAIRS = (  # lower one and how it lies, upper one and how it lies
    ("sphere", "", "sphere", ""),
    ("cube", "", "cube", ""),
    ("slab", "", "cube", EDGE),
    ("slab", "", "cube", CORNER),
    ("cube", ACROSS, "cube", EDGE),
)
OBLIQUE = (
    ("cube", "", "cube", EDGE),
    ("cube", EDGE, "cube", EDGE),
    ("cube", CORNER, "cube", CORNER),
)


STEP = 1e-3  # [s]


def body(shape: str, place: tuple[float, ...], speed: float, attitude: str = "") -> str:
    """A block that moves up or down."""
    where = ", ".join(f"{x:.12g}" for x in place)
    moves = f"velocity = 0, 0, {speed:.12g}"
    return f"&body shape = '{shape}'  position = {where}  {moves}  {attitude} /\n"


def restitution(e: float, dt: float) -> None:
    """Sphere and cubes at the floor, and blocks against one another; no friction."""
    text = HEAD.format(what=f"restitution {e:g}", end=0.12, dt=dt) + TANK.format(height=0.2)
    text += NO_WEIGHT + SHAPES
    text += f"&contact restitution = {e:g}  friction = 0  wall_friction = 0 /\n"
    name = f"e{100 * e:03.0f}" + (f"_{1e3 * dt:g}ms" if dt > STEP else "")
    on_floor = "".join(
        body(shape, (0.05 + 0.1 * k, 0.05, 0.032), -DOWN, attitude)
        for k, (shape, attitude) in enumerate(ON_FLOOR)
    )
    Path(f"{name}.nml").write_text(text + on_floor + pairs(PAIRS))
    Path(f"oblique_{name}.nml").write_text(text + pairs(OBLIQUE))


def pairs(which: tuple[tuple[str, str, str, str], ...]) -> str:
    """Blocks that meet two by two."""
    text = ""
    for k, (low, low_lies, high, high_lies) in enumerate(which):
        text += body(low, (0.05 + 0.1 * k, 0.15, 0.07), DOWN, low_lies)
        text += body(high, (0.05 + 0.1 * k, 0.15, 0.13), -DOWN, high_lies)
    return text


def ball(h: float, e: float, end: float, contact_time: float) -> None:
    """A ball dropped from a height; time to see the second impact."""
    what = f"ball from {h:g} m, restitution {e:g}"
    text = HEAD.format(what=what, end=end, dt=1e-3) + TANK.format(height=1.2) + SHAPES
    text += f"&contact model = 'spheres'  restitution = {e:g}  contact_time = {contact_time:g} /\n"
    text += body("sphere", (0.1, 0.1, 0.02 + h), 0.0)
    Path(f"ball_h{100 * h:.0f}_e{100 * e:.0f}_{1e6 * contact_time:.0f}us.nml").write_text(text)


RADIUS, MASS = 0.02, 0.1  # of the sphere [m], [kg]
LENGTH, TIME = 1e-4, 1e-2  # units of the tables: m = k = 1 [m], [s]


def power_law(name: str, gamma: float, damping: float, speeds: list[float]) -> None:
    """Spheres at several speeds hit the floor, a spring k d^gamma with a dashpot."""
    density = MASS / (4.0 / 3.0 * np.pi * RADIUS**3)
    k = MASS / (TIME**2 * LENGTH ** (gamma - 1.0))
    text = HEAD.format(what=f"spring of power {gamma:g}", end=0.07, dt=1e-4)
    text += TANK.format(height=0.2) + NO_WEIGHT
    text += f"&shape name = 'sphere'  kind = 'sphere'  size = 0.04  density = {density:.16g} /\n"
    text += f"&contact model = 'spheres'  law = 'constants'  k_n = {k:.16g}  gamma_n = {gamma:g}"
    text += f"  eta_n = {damping * MASS / TIME:.16g}  friction = 0  wall_friction = 0 /\n"
    for n, v in enumerate(speeds):
        speed = v * LENGTH / TIME
        text += body("sphere", (0.05 + 0.1 * n, 0.1, RADIUS + speed * 1e-3), -speed)
    Path(f"{name}.nml").write_text(text)


for e in (0.1, 0.3, 0.5, 0.7, 0.9, 1.0):
    restitution(e, STEP)
for e in (0.25, 0.75):
    for dt in (STEP, 4e-3, 2e-2):
        restitution(e, dt)
for h, e, _, _, second, _ in np.loadtxt(HERE / "D7.csv", delimiter=",", skiprows=2):
    for contact_time in (2e-3, 5e-4):
        ball(h, e, 1.1 * second, contact_time)
hertz = np.loadtxt(HERE / "D3_hertz.csv", delimiter=",", skiprows=2)
for c in sorted(set(hertz[:, 1])):
    power_law(f"hertz_c{10 * c:02.0f}", 1.5, c, sorted(set(hertz[:, 0])))
for p, *_ in np.loadtxt(HERE / "D3_power.csv", delimiter=",", skiprows=2):
    power_law(f"power_{100 * p:.0f}", p, 0.0, [1.0])
