"""Still water stays still, and its pressure carries the displaced weight."""

import numpy as np

from measures.buoyancy import buoyancy_rows
from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = (  # every way to compute keeps still water still
    "numerics divergence_tolerance",
    "numerics coupling",
    "numerics momentum",
    "numerics solid_fraction",
    "numerics subcells",
    "numerics pressure_solver",
)
QUICK = ("default", "paper", "split_cells")
SPEED_BAND = {1e-6: 1e-6, 1e-10: 1e-9}  # divergence tolerance [1/s]: largest speed [m/s]


def counted_rows(run: Run, checks: Checks) -> None:
    """Blocks under water carry the weight of the water that their counted sub-cells displace.

    The blocks stand apart along x, so half way between two of them the cells change owner.
    """
    x = run.bodies.position[-1, :, 0]
    centre = (run.grid.x[1:] + run.grid.x[:-1]) / 2
    cell = np.diff(run.grid.x)[0] * np.diff(run.grid.y)[0] * np.diff(run.grid.z)[0]
    solid = (
        np.asarray(run.fields_at(run.field_times[-1]).solid, dtype=float).sum(axis=(0, 1)) * cell
    )
    weight = float(run.value("fluid", "liquid_density")) * 9.81
    for body in (0, 1):
        mine = np.abs(centre[:, None] - x).argmin(axis=1) == body
        force = float(run.bodies.fluid_force[-1, body, 2])
        name = f"{run.folder.name}: body {body + 1}, weight of the counted water [N]"
        checks.close(name, force, weight * float(solid[mine].sum()), 1e-6)


def check(runs: list[Run], checks: Checks) -> None:
    """Speeds at all written times and in the final state; forces on the blocks at the end."""
    for run in runs:
        tolerance = float(run.value("numerics", "divergence_tolerance"))
        written = max(float(np.abs(run.fields_at(t).velocity).max()) for t in run.field_times)
        final = float(np.abs(run.restart()["flow/u"]).max())
        name = run.folder.name
        checks.below(f"{name}: largest speed at any time [m/s]", written, SPEED_BAND[tolerance])
        checks.below(f"{name}: largest speed at the end [m/s]", final, SPEED_BAND[tolerance])
        if run.value("numerics", "solid_fraction") == "subcell":
            counted_rows(run, checks)
        else:
            buoyancy_rows(run, checks)
