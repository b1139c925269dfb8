"""A bed of any form is a floor for blocks and for water."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Array, Run

VARIES = ("contact wall_friction", "contact sleep", "contact model")
THETA = np.radians(20.0)
DOWN = np.array([np.cos(THETA), 0.0, -np.sin(THETA)])  # along the slope
G = 9.81
CREEP = 1e-6  # [m/s]
SPEED = 1e-6  # of water at rest [m/s]
SAME = 1e-12  # [m], [m/s] or [m3]


def volume(run: Run) -> float:
    """Solid below the facets and above z = 0 in the tank [m3]: prisms under the facets, whose
    corners lie on the sides of the tank or outside or all inside."""
    points, triangles = run.bed
    p = points[triangles]
    low, high = run.grid.low, run.grid.high
    middle = p.mean(axis=1)
    inside = ((middle[:, :2] > low[:2]) & (middle[:, :2] < high[:2])).all(axis=1)
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    area = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return float((area * middle[:, 2])[inside].sum())


def slope(run: Run, checks: Checks) -> None:
    """Creep below the friction angle, acceleration above it."""
    b, name = run.bodies, run.folder.name
    mu = float(run.value("contact", "wall_friction"))
    if mu > np.tan(THETA):
        i, j = b.row(1.0), b.row(2.0)
        way = float(np.linalg.norm(b.position[j, 0] - b.position[i, 0]))
        checks.below(f"{name}: creep [m/s]", way / float(b.time[j] - b.time[i]), CREEP)
        checks.below(
            f"{name}: way in all [m]", float((b.position[-1] - b.position[0])[0] @ DOWN), 1e-3
        )
    else:
        i, j = b.row(0.3), b.row(0.6)
        ours = (b.velocity[j] - b.velocity[i]) @ DOWN / (b.time[j] - b.time[i])
        slides = G * (np.sin(THETA) - mu * np.cos(THETA))
        checks.close(f"{name}: box [m/s2]", float(ours[0]), slides, 0.01)
        checks.close(f"{name}: sphere [m/s2]", float(ours[1]), 5 / 7 * G * np.sin(THETA), 0.01)
    checks.true(
        f"{name}: the bed is the one counterpart, and the floor",
        bool((b.contacts[-1] == 1).all() and (b.on_floor[-1] == 1).all()),
    )


def groove(run: Run, checks: Checks) -> None:
    """A cube stands on an edge between the sides of the groove, at 45 degrees."""
    b, name = run.bodies, run.folder.name
    rest = np.array([0.05, 0.05, 0.02 + 0.02 / np.sqrt(2)])
    checks.below(
        f"{name}: way from its place [m]", float(np.abs(b.position[-1, 0] - rest).max()), 1e-5
    )
    angle = np.degrees(2 * np.arccos(b.quaternion[-1, 0, 0]))
    checks.close(f"{name}: angle [degrees]", float(angle), 45.0, 1e-4)
    checks.below(f"{name}: speed at the end [m/s]", float(np.abs(b.velocity[-1]).max()), 1e-6)


def largest(a: Array, b: Array) -> float:
    """Largest difference."""
    return float(np.abs(np.asarray(a) - np.asarray(b)).max())


def same(bed: Run, other: Run, checks: Checks) -> None:
    """A flat bed against the wall at its height (blocks), and a held box in its place (water)."""
    name = f"{bed.folder.name} and {other.folder.name}"
    if bed.bodies.n:
        places = largest(bed.bodies.position, other.bodies.position)
        checks.below(f"{name}: places [m]", places, SAME)
        return
    t = bed.field_times[-1]
    ours, theirs = bed.fields_at(t), other.fields_at(other.field_times[-1])
    checks.below(f"{name}: velocity [m/s]", largest(ours.velocity, theirs.velocity), SAME)
    checks.below(f"{name}: liquid", largest(ours.liquid, theirs.liquid), SAME)
    moves = float(np.abs(ours.velocity).max())
    checks.true(f"{name}: there is a wave", moves > 0.1, f"{moves:.3g} m/s")


def still(run: Run, checks: Checks) -> None:
    """Water at rest over a bed stays at rest; its volume is that above the bed."""
    name = run.folder.name
    written = max(float(np.abs(run.fields_at(t).velocity).max()) for t in run.field_times)
    checks.below(f"{name}: largest speed at any time [m/s]", written, SPEED)
    final = float(np.abs(run.restart()["flow/u"]).max())
    checks.below(f"{name}: largest speed at the end [m/s]", final, SPEED)
    level = float(run.value("fluid", "water_level"))
    extent = run.grid.high - run.grid.low
    wanted = extent[0] * extent[1] * level - volume(run)
    checks.close(f"{name}: liquid [m3]", float(run.series.liquid_volume[0]), wanted, 1e-12)


def drop(run: Run, checks: Checks) -> None:
    """Blocks sink to the bed, lie on it and not in it, and no liquid is lost."""
    b, name = run.bodies, run.folder.name
    checks.true(f"{name}: all on the bed", bool((b.on_floor[-1] == 1).all()))
    checks.below(f"{name}: speed at the end [m/s]", float(np.abs(b.velocity[-1]).max()), 0.05)
    checks.below(f"{name}: overlap at the end [m]", float(run.series.max_overlap[-1]), 2e-5)


def check(runs: list[Run], checks: Checks) -> None:
    """Slopes, a groove, flat beds against floors, still water."""
    named = {run.folder.name: run for run in runs}
    for name, run in named.items():
        if name.startswith("slope"):
            slope(run, checks)
        elif name == "groove":
            groove(run, checks)
        elif name.startswith("flat_bed"):
            twin = name.replace("bed", "box" if name.endswith("wave") else "wall")
            same(run, named[twin], checks)
        elif name in ("rough", "stones"):
            still(run, checks)
        elif name == "drop":
            drop(run, checks)
