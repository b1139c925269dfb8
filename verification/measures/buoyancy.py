"""Force of still water on held blocks from geometry alone: tetrahedra and a level plane."""

import numpy as np

from measures.checks import Checks
from micstools.reading.overlap import Placed, present_bodies
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, below_plane

SUBMERGED_BAND = 1e-6  # of the displaced weight; also for a block wholly in gas
CROSSING_BAND = 1e-3


def displaced(body: Placed, level: float, liquid: float, gas: float) -> tuple[float, Array]:
    """Displaced mass [kg] and its first moment about the centroid of the block [kg m]; liquid of
    density `liquid` [kg/m3] below the height `level` [m], gas above it."""
    volume, moment = below_plane(body.tets, level)
    about = moment - volume * body.position
    return (liquid - gas) * volume + gas * body.shape.volume, (liquid - gas) * about


def densities(run: Run) -> tuple[float, float]:
    """Of liquid and gas [kg/m3]."""
    return float(run.value("fluid", "liquid_density")), float(run.value("fluid", "gas_density"))


def buoyancy_rows(run: Run, checks: Checks) -> None:
    """Compare force and torque of the last row with the geometric ones, body by body.

    The bands are shares of the displaced weight, and of that weight times the size of the block
    for the torque.
    """
    level = float(run.value("fluid", "water_level"))
    for k, body in present_bodies(run, len(run.bodies.time) - 1).items():
        heights = body.points[:, 2]
        crossing = heights.min() < level < heights.max()
        band = CROSSING_BAND if crossing else SUBMERGED_BAND
        where = "crossing" if crossing else ("in water" if heights.max() <= level else "in gas")
        mass, moment = displaced(body, level, *densities(run))
        weight = mass * float(np.linalg.norm(run.gravity))
        name = f"{run.folder.name}: body {k + 1} ({body.shape.name}, {where})"
        force, torque = run.bodies.fluid_force[-1, k], run.bodies.fluid_torque[-1, k]
        checks.close(f"{name} vertical force [N]", float(force[2]), weight, band)
        sideways = float(np.linalg.norm(force[:2])) / weight
        checks.below(f"{name} force sideways / weight", sideways, band)
        turning = np.linalg.norm(torque + np.cross(moment, run.gravity)) / (
            weight * body.shape.radius
        )
        checks.below(f"{name} torque error / (weight size)", float(turning), band)
