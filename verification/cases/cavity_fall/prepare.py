"""One case file for each drop: shape, size, surface tension, cells, Courant number, seed."""

from math import sqrt
from pathlib import Path

PROTOTYPE, MODEL = 2.0, 0.05  # length of the block [m]
SIZE = {"tetrapod": 1.0, "hexapod": 1 / 3, "dolos": 1.0, "cube": 1.0}  # of &shape [lengths]
SEEDS = {"tetrapod": (1, 4, 5), "hexapod": (1, 2, 6), "dolos": (1, 2, 6), "cube": (1, 3, 4)}
MODEL_SEEDS = {"tetrapod": (2, 4), "hexapod": (1, 2), "dolos": (1, 2), "cube": (1, 3)}
TENSION_SEEDS = {"tetrapod": (4,), "dolos": (2,), "cube": (1, 2)}
FINE_SEEDS = {"tetrapod": (1, 2), "hexapod": (1,), "dolos": (1,), "cube": (1,)}
TEXT = """! A {kind} of {length:g} m falls into water, {cells} cells along it, seed {seed}.
! cost: {cost:g} s
&run
  title = '{kind} of {length:g} m into water'
  t_end = {end:.6g}
  dt = {dt:.6g}
  cfl_max = {courant:g}
  field_interval = 0.0
  restart_interval = {end:.6g}
/
&grid  cells = {nx}, {nx}, {nz}  length = {across:g}, {across:g}, {high:g} /
&boundary  x_min = 'slip'  x_max = 'slip'  y_min = 'slip'  y_max = 'slip' /
&fluid  water_level = {level:g}  liquid_density = 1025.0  surface_tension = {tension:g} /
&contact  contact_time = {impact:.6g} /
&shape  name = 'block'  kind = '{kind}'  size = {size:.9g}  density = 2400.0 /
&drop
  shape = 'block'  position = {middle:g}, {middle:g}, {start:g}  velocity = 0.0, 0.0, -{speed:.6g}
  orientation = 'random'  spread = {spread:g}, {spread:g}, 0.0  seed = {seed}
/
"""


def write(
    kind: str,
    seed: int,
    length: float = PROTOTYPE,
    cells: int = 5,
    courant: float = 1.0,
    tension: float = 0.0,
) -> None:
    """A tank 4 x 4 x 6.8 lengths with a level of 5.025; times go with the root of the length."""
    slow = sqrt(length / PROTOTYPE)
    name = f"{kind}_{'prototype' if length == PROTOTYPE else 'model'}"
    name += f"{'_tension' if tension else ''}_{cells:02d}_{100 * courant:03.0f}_{seed}.nml"
    text = TEXT.format(
        kind=kind,
        seed=seed,
        length=length,
        cells=cells,
        cost=8 if cells > 5 else 0.7 / courant,
        end=2.2 * slow,
        dt=0.05 * slow,
        courant=courant,
        nx=4 * cells,
        nz=round(6.8 * cells),
        across=4 * length,
        high=6.8 * length,
        level=5.025 * length,
        tension=tension,
        impact=0.02 * slow,
        size=SIZE[kind] * length,
        middle=2 * length,
        start=5.8 * length,
        speed=0.5 * slow,
        spread=0.15 * length,
    )
    Path(name).write_text(text)


for kind, seeds in SEEDS.items():
    for seed in seeds:
        write(kind, seed)
for kind, seeds in MODEL_SEEDS.items():
    for seed in seeds:
        write(kind, seed, MODEL)
for kind, seeds in TENSION_SEEDS.items():
    for seed in seeds:
        write(kind, seed, MODEL, tension=0.072)
for seed in (4, 5):
    for courant in (0.5, 0.25):
        write("tetrapod", seed, courant=courant)
for kind, seeds in FINE_SEEDS.items():
    for seed in seeds:
        write(kind, seed, cells=10)
