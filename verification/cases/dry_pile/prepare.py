"""Case files with many blocks: a mixed pile, a cloud of blocks without weight, poured cubes."""

from pathlib import Path

import numpy as np

HEAD = """! {what}
! cost: {cost} s
&run
  title = '{what}'
  physics = 'dry'
  t_end = {end}
  dt = 1.0e-2
  field_interval = 0.0
  restart_interval = 0.0
/
&shape name = 'hexapod'   kind = 'hexapod'   size = 0.02 /
&shape name = 'cube'      kind = 'cube'      size = {cube} /
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
    text = HEAD.format(what="mixed pile", cost=25, end=1.0, cube=0.04)
    text += TANK.format(side=0.3, height=0.5)
    for k, (x, q) in enumerate(zip(grid(64, 4, 0.072, 0.3, 0.04), attitudes(64, 1), strict=True)):
        text += body(SHAPES[k % 4], x, q, np.zeros(3))
    Path("mixed.nml").write_text(text)


def cloud() -> None:
    """27 blocks fly at one another without weight, far from the walls."""
    text = HEAD.format(what="cloud of blocks", cost=5, end=0.3, cube=0.04)
    text += TANK.format(side=2.0, height=2.0) + "&fluid gravity = 0.0, 0.0, 0.0 /\n"
    places = grid(27, 3, 0.1, 2.0, 0.9)
    for k, (x, q) in enumerate(zip(places, attitudes(27, 2), strict=True)):
        text += body(SHAPES[k % 4], x, q, 10.0 * (np.array([1.003, 0.998, 1.001]) - x))
    Path("cloud.nml").write_text(text)


def cubes() -> None:
    """200 cubes are poured."""
    text = HEAD.format(what="200 cubes", cost=200, end=2.0, cube=0.02)
    text += TANK.format(side=0.15, height=0.6)
    places = grid(200, 4, 0.037, 0.15, 0.02)
    for x, q in zip(places, attitudes(200, 3), strict=True):
        text += body("cube", x, q, np.zeros(3))
    Path("cubes.nml").write_text(text)


mixed()
cloud()
cubes()
