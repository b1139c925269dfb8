"""Time the dry pile of hexapods and measure it.

usage: python tools/bench_contact.py [--n 64] [--time 2] [--box 0.3] [--seed 1] [--threads 1]
                                     [--dt 0.1] [--contact-time 0.008] [--program ./mics]

N hexapods (edge of a cube 20 mm, 2300 kg/m3) start on a loose grid with random attitudes above
the floor of a square tank, fall and pile up; friction 0.5, restitution 0.3, exact surfaces. `--dt`
is the `dt` of the case, its history step; substeps of contact last at most a twentieth of it and of
`--contact-time`, so that 0.1 leaves the choice to the latter. Blocks stay awake without `--sleep`.

Prints one JSON line: CPU and wall seconds of the whole run, reading and writing included, substeps
of contact (`dt` is the mean one), and of the pile at the end heights of the centroids, share of
solid below the 80th percentile of these, true depth of surface points inside other blocks (at the
end and, `pen_late_mm`, the largest over the last half second), and blocks outside the tank.
"""

import argparse
import itertools
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from micstools import command  # noqa: E402
from micstools.geometry import Array, place  # noqa: E402
from micstools.reader import Run  # noqa: E402

EDGE = 0.02  # of a cube [m]
REACH = EDGE * float(np.sqrt(2.75))  # of a corner from the centroid
PITCH = 0.07  # of the grid of the start [m]
LOWEST = 0.04  # height of the first layer [m]
ROOT = Path(__file__).resolve().parents[1]


def start(n: int, box: float, seed: int) -> tuple[Array, Array]:
    """Positions (n, 3) and quaternions w, x, y, z (n, 4): layers of a square grid, shifted at
    random by nine tenths of what keeps the surrounding spheres apart, any attitude alike."""
    random = np.random.default_rng(seed)
    side = int(box / PITCH)
    cell = box / side
    number = np.arange(n)
    layer, place_in_layer = np.divmod(number, side * side)
    row, column = np.divmod(place_in_layer, side)
    position = np.stack([(column + 0.5) * cell, (row + 0.5) * cell, LOWEST + PITCH * layer], axis=1)
    free = 0.9 * (0.5 * cell - REACH)
    position[:, :2] += random.uniform(-free, free, (n, 2))
    quaternion = random.normal(size=(n, 4))
    return position, quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)


def case(given: argparse.Namespace, output: Path) -> str:
    """The case file."""
    position, quaternion = start(given.n, given.box, given.seed)
    top = position[:, 2].max() + 0.1
    lines = [
        f"&run physics = 'dry'  t_end = {given.time!r}  dt = {given.dt!r}  output = '{output}'",
        "  field_interval = 0  restart_interval = 0 /",
        f"&grid cells = 60, 60, 60  length = {given.box!r}, {given.box!r}, {float(top)!r} /",
        f"&contact contact_time = {given.contact_time!r}  restitution = 0.3  friction = 0.5",
        f"  wall_friction = 0.5  sleep = {'T' if given.sleep else 'F'} /",
        f"&shape name = 'hexapod'  kind = 'hexapod'  size = {EDGE}  density = 2300",
        "  refinement = 1 /",
    ]
    for x, q in zip(position, quaternion, strict=True):
        where, turned = (", ".join(f"{value:.16g}" for value in values) for values in (x, q))
        lines.append(f"&body shape = 'hexapod'  position = {where}  quaternion = {turned} /")
    return "\n".join(lines) + "\n"


def cubes() -> Array:
    """Centres of the seven cubes (7, 3) [m]."""
    ends = [sign * EDGE * np.eye(3)[axis] for axis in range(3) for sign in (-1, 1)]
    return np.array([np.zeros(3), *ends])


def surface_points(parts: int = 8) -> Array:
    """Points on all faces, edges and corners of a hexapod, in body axes (m, 3) [m]."""
    line = np.linspace(-0.5, 0.5, parts + 1) * EDGE
    found = set()
    for centre, axis, sign in itertools.product(cubes(), range(3), (-0.5, 0.5)):
        first, second = np.meshgrid(line, line)
        face = np.empty((first.size, 3))
        face[:, axis] = sign * EDGE
        face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = first.ravel(), second.ravel()
        found |= {tuple(point) for point in np.round(centre + face, 9)}
    points = np.array(sorted(found))
    return points[depth_inside(points) < 1e-8]


def depth_inside(points: Array) -> Array:
    """How deep points in body axes are inside the hexapod, taken as three bars of 3 x 1 x 1 cubes:
    distance from the nearest side of a bar; negative outside [m]."""
    half = 0.5 * EDGE * (np.ones((3, 3)) + 2.0 * np.eye(3))
    return np.asarray((half[:, None, :] - np.abs(points)[None]).min(axis=2).max(axis=0))


def true_depth(position: Array, quaternion: Array) -> float:
    """Largest depth of a surface point of one block inside another [m]."""
    points, worst = surface_points(), 0.0
    world = [place(points, x, q) for x, q in zip(position, quaternion, strict=True)]
    for i, j in itertools.permutations(range(len(position)), 2):
        if np.linalg.norm(position[i] - position[j]) < 2.0 * REACH:
            back = quaternion[j] * [1.0, -1.0, -1.0, -1.0]
            inside = place(world[i] - position[j], np.zeros(3), back)
            worst = max(worst, float(depth_inside(inside).max()))
    return worst


def packing(position: Array, quaternion: Array, box: float, height: float) -> float:
    """Share of solid below a height; each cube counted by the height of its centre."""
    solid = 0.0
    for x, q in zip(position, quaternion, strict=True):
        bottoms = place(cubes(), x, q)[:, 2] - 0.5 * EDGE
        solid += float(np.clip((height - bottoms) / EDGE, 0.0, 1.0).sum()) * EDGE**3
    return solid / (box * box * height)


def measure(run: Run, given: argparse.Namespace) -> dict[str, float]:
    """What the pile is like."""
    b = run.bodies
    x, q = b.position[-1], b.quaternion[-1]
    inside = ((x > 0.0) & (x < [given.box, given.box, np.inf])).all(axis=1)
    height = float(np.percentile(x[:, 2], 80))
    late = np.flatnonzero(b.time > b.time[-1] - 0.5)
    depths = [true_depth(b.position[row], b.quaternion[row]) for row in late[::-1][:: given.every]]
    return {
        "mean_z": float(x[:, 2].mean()),
        "max_z": float(x[:, 2].max()),
        "packing80": packing(x, q, given.box, height),
        "pen_max_mm": 1e3 * depths[0],
        "pen_late_mm": 1e3 * max(depths),
        "escaped": int((~inside).sum()),
    }


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=64)
    parser.add_argument("--time", type=float, default=2.0, help="simulated seconds")
    parser.add_argument("--box", type=float, default=0.3, help="side of the tank [m]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--dt", type=float, default=0.1, help="history step [s]")
    parser.add_argument("--contact-time", type=float, default=0.008, help="of a single impact [s]")
    parser.add_argument("--sleep", action="store_true", help="let blocks at rest sleep")
    parser.add_argument("--every", type=int, default=1, help="depth at every so many late rows")
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "run"
        path = Path(folder) / "pile.nml"
        path.write_text(case(given, output))
        words = [given.program.resolve(), "--quiet", "--threads", str(given.threads), path]
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(words, check=True)
        wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        run = Run(output)
        steps = int(run.series.substeps.sum())
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        found = {
            "peer": "mics",
            "version": str(run.provenance.get("version", "")),
            "n_blocks": given.n,
            "box": given.box,
            "time": given.time,
            "dt": given.time / steps,
            "history_dt": given.dt,
            "contact_time": given.contact_time,
            "sleep": given.sleep,
            "steps": steps,
            "threads": given.threads,
            "wall_s": wall,
            "cpu_s": cpu,
            "wall_per_block_step": wall / (given.n * steps),
            "cpu_per_block_step": cpu / (given.n * steps),
            "wall_per_sim_s": wall / given.time,
            **measure(run, given),
        }
    rounded = {k: float(f"{v:.5g}") if isinstance(v, float) else v for k, v in found.items()}
    print(json.dumps(rounded))


if __name__ == "__main__":
    command.run_script(main)
