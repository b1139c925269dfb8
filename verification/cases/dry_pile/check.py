"""Piles and clouds of blocks keep energy and momentum, and cubes pack as cubes do.

usage: python check.py RUN [RUN ...]
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.checks import Checks, main, sound  # noqa: E402
from micstools.geometry import Array, place  # noqa: E402
from micstools.reader import Run  # noqa: E402

ENERGY_BAND = 1e-3
ROUND_OFF = 1e-11
LOOSEST, DENSEST = 0.50, 0.62  # packing of poured cubes
EDGE, SIDE = 0.02, 0.15  # of the cubes and their tank [m]


def energy(run: Run, checks: Checks, scale: float) -> None:
    """Total energy never above that at the start."""
    s = run.series
    total = s.kinetic_energy_bodies + s.potential_energy_bodies + s.contact_energy
    gain = float((total - total[0]).max() / scale)
    name = run.folder.name
    checks.below(f"{name}: energy above the initial", max(gain, 0.0), ENERGY_BAND)
    back = float((np.maximum.accumulate(total[::-1])[::-1] - total).max() / scale)
    checks.below(f"{name}: energy that comes back later", back, ENERGY_BAND, counts=False)
    deepest = 1e3 * float(s.max_overlap.max())
    checks.below(f"{name}: largest overlap [mm]", deepest, 1.0, counts=False)
    checks.figure(f"energy, {name}", "t [s]", "J", {"total": (s.time, total)})


def momentum(run: Run, checks: Checks) -> None:
    """Linear and angular momentum of a cloud that touches no wall, of the sum of all sizes."""
    b = run.bodies
    linear = b.mass[:, None] * b.velocity
    inertia = np.array([run.shapes[name].inertia for name in b.shape])
    spin = np.empty_like(linear)
    for row in range(len(b.time)):
        turns = [place(np.eye(3), np.zeros(3), q).T for q in b.quaternion[row]]
        for k, turn in enumerate(turns):
            spin[row, k] = turn @ inertia[k] @ turn.T @ b.angular_velocity[row, k]
    about = np.cross(b.position - 1.0, linear) + spin
    for what, each in (("momentum", linear), ("angular momentum", about)):
        total = each.sum(axis=1)
        scale = float(np.linalg.norm(each, axis=2).sum(axis=1).max())
        drift = float(np.linalg.norm(total - total[0], axis=1).max()) / scale
        checks.below(f"{run.folder.name}: {what}", drift, ROUND_OFF)
    touched = int((b.contacts.max(axis=0) > 0).sum())
    checks.true(f"{run.folder.name}: blocks that touch", touched > b.n / 2, f"{touched} of {b.n}")


def balance(run: Run, checks: Checks) -> None:
    """M dU/dt = contact + M g for each block over each step."""
    b, g = run.bodies, np.array([0.0, 0.0, -9.81])
    dt = np.diff(b.time)[:, None, None]
    change = b.mass[:, None] * np.diff(b.velocity, axis=0) / dt
    rest = change - b.contact_force[1:] - b.mass[:, None] * g
    worst = float(np.abs(rest).max() / np.abs(b.contact_force).max())
    checks.below(f"{run.folder.name}: M dU/dt - contact - M g", worst, ROUND_OFF)


def packing(position: Array, quaternion: Array) -> tuple[float, float]:
    """Share of solid below the height of 80 % of the centroids, and that height [m]."""
    height = float(np.percentile(position[:, 2], 80))
    line = (np.arange(8) + 0.5) / 8 - 0.5
    points = EDGE * np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)
    pairs = zip(position, quaternion, strict=True)
    below = np.mean([(place(points, x, q)[:, 2] < height).mean() for x, q in pairs])
    return float(below) * len(position) * EDGE**3 / (SIDE**2 * height), height


def check(runs: list[Run]) -> Checks:
    """Each run by its kind."""
    checks = Checks("dry piles")
    for run in runs:
        b, s = run.bodies, run.series
        fallen = s.potential_energy_bodies[0] - s.potential_energy_bodies.min()
        energy(run, checks, float(fallen + s.kinetic_energy_bodies[0]))
        if run.folder.name == "cloud":
            momentum(run, checks)
        else:
            balance(run, checks)
        if run.folder.name == "cubes":
            share, height = packing(b.position[-1], b.quaternion[-1])
            checks.within("packing of 200 cubes", share, LOOSEST, DENSEST)
            checks.within("height of 80 % of them [m]", height, 0.05, 0.3, counts=False)
            speed = float(np.median(np.linalg.norm(b.velocity[-1], axis=1)))
            checks.below("median speed at the end [m/s]", speed, 1e-2)
        sound(run, checks)
    return checks


if __name__ == "__main__":
    main(check)
