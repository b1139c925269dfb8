"""Sums that the flow and the blocks must keep, and water that must not move."""

from pathlib import Path

import numpy as np

from micstools.reading.overlap import present_bodies
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, below_plane
from worlds.world import Broken, World

ROUND_OFF = 1e-12  # of the liquid
PUSHED = 1e-3  # overlap in a hit, over the thinnest block
BUOYANCY = 1e-5  # what the tolerance of the pressure leaves
EXCHANGED = 1e-2  # 2e-2 beside plates thinner than a cell
CLOSED = 1e-6  # open share of a cell that counts as none
STILL = 1e-9  # kinetic energy of the fluid over rho g h^4 with the size h of a cell
LOADING = 1e-5  # the same while contacts take their load; 4e-4 to 3e-2 if they begin to fall


def stays_still(world: World, folder: Path) -> None:
    """Water at rest around held blocks stays at rest."""
    run = world.run(folder, ends=(0,))
    below("kinetic energy of the fluid over rho g h^4", motion(world, run), STILL)
    b, g = run.bodies, np.linalg.norm(run.gravity)
    liquid, gas = (world.value("fluid", f"{name}_density") for name in ("liquid", "gas"))
    low, high = run.grid.low, run.grid.high
    for k, body in present_bodies(run, -1).items():
        inside = (body.points > low).all() and (body.points < high).all()
        if not inside or world.value("numerics", "solid_fraction") != "exact":
            continue
        under = below_plane(body.tets, world.value("fluid", "water_level"))[0]
        lift = g * (liquid * under + gas * (body.shape.volume - under))
        error = (b.fluid_force[1:, k] - [0.0, 0.0, lift]) / (liquid * g * body.shape.volume)
        below("buoyancy less that of Archimedes, over that of the whole", error, BUOYANCY)


def lies_still(world: World, folder: Path) -> None:
    """Around free ones that lie on the floor and on each other it moves as their contacts load."""
    run = world.run(folder, ends=(0,))
    below("kinetic energy of the fluid over rho g h^4", motion(world, run), LOADING)


def motion(world: World, run: Run) -> Array:
    """Kinetic energy of the fluid in each row over rho g h^4 [-]."""
    h = run.grid.spacing.prod() ** (1 / 3)
    scale = world.value("fluid", "liquid_density") * np.linalg.norm(run.gravity) * h**4
    return run.series.kinetic_energy_fluid / scale


def balance(world: World, folder: Path) -> None:
    """No NaN, liquid to round-off, and mass times acceleration is the sum of the forces."""
    world = world.changed("run", history_interval=0.0)
    run = world.run(folder, ends=(0,))
    s, b = run.series, run.bodies
    if world.value("run", "physics") in ("coupled", "fluid"):
        digits = np.abs(run.grid.high).max() * 2**-52 / run.grid.spacing.min()  # of a cell's edge
        below("drift of the liquid", s.liquid_volume_drift, ROUND_OFF + digits)
        mics = world.value("numerics", "coupling") == "mics"
        if not mics:
            tolerance = world.value("numerics", "divergence_tolerance")
            kinds = world.value("boundary", "z_max")
            below("divergence, over its tolerance", s.divergence_max[1:] / tolerance, 1.0)
            # sub-cells do not keep the volume of a body, for which a closed tank has no way out
            if world.value("numerics", "solid_fraction") == "exact" or "open" in kinds:
                below("excess of a cell", s.volume_excess_max, tolerance * s.time[-1] + CLOSED)
        # options of the paper gain energy beside very viscous fluids (docs/decisions/surface.md)
        if not mics and world.value("numerics", "momentum") == "conservative":
            below("energy over what was put in", np.fmax(s.energy_excess, 0.0), 0.01)
    if not b.n:
        return
    thinnest = min(np.ptp(run.shapes[name].points, axis=0).min() for name in b.shape)
    if world.value("contact", "model") == "surface":  # contact spheres are not the shape
        below("overlap over the thinnest block", s.max_overlap / thinnest, PUSHED)
    free = ~b.fixed & (b.entry_time <= b.release_time)
    there = (b.release_time < b.time[:-1, None]) & free  # a release gives velocity in its step
    there &= b.time[1:, None] <= b.exit_time
    dt = np.diff(b.time)[:, None, None]
    force = (b.fluid_force + b.contact_force)[1:] + b.mass[:, None] * run.gravity
    pull = b.mass[:, None] * np.diff(b.velocity, axis=0) / dt
    scale = np.abs(force).max(axis=2) + b.mass * np.abs(b.velocity[1:]).max(axis=2) / dt[..., 0]
    error = np.abs(pull - force).max(axis=2) / (scale + b.mass * np.linalg.norm(run.gravity))
    below("M dU/dt less the forces, over them", np.where(there, error, 0.0), 1e-9)


def momentum(world: World, folder: Path) -> None:
    """Along x, where no side takes any, the fluid gains what the bodies lose. Stress and tension of
    a surface are no sums of fluxes, sub-cells change volumes, and the paper's options lose some."""
    world = world.changed("run", field_interval=world.value("run", "t_end"))
    world = world.changed("fluid", surface_tension=0.0, liquid_viscosity=1e-4)
    exact = {"momentum": "conservative", "coupling": "monolithic", "solid_fraction": "exact"}
    run = world.changed("numerics", **exact).run(folder, ends=(0,))
    liquid, gas = (world.value("fluid", f"{name}_density") for name in ("liquid", "gas"))

    def along_x(t: float) -> float:
        f = run.fields_at(t)
        density = (1 - f.solid) * (gas + (liquid - gas) * f.liquid)
        return float((density * f.velocity[..., 0]).sum() * run.grid.spacing.prod())

    b = run.bodies
    lost = b.fluid_force[1:, :, 0] * np.diff(b.time)[:, None]
    error = (along_x(b.time[-1]) - along_x(0.0) + lost.sum()) / np.abs(lost).sum()
    below("momentum that appears, over what is exchanged", error, EXCHANGED)


def below(what: str, values: np.ndarray, limit: float) -> None:
    """No value of any row is larger, or not a number."""
    if not (np.abs(values) <= limit).all():
        raise Broken(f"{what}: {np.abs(values).max():.2g}, not below {limit:g}")
