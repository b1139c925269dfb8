"""A bed of any form is a floor for blocks and for water."""

import numpy as np

from measures.checks import Checks
from measures.facts import acceleration, creep, still_rows
from micstools.reading.reader import Run

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
    middle = p.mean(axis=1)
    inside = ((middle > run.grid.low) & (middle < run.grid.high))[:, :2].all(axis=1)
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] / 2
    return float((area * middle[:, 2])[inside].sum())


def slope(run: Run, checks: Checks) -> None:
    """Creep below the friction angle, acceleration above it."""
    b, name, mu = run.bodies, run.folder.name, run.value("contact", "wall_friction")
    if mu > np.tan(THETA):
        checks.below(f"{name}: creep [m/s]", creep(b, 0), CREEP)
        way = (b.position[-1] - b.position[0])[0] @ DOWN
        checks.below(f"{name}: way in all [m]", way, 1e-3)
    else:
        box, sphere = acceleration(b) @ DOWN
        slides = G * (np.sin(THETA) - mu * np.cos(THETA))
        checks.close(f"{name}: box [m/s2]", box, slides, 0.01)
        checks.close(f"{name}: sphere [m/s2]", sphere, 5 / 7 * G * np.sin(THETA), 0.01)
    alone = (b.contacts[-1] == 1).all() and (b.on_floor[-1] == 1).all()
    checks.true(f"{name}: the bed is the one counterpart, and the floor", alone)


def groove(run: Run, checks: Checks) -> None:
    """A cube stands on an edge between the sides of the groove, at 45 degrees."""
    b, name = run.bodies, run.folder.name
    rest = np.array([0.05, 0.05, 0.02 + 0.02 / np.sqrt(2)])
    checks.below(f"{name}: way from its place [m]", np.abs(b.position[-1, 0] - rest).max(), 1e-5)
    angle = np.degrees(2 * np.arccos(b.quaternion[-1, 0, 0]))
    checks.close(f"{name}: angle [degrees]", angle, 45.0, 1e-4)
    checks.below(f"{name}: speed at the end [m/s]", np.abs(b.velocity[-1]).max(), 1e-6)


def same(bed: Run, other: Run, checks: Checks) -> None:
    """A flat bed against the wall at its height (blocks), and a held box in its place (water)."""
    name = f"{bed.folder.name} and {other.folder.name}"
    if bed.bodies.n:
        apart = np.abs(bed.bodies.position - other.bodies.position)
        if bed.value("contact", "model") == "spheres":
            checks.below(f"{name}: places [m]", apart.max(), SAME)
            return
        # an impact is solved up to .002 of its speed, .1 mm sideways at most
        checks.below(f"{name}: heights at rest [m]", apart[-1, :, 2].max(), 1e-9)
        checks.below(f"{name}: places at rest [m]", apart[-1].max(), 1e-4)
        return
    ours, theirs = (run.fields_at(run.field_times[-1]) for run in (bed, other))
    apart = np.abs(ours.velocity - theirs.velocity).max()
    checks.below(f"{name}: velocity [m/s]", apart, SAME)
    checks.below(f"{name}: liquid", np.abs(ours.liquid - theirs.liquid).max(), SAME)
    moves = np.abs(ours.velocity).max()
    checks.true(f"{name}: there is a wave", moves > 0.1, f"{moves:.3g} m/s")


def still(run: Run, checks: Checks) -> None:
    """Water at rest over a bed stays at rest; its volume is that above the bed."""
    name = run.folder.name
    still_rows(run, checks, SPEED)
    extent = run.grid.high - run.grid.low
    wanted = extent[0] * extent[1] * run.value("fluid", "water_level") - volume(run)
    checks.close(f"{name}: liquid [m3]", run.series.liquid_volume[0], wanted, 1e-12)


def drop(run: Run, checks: Checks) -> None:
    """Blocks sink to the bed, lie on it and not in it, and no liquid is lost."""
    b, name = run.bodies, run.folder.name
    checks.true(f"{name}: all on the bed", (b.on_floor[-1] == 1).all())
    checks.below(f"{name}: speed at the end [m/s]", np.abs(b.velocity[-1]).max(), SPEED)
    checks.below(f"{name}: overlap at the end [m]", run.series.max_overlap[-1], 1e-6)


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
