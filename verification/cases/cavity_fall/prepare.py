"""One case file for each drop: shape, size, surface tension, cells, Courant number, seed."""

from math import sqrt
from pathlib import Path

TEXT = Path(__file__).with_name("template.txt").read_text()
PROTOTYPE, MODEL = 2.0, 0.05  # length of the block [m]
SIZE = {"tetrapod": 1.0, "hexapod": 1 / 3, "dolos": 1.0, "cube": 1.0}  # of &shape [lengths]
SEEDS = {"tetrapod": (1, 4, 5), "hexapod": (1, 2, 6), "dolos": (1, 2, 6), "cube": (1, 3, 4)}
MODEL_SEEDS = {"tetrapod": (2, 4), "hexapod": (1, 2), "dolos": (1, 2), "cube": (1, 3)}
TENSION_SEEDS = {"tetrapod": (4,), "dolos": (2,), "cube": (1, 2)}
FINE_SEEDS = {"tetrapod": (1, 2), "hexapod": (1,), "dolos": (1,), "cube": (1,)}


def write(
    kind: str, seed: int, size: float = PROTOTYPE, cells: int = 5, courant: float = 1.0,
    tension: float = 0.0,
) -> None:  # fmt: skip
    """A tank 4 x 4 x 6.8 lengths with a level of 5.025; times go with the root of the length."""
    slow = sqrt(size / PROTOTYPE)
    name = f"{kind}_{'prototype' if size == PROTOTYPE else 'model'}"
    name += f"{'_tension' if tension else ''}_{cells:02d}_{100 * courant:03.0f}_{seed}.nml"
    Path(name).write_text(TEXT.format(
        kind=kind, size=size, cells=cells, seed=seed, courant=courant, tension=tension,
        cost=8 if cells > 5 else 0.7 / courant, end=2.2 * slow, dt=0.05 * slow, speed=0.5 * slow,
        contact=0.02 * slow, wide=4 * cells, high=round(6.8 * cells), across=4 * size,
        top=6.8 * size, level=5.025 * size, edge=SIZE[kind] * size, middle=2 * size,
        place=5.8 * size, spread=0.15 * size))  # fmt: skip


for kind, seeds in SEEDS.items():
    for seed in seeds:
        write(kind, seed)
    for seed in MODEL_SEEDS[kind]:
        write(kind, seed, MODEL)
    for seed in TENSION_SEEDS.get(kind, ()):
        write(kind, seed, MODEL, tension=0.072)
    for seed in FINE_SEEDS[kind]:
        write(kind, seed, cells=10)
for seed in (4, 5):
    for courant in (0.5, 0.25):
        write("tetrapod", seed, courant=courant)
