"""Upright cubes and the planes of the grid: the tables of docs/decisions/sharp_edges.md.

usage: python verification/trials/sharp_edges.py PART [CELLS ...] [--program ./mics]

PART: added_mass (added over displaced mass, second step) or held (drag coefficient at Re 2e4, mean
from 12 edges of way on); cells per edge. The noise of the force is the case `moved_cube`.
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from micstools.reading.reader import Run

ROOT = Path(__file__).resolve().parents[2]
EDGE, G = 0.02, 9.81  # [m], [m/s2]
ACROSS = "x_min='periodic' x_max='periodic' y_min='periodic' y_max='periodic'"
CLOSED = "x_min='slip' x_max='slip' y_min='slip' y_max='slip' z_min='slip' z_max='slip'"
CELLS = {
    "added_mass": [5, 5.33, 5.67, 5.95, 6.05, 6.33, 6.67, 7, 7.5, 7.95, 8.05, 8.33, 8.67, 9, 9.5],
    "held": [4.5, 5.1, 5.3, 5.5],
}


def run(program: Path, text: str) -> Run:
    """The result of a case."""
    folder = Path(tempfile.mkdtemp())
    (folder / "case.nml").write_text(text)
    subprocess.run(
        [program, "--quiet", "--output", folder / "result", folder / "case.nml"], check=True
    )
    return Run(folder / "result")


def case(head: str, box: tuple[int, int, float], boundary: str, fluid: str, body: str) -> str:
    """Case text; box: cells across and high, their size [m]."""
    n, high, h = box
    return (
        f"&run {head} field_interval=0.0 restart_interval=0.0 /\n"
        f"&grid cells={n},{n},{high} length={n * h},{n * h},{high * h} /\n&boundary {boundary} /\n"
        f"&fluid single_phase=.true. liquid_density=1000.0 {fluid} /\n{body}"
    )


def added_mass(program: Path, m: float) -> str:
    """Of a cube of m cells half as heavy as water, let go in the middle of 40 cells."""
    body = f"&shape name='c' kind='cube' size={0.01 * m} density=500.0 /\n"
    body += "&body shape='c' position=0.2,0.2,0.2 /\n"
    head = "title='added mass' t_end=4e-3 dt=2e-3"
    b = run(program, case(head, (40, 40, 0.01), CLOSED, "liquid_viscosity=0.0", body)).bodies
    return f"{0.5 * G / (b.velocity[-1, 0, 2] / b.time[-1]) - 0.5:.3f}"


def held(program: Path, m: float) -> str:
    """Drag coefficient of a cube face on in a stream of 1 m/s."""
    h, n, high = EDGE / m, 2 * round(3.5 * m), 2 * round(5 * m)
    x = n / 2 * h
    body = f"&shape name='c' kind='cube' size={EDGE} /\n"
    body += f"&body shape='c' position={x},{x},{x} fixed=.true. /\n"
    fluid = "liquid_viscosity=1e-3 gravity=0.0,0.0,0.0 velocity=0.03,0.02,1.0"
    sides = f"{ACROSS} z_min='inflow' z_min_velocity=0.0,0.0,1.0 z_max='open'"
    result = run(program, case("title='held' t_end=0.45 dt=5e-3", (n, high, h), sides, fluid, body))
    late, step = result.bodies.time > 12 * EDGE, result.series.dt
    mean = np.average(result.bodies.fluid_force[late, 0, 2], weights=step[late])
    return f"drag coefficient {mean / (500 * EDGE**2):.3f}"


def main() -> None:
    """One line for each number of cells per edge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("part", choices=list(CELLS))
    parser.add_argument("cells", nargs="*", type=float)
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    args = parser.parse_args()
    measure = {"added_mass": added_mass, "held": held}[args.part]
    for m in args.cells or CELLS[args.part]:
        print(f"{m:g} cells per edge: {measure(args.program.resolve(), m)}", flush=True)


if __name__ == "__main__":
    main()
