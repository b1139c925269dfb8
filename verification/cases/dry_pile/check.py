"""Piles and clouds of blocks keep energy and momentum, and cubes pack as cubes do."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run
from micstools.shapes.geometry import rotation_matrix, volume_in_box

VARIES = ("contact friction", "contact wall_friction")  # none in `smooth`
ENERGY_BAND = 1e-3
ROUND_OFF = 1e-11
LOOSEST, DENSEST = 0.50, 0.62  # packing of poured cubes
PILES = {  # what is nearer to walls and floor is left out [m]; published porosities
    "cubes": (0.02, {"loose random dice": 0.46, "two layers": 0.47}),
    "dumped": (0.02, {"loose random dice": 0.46}),
    "smooth": (0.02, {"densest random dice": 0.33}),
    "hexapods": (0.03, {"two layers": 0.47}),
    "tetrapods": (0.03, {"two layers": 0.50}),
    "dolosse": (0.035, {"two layers": 0.56}),
}


def energy(run: Run, checks: Checks, scale: float) -> None:
    """Total energy never above that at the start, but for what blocks are thrown in with."""
    s, b = run.series, run.bodies
    total = s.kinetic_energy_bodies + s.potential_energy_bodies + s.contact_energy
    thrown = 0.5 * b.mass * float(np.sum(np.square(run.value("drop", "velocity"))))
    total = total - (b.release_time[b.dropped] < s.time[:, None]) @ thrown[b.dropped]
    gain = float((total - total[0]).max() / scale)
    name = run.folder.name
    checks.below(f"{name}: energy above the initial", max(gain, 0.0), ENERGY_BAND)
    back = (np.maximum.accumulate(total[::-1])[::-1] - total).max() / scale
    checks.below(f"{name}: energy that comes back later", back, ENERGY_BAND, counts=False)
    checks.below(f"{name}: largest overlap [mm]", 1e3 * s.max_overlap.max(), 1.0, counts=False)
    checks.figure(f"energy, {name}", "t [s]", "J", {"total": (s.time, total)})


def momentum(run: Run, checks: Checks) -> None:
    """Linear and angular momentum of a cloud that touches no wall, of the sum of all sizes."""
    b = run.bodies
    linear = b.mass[:, None] * b.velocity
    inertia = np.array([run.shapes[name].inertia for name in b.shape])
    turn = rotation_matrix(b.quaternion)
    spin = np.einsum("tkij,kjl,tkml,tkm->tki", turn, inertia, turn, b.angular_velocity)
    about = np.cross(b.position - 1.0, linear) + spin
    for what, each in (("momentum", linear), ("angular momentum", about)):
        total = each.sum(axis=1)
        scale = np.linalg.norm(each, axis=2).sum(axis=1).max()
        drift = np.linalg.norm(total - total[0], axis=1).max() / scale
        checks.below(f"{run.folder.name}: {what}", drift, ROUND_OFF)
    touched = int((b.contacts.max(axis=0) > 0).sum())
    checks.true(f"{run.folder.name}: blocks that touch", touched > b.n / 2, f"{touched} of {b.n}")


def balance(run: Run, checks: Checks) -> None:
    """M dU/dt = contact + M g for each block over each step."""
    b, g = run.bodies, np.array([0.0, 0.0, -9.81])
    dt = np.diff(b.time)[:, None, None]
    change = b.mass[:, None] * np.diff(b.velocity, axis=0) / dt
    rest = change - b.contact_force[1:] - b.mass[:, None] * g
    rest[b.time[:-1, None] < b.release_time + 1e-9] = 0.0  # up to the step of its release
    worst = np.abs(rest).max() / np.abs(b.contact_force).max()
    checks.below(f"{run.folder.name}: M dU/dt - contact - M g", worst, ROUND_OFF)


def packing(run: Run, inset: float) -> tuple[float, float]:
    """Share of solid below the height of 80 % of the centroids: over the whole section down to the
    floor, and of what is farther than `inset` [m] from walls and floor. Exact, by cutting."""
    b, low, high = run.bodies, run.grid.low.copy(), run.grid.high.copy()
    high[2] = np.percentile(b.position[-1, :, 2], 80)
    corner = np.concatenate(
        [run.points(k, -1)[run.shapes[name].tets] for k, name in enumerate(b.shape)]
    )
    whole = volume_in_box(corner, low, high) / float(np.prod(high - low))
    low += inset
    high[:2] -= inset
    return whole, volume_in_box(corner, low, high) / float(np.prod(high - low))


def pile(run: Run, checks: Checks) -> None:
    """Packing of blocks of one kind, beside published ones."""
    name, b = run.folder.name, run.bodies
    inset, published = PILES[name]
    whole, core = packing(run, inset)
    counts = name == "cubes"
    checks.within(f"{name}: packing, whole section", whole, LOOSEST, DENSEST, counts)
    checks.within(f"{name}: packing, away from walls and floor", core, LOOSEST, DENSEST, counts)
    for what, porosity in published.items():
        title = f"{name}: porosity away from walls and floor, {what}"
        checks.close(title, 1.0 - core, porosity, 0.1, counts=False)
    speed = np.median(np.linalg.norm(b.velocity[-1], axis=1))
    checks.below(f"{name}: median speed at the end [m/s]", speed, 1e-2, name != "smooth")
    released = int((b.release_time <= b.time[-1]).sum())
    checks.true(f"{name}: all blocks in the tank", released == b.n, f"{released} of {b.n}")
    if name == "smooth":
        checks.true("smooth cubes pack denser than any rough ones", whole > DENSEST, f"{whole:.3f}")


def check(runs: list[Run], checks: Checks) -> None:
    """Each run by its kind."""
    for run in runs:
        s = run.series
        fallen = s.potential_energy_bodies[0] - s.potential_energy_bodies.min()
        energy(run, checks, float(fallen + s.kinetic_energy_bodies[0]))
        if run.folder.name == "cloud":
            momentum(run, checks)
        else:
            balance(run, checks)
        if run.folder.name in PILES:
            pile(run, checks)
