"""Case files with many blocks: a mixed pile, a cloud of blocks without weight, poured cubes."""

from pathlib import Path

import numpy as np

HEAD = Path(__file__).with_name("head.txt").read_text()
KINDS = """&shape name = 'hexapod'   kind = 'hexapod'   size = 0.02 /
&shape name = 'cube'      kind = 'cube'      size = 0.04 /
&shape name = 'tetrapod'  kind = 'tetrapod'  size = 0.05  refinement = 1 /
&shape name = 'sphere'    kind = 'sphere'    size = 0.04 /
"""
TANK = "&grid  cells = 20, 20, 20  length = {side:g}, {side:g}, {height:g} /\n"
SHAPES = ("hexapod", "cube", "tetrapod", "sphere")


def body(shape: str, x: np.ndarray, q: np.ndarray, v: np.ndarray) -> str:
    """A block."""
    place, turned, speed = (", ".join(f"{a:.12g}" for a in values) for values in (x, q, v))
    where = f"position = {place}  quaternion = {turned}  velocity = {speed}"
    return f"&body shape = '{shape}'  {where} /\n"


def grid(n: int, across: int, pitch: float, side: float, low: float) -> np.ndarray:
    """Places (n, 3): square layers in the middle of the tank, one above the other."""
    k = np.arange(n)
    start = 0.5 * (side - (across - 1) * pitch)
    column, row, layer = k % across, k // across % across, k // across**2
    return np.stack([start + pitch * column, start + pitch * row, low + pitch * layer], axis=1)


def attitudes(n: int, seed: int) -> np.ndarray:
    """Uniform over rotations."""
    q = np.random.default_rng(seed).normal(size=(n, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def mixed() -> None:
    """Sixteen of each shape fall and pile up."""
    text = HEAD.format(what="mixed pile", cost=21, end=1.0) + KINDS
    text += TANK.format(side=0.3, height=0.5)
    for k, (x, q) in enumerate(zip(grid(64, 4, 0.072, 0.3, 0.04), attitudes(64, 1), strict=True)):
        text += body(SHAPES[k % 4], x, q, np.zeros(3))
    Path("mixed.nml").write_text(text)


def cloud() -> None:
    """27 blocks fly at one another without weight, far from the walls."""
    text = HEAD.format(what="cloud of blocks", cost=5, end=0.3) + KINDS
    text += TANK.format(side=2.0, height=2.0) + "&fluid gravity = 0.0, 0.0, 0.0 /\n"
    places = grid(27, 3, 0.1, 2.0, 0.9)
    for k, (x, q) in enumerate(zip(places, attitudes(27, 2), strict=True)):
        text += body(SHAPES[k % 4], x, q, 10.0 * (np.array([1.003, 0.998, 1.001]) - x))
    Path("cloud.nml").write_text(text)


def dumped(name: str, what: str, cost: int, end: float, friction: str) -> None:
    """200 cubes that stand above the tank are let go all at once."""
    text = HEAD.format(what=what, cost=cost, end=end)
    text += "&shape name = 'cube'  kind = 'cube'  size = 0.02 /\n"
    text += TANK.format(side=0.15, height=0.6) + friction
    places = grid(200, 4, 0.037, 0.15, 0.02)
    for x, q in zip(places, attitudes(200, 3), strict=True):
        text += body("cube", x, q, np.zeros(3))
    Path(f"{name}.nml").write_text(text)


def poured(name: str, shape: str, side: float, margin: float, n: int, interval: float) -> None:
    """Blocks fall one by one, at random over the tank and any way up."""
    text = HEAD.format(what=f"{n} {name}", cost=21 if n < 100 else 60, end=n * interval + 0.6)
    text += f"&shape name = 'unit'  {shape} /\n" + TANK.format(side=side, height=0.5)
    middle, spread = 0.5 * side, 0.5 * side - margin
    text += (
        f"&drop shape = 'unit'  position = {middle:g}, {middle:g}, 0.3"
        f"  spread = {spread:g}, {spread:g}, 0  velocity = 0, 0, -0.5\n"
        f"  count = {n}  interval = {interval:g}  orientation = 'random'  seed = 3 /\n"
    )
    Path(f"{name}.nml").write_text(text)


mixed()
cloud()
poured("cubes", "kind = 'cube'  size = 0.02", 0.15, 0.025, 200, 0.02)
poured("hexapods", "kind = 'hexapod'  size = 0.02  refinement = 1", 0.3, 0.05, 80, 0.03)
poured("tetrapods", "kind = 'tetrapod'  size = 0.06  refinement = 1", 0.3, 0.05, 80, 0.03)
poured("dolosse", "kind = 'dolos'  size = 0.07  refinement = 1", 0.3, 0.05, 80, 0.03)
dumped("dumped", "200 cubes let go at once", 40, 1.5, "")
SMOOTH = "&contact friction = 0  wall_friction = 0 /\n"
dumped("smooth", "200 cubes without friction", 60, 1.0, SMOOTH)
