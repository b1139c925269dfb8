"""Initial velocity of the Taylor-Green vortices and the case files, one for each grid."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.cases.initial_state import write_initial_state  # noqa: E402

COSTS = {16: 1, 32: 2, 64: 3, 128: 100}  # cells: [s]
SIDE = 2.0 * np.pi

CASE = """! cost: {cost} s
! Taylor-Green vortices in a periodic square of {n} x {n} cells, {what}.
&run title = 'Taylor-Green vortices, {n} cells'
  t_end = 1.0  dt = {dt}  cfl_max = {cfl_max}  field_interval = 0.5  restart_interval = 0.0 /
&grid cells = {n}, 1, {n}  length = {side}, 1.0, {side} /
&boundary x_min = 'periodic'  x_max = 'periodic'  y_min = 'slip'  y_max = 'slip'
  z_min = 'periodic'  z_max = 'periodic' /
&fluid single_phase = .true.  gravity = 0.0, 0.0, 0.0  liquid_density = 1.0  liquid_viscosity = 0.05
  initial_state = 'cells_{n}.h5' /
&numerics momentum = '{momentum}' /
"""


def write(
    name: str,
    n: int,
    dt: float,
    cost: float,
    what: str,
    momentum: str = "conservative",
    cfl_max: float = 0.5,
) -> None:
    """One case file."""
    fields = {"n": n, "cost": cost, "dt": dt, "side": SIDE, "what": what}
    fields |= {"momentum": momentum, "cfl_max": cfl_max}
    Path(f"{name}.nml").write_text(CASE.format(**fields))


for n, cost in COSTS.items():
    centres = (np.arange(n) + 0.5) * SIDE / n
    x, z = centres[None, None, :], centres[:, None, None]
    u, w = np.cos(x) * np.sin(z), -np.sin(x) * np.cos(z)
    write_initial_state(Path(f"cells_{n}.h5"), velocity=np.stack([u, 0.0 * u, w], axis=-1))
    write(f"cells_{n}", n, 0.1 * (16 / n) ** 2, cost, "time step as the square of the spacing")
    if n <= 64:
        write(f"courant_{n}", n, 0.5, cost, "the longest step that the Courant number allows")
        short = "C-ISMAC, time step as the square of the spacing"
        write(f"ismac_{n}", n, 0.1 * (16 / n) ** 2, cost, short, "c_ismac")
        # |u| + |w| is one at most, so a step of two cells is a Courant number of two.
        write(f"long_{n}", n, 2 * SIDE / n, cost, "C-ISMAC, Courant number 2", "c_ismac", 0.0)
