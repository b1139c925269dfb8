"""Still water stays still, and its pressure carries the displaced weight."""

import numpy as np

from measures.buoyancy import buoyancy_rows
from measures.checks import Checks
from measures.facts import liquid, still_rows
from micstools.reading.reader import Run

WAYS = ("divergence_tolerance", "coupling", "momentum", "solid_fraction", "subcells")
VARIES = tuple(f"numerics {name}" for name in (*WAYS, "pressure_solver"))
"""Every way to compute keeps still water still."""
QUICK = ("default", "paper", "split_cells", "pose")
SPEED_BAND = {1e-6: 1e-6, 1e-10: 1e-9}  # divergence tolerance [1/s]: largest speed [m/s]


def check(runs: list[Run], checks: Checks) -> None:
    """Speeds at all written times and in the final state; forces on the blocks at the end."""
    for run in runs:
        still_rows(run, checks, SPEED_BAND[run.value("numerics", "divergence_tolerance")])
        if run.value("numerics", "solid_fraction") == "subcell":
            # blocks under water carry the weight of the water that their counted sub-cells
            # displace; they stand apart along x: half way between two the cells change owner
            x = run.bodies.position[-1, :, 0]
            centre = run.grid.centres[0]
            share = run.fields_at(run.field_times[-1]).solid.astype(float).sum(axis=(0, 1))
            weight = liquid(run)[0] * 9.81 * share * run.grid.spacing.prod()
            for body in (0, 1):
                mine = np.abs(centre[:, None] - x).argmin(axis=1) == body
                force = run.bodies.fluid_force[-1, body, 2]
                name = f"{run.folder.name}: body {body + 1}, weight of the counted water [N]"
                checks.close(name, force, weight[mine].sum(), 1e-6)
        else:
            buoyancy_rows(run, checks)
