"""Humps of water before an outflow, and the same in a tank that goes on, as references."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import below_surface, write_initial_state
from micstools.shapes.geometry import Array

DEPTHS = {"long": (0.0513, 0.2), "medium": (0.1013, 0.1), "short": (0.1513, 0.06)}
COSTS = {"long": 5, "medi": 21, "shor": 21}  # [s]
LENGTH, SPACING, HEIGHT = 1.0, 0.01, 0.002  # of the tank, the cells, the hump [m]


def write(name: str, what: str, depth: float, width: float, length: float, right: str) -> None:
    """The initial state and the case file of one run, in this folder."""
    celerity = float(np.sqrt(9.81 * depth))
    t_end = 2.2 * LENGTH / celerity
    cells, top = round(length / SPACING), 2.0 * depth - 0.0026

    def surface(x: Array) -> Array:
        return depth + HEIGHT * np.exp(-((x / width) ** 2))

    shares = below_surface(surface, np.linspace(0, length, cells + 1), np.linspace(0, top, 21))
    write_initial_state(Path(f"{name}.h5"), shares)
    level = f"water_level = {depth} " if right == "outflow" else ""
    Path(f"{name}.nml").write_text(f"""! cost: {COSTS[name[:4]]} s
! Waves from a hump of water at the left wall, {what}.
&run title = 'waves that leave: {name}'
  t_end = {t_end}  dt = 5.0e-3  field_interval = {t_end / 50}  restart_interval = 0.0 /
&grid cells = {cells}, 1, 20  length = {length}, 0.01, {top} /
&boundary x_min = 'slip'  x_max = '{right}'  y_min = 'slip'  y_max = 'slip'  z_min = 'slip' /
&fluid {level} initial_state = '{name}.h5' /
""")


for kind, (water, sigma) in DEPTHS.items():
    write(kind, "which leave by an outflow", water, sigma, LENGTH, "outflow")
    write(f"{kind}_reference", "in a tank that goes on", water, sigma, 2.4 * LENGTH, "slip")
