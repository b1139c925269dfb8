"""A world in a mirror, turned, or with its axes exchanged together with gravity."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from micstools.shapes.geometry import Array, quaternion_product
from worlds.world import Broken, Group, World

FEW = 3  # steps in which round-off has not grown
ROUND_OFF = 1e-9  # of the largest number of its kind
STIFF = 1e4  # changes by contact over those of places, both of their own size
MIRROR_X, MIRROR_Y = np.diag([-1, 1, 1]), np.diag([1, -1, 1])
QUARTER = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
AXES = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
HALF = np.sqrt(0.5)
TURNS = {"QUARTER": [HALF, 0, 0, HALF], "AXES": [0.5, 0.5, 0.5, 0.5]}
POLAR = ("velocity", "fluid_force", "contact_force")
AXIAL = ("angular_velocity", "fluid_torque", "contact_torque")


def changed(world: World, q: Array) -> World:
    """Places and directions times `q`; in a mirror for shapes that are their own image."""
    length = np.abs(q) @ world.value("grid", "length")
    corner = np.where(q.sum(axis=1) < 0, length, 0.0)  # image of the origin
    det = round(float(np.linalg.det(q)))

    def attitude(a: list[float]) -> list[float]:
        if det < 0:
            return [a[0], *(det * q @ a[1:])]
        turned = np.array(TURNS["QUARTER" if (q == QUARTER).all() else "AXES"])
        return list(quaternion_product(turned, np.array(a)))

    def change(name: str, group: Group) -> Group:
        group = dict(group)
        if name == "boundary":
            return {side(q, k): v for k, v in group.items()}
        for key in ("cells", "length"):
            if key in group:
                group[key] = [type(group[key][0])(v) for v in np.abs(q) @ group[key]]
        for key in ("position", "velocity", "gravity", "angular_velocity"):
            if key in group:
                sign = det if key in AXIAL else 1
                moved = sign * q @ group[key] + (corner if key == "position" else 0.0)
                group[key] = moved.tolist()
        if name == "water":
            ends = np.array([q @ group[k] + corner for k in ("min", "max")])
            group |= {"min": ends.min(axis=0).tolist(), "max": ends.max(axis=0).tolist()}
        if "quaternion" in group:
            group["quaternion"] = [float(c) for c in attitude(group["quaternion"])]
        return group

    return World([(n, change(n, g)) for n, g in world.groups])


def side(q: Array, name: str) -> str:
    """Name of the side to which a side goes."""
    d, end = "xyz".index(name[0]), name[2:5]
    to = int(np.abs(q[:, d]).argmax())
    if q[to, d] < 0:
        end = {"min": "max", "max": "min"}[end]
    return f"{'xyz'[to]}_{end}"


def same(
    world: World,
    folder: Path,
    q: Array,
    limit: float = ROUND_OFF,
    change: Callable[[World, Array], World] = changed,
    step: int = 1,
) -> None:
    """The first steps of both agree to round-off; bodies follow in steps of `step`."""
    world = world.changed("numerics", divergence_tolerance=1e-13)
    world = world.changed("run", history_interval=0.0)
    one, other = world.run(folder / "one"), change(world, q).run(folder / "other")
    det = round(float(np.linalg.det(q)))
    short, long = sorted(len(run.series.time) for run in (one, other))
    rows = min(FEW + 1, short)
    if rows < min(FEW + 1, long):
        raise Broken("one of the two stops early")
    g, h = float(np.linalg.norm(one.gravity)), float(one.grid.spacing.max())
    weight = world.value("fluid", "liquid_density") * g * h**3
    least = {"velocity": 0.01 * (g * h) ** 0.5, "angular_velocity": 0.01 * (g / h) ** 0.5}
    least |= {name: weight for name in ("fluid_force", "contact_force")}
    least |= {name: weight * h for name in ("fluid_torque", "contact_torque")}
    found = {}
    for name in (*POLAR, *AXIAL):
        sign = det if name in AXIAL else 1
        x = sign * getattr(one.bodies, name)[:rows] @ q.T
        found[name] = far(x, getattr(other.bodies, name)[:rows, ::step], least[name])
    for name, some in (("kinetic_energy_fluid", weight * h), ("liquid_volume", 0.0), ("time", 0.0)):
        numbers = (getattr(run.series, name)[:rows] for run in (one, other))
        found[name] = far(*numbers, some)
    worst = max(found, key=lambda name: found[name])
    if found[worst] > limit:
        raise Broken(f"{worst} differs by {found[worst]:.1e} within {rows - 1} steps")


def far(a: Array, b: Array, least: float) -> float:
    """Largest difference over the largest number, or over one that is small if that is more."""
    scale = np.nanmax(np.abs(a), initial=least)
    gap = np.where(np.isnan(a) != np.isnan(b), np.inf, np.nan_to_num(np.abs(a - b)))
    return float(gap.max(initial=0.0) / scale) if scale > 0 else 0.0


def mirror(world: World, folder: Path) -> None:
    """In a mirror across x, and across y. The contact spheres of a cube, four of its eight corners,
    have no mirror image among the shapes (seed 62803)."""
    world = world.changed("contact", model="surface")
    same(world, folder / "x", MIRROR_X)
    same(world, folder / "y", MIRROR_Y)


def turn(world: World, folder: Path) -> None:
    """A quarter turn about the vertical."""
    same(world, folder, QUARTER)


def axes(world: World, folder: Path) -> None:
    """Gravity along x, and all else with it."""
    same(world, folder, AXES)


def moved(world: World, folder: Path) -> None:
    """Somewhere else in a survey, where round-off is larger."""
    world = world.changed("numerics", solid_fraction="exact", coupling="monolithic")
    length, cells = world.value("grid", "length"), world.value("grid", "cells")
    ways = [37.0 * length[0], -21.0 * length[0], 5.0 * length[0]]
    far = max(map(abs, [*ways, *world.value("grid", "origin", [0.0])]))
    digits = 2.0**-52 * far / min(h / n for h, n in zip(length, cells, strict=True))
    limit = max(ROUND_OFF, STIFF * digits)
    same(world, folder, np.eye(3), limit, lambda world, _: world.shifted(ways))


def bodies(world: World, folder: Path) -> None:
    """The last body first."""
    world = world.changed("numerics", solid_fraction="exact", coupling="monolithic")

    def change(world: World, _: Array) -> World:
        found = [group for group in world.groups if group[0] == "body"][::-1]
        return replace(world, groups=[g for g in world.groups if g[0] != "body"] + found)

    same(world, folder, np.eye(3), change=change, step=-1)
