"""A drop without gravity stays at rest, with the pressure jump of Young and Laplace."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

VARIES = ("numerics divergence_tolerance",)
CAPILLARY_BAND = 1e-8  # max|u| mu/sigma
JUMP_BAND = 0.01
SHAPES = {"plane": (0.004, 1), "space": (0.007, 2)}  # radius [m], curvature times radius


def check(runs: list[Run], checks: Checks) -> None:
    """Largest velocity and pressure jump in the final state."""
    for run in runs:
        name = run.folder.name
        radius, main_curvatures = SHAPES[name]
        sigma, mu = run.value("fluid", "surface_tension"), run.value("fluid", "liquid_viscosity")
        state = run.restart()
        speed = np.abs(state["flow/u"]).max()
        checks.below(f"{name}: capillary number", speed * mu / sigma, CAPILLARY_BAND)
        p, c = state["flow/p"], state["flow/c"]
        jump = p[c > 1 - 1e-8].mean() - p[c < 1e-8].mean()
        exact = main_curvatures * sigma / radius
        checks.close(f"{name}: pressure jump [Pa]", jump, exact, JUMP_BAND)
        fallen = f"{run.series.curvature_fallback[-1]:.0f}"
        checks.true(f"{name}: cells without heights at the end", True, fallen, counts=False)
