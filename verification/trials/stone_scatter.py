"""How far single stones scatter sideways on their way down in still water, against the depth.

usage: python verification/trials/stone_scatter.py [--program ./mics] [--physics light]
    [--out DIR]

Sixteen stones of 1.3 to 1.7 t in random attitudes fall side by side, 6 m apart, through 27 m of
water. Experiment (KAKEN 03650424, single stones): sideways displacement per equal depth is normal
with mean 0, so that the deviation grows as the root of the depth. Prints the deviation at some
depths, that of each 4 m, and the exponent of its growth with 95 % of 2,000 resamplings of the
stones. Two cells along a stone; some 20 s of CPU, in 'light' two.
"""

import argparse
import subprocess
from pathlib import Path

import numpy as np

from micstools import Run
from micstools.shapes.geometry import Array

DEPTHS = np.array([4.0, 8.0, 12.0, 16.0, 20.0])
CASE = """&run t_end = 8  dt = 0.1  cfl_max = 2  physics = '{physics}'  output = 'run'
  field_interval = 100  history_interval = 0.1 /
&grid cells = 48, 48, 60  length = 24, 24, 30 /
&boundary x_min = 'periodic'  x_max = 'periodic'  y_min = 'periodic'  y_max = 'periodic'
  z_max = 'open' /
&fluid water_level = 29.2 /
&contact contact_time = 0.02 /
&shape name = 'rock'  kind = 'rock'  density = 2650  mass_50 = 1500  mass_min = 1300
  mass_max = 1700  variants = 16  seed = 4 /
&drop file = 'plan.csv' /
"""


def sideways(folder: Path, physics: str, program: Path) -> Array:
    """Ways (depths, stones, 2) [m] of stones that fall through each of `DEPTHS`."""
    rng, rows = np.random.default_rng(11), ["shape,x,y,z,time,qw,qx,qy,qz"]
    for y in range(3, 24, 6):
        for x in range(3, 24, 6):
            q = rng.normal(size=4)
            rows.append(f"rock,{x},{y},27,0," + ",".join(f"{v:.6f}" for v in q / np.linalg.norm(q)))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plan.csv").write_text("\n".join(rows) + "\n")
    (folder / "case.nml").write_text(CASE.format(physics=physics))
    subprocess.run([program.resolve(), "--quiet", "case.nml"], cwd=folder, check=True)
    place = Run(folder / "run").bodies.position
    fallen = place[0, :, 2] - place[:, :, 2]
    rows_at = np.array([[np.searchsorted(f, d) for f in fallen.T] for d in DEPTHS])
    return np.stack([place[rows, np.arange(place.shape[1]), :2] - place[0, :, :2]
                     for rows in rows_at])  # fmt: skip


def deviation(way: Array) -> Array:
    """Root of the mean square of each row of ways (n, stones, 2) along an axis [m]."""
    return np.asarray(np.sqrt((way**2).mean(axis=(1, 2))))


def exponent(way: Array, first: int) -> float:
    """Of the growth of the deviation from depth number `first` on."""
    return float(np.polyfit(np.log(DEPTHS[first:]), np.log(deviation(way[first:])), 1)[0])


def main() -> None:
    """Run the stones and print how they scatter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, default=Path("mics"))
    parser.add_argument("--physics", choices=("coupled", "light"), default="coupled")
    parser.add_argument("--out", type=Path, default=Path("mics-stones"))
    given = parser.parse_args()
    way = sideways(given.out, given.physics, given.program)
    print("depth [m]               ", *(f"{d:6.0f}" for d in DEPTHS))
    print("deviation [m]           ", *(f"{s:6.2f}" for s in deviation(way)))
    each = deviation(np.diff(way, axis=0, prepend=0 * way[:1]))
    print("that of the last 4 m [m]", *(f"{s:6.2f}" for s in each))
    rng, n = np.random.default_rng(1), way.shape[1]
    for first in (0, 1):
        many = [exponent(way[:, rng.integers(0, n, n)], first) for _ in range(2000)]
        low, high = np.percentile(many, [2.5, 97.5])
        found = exponent(way, first)
        print(f"exponent from {DEPTHS[first]:.0f} m on: {found:.2f} ({low:.2f} to {high:.2f})")


if __name__ == "__main__":
    main()
