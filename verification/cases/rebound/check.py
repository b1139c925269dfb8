"""First rebound of a sphere from a wall in oil against Gondret et al. (2002), and its film."""

import numpy as np

from measures.checks import Checks
from measures.facts import cells as cells_along
from measures.facts import liquid, size, table
from micstools.reading.reader import Run

VARIES = ("contact restitution", "contact contact_time", "contact lubrication")
QUICK = ("approach_06",)
BAND, FILM_BAND, MEAN_BAND = 0.25, 0.05, 0.03
WALL = "Brenner (1961)"
IMPACT = {"St27": 0.518, "St152": 0.585}  # speed of impact [m/s], in the heads of the files


def brenner(gap: np.ndarray) -> np.ndarray:
    """Resistance over Stokes' drag of a sphere that moves to a plane, by gap over radius; the
    difference from the asymptote is interpolated."""
    known = table(__file__, "brenner.csv")
    rest = np.interp(gap, known.gap_over_a, known.factor_exact - known.factor_lubrication)
    return 1 / gap + 0.2 * np.log(1 / gap) + 0.9713 + rest


def approach(checks: Checks, runs: list[Run]) -> None:
    """Resistance of the film under a sphere that is moved to the floor."""
    for run in runs:
        b, radius, viscosity = run.bodies, size(run) / 2, liquid(run)[1]
        film, speed = run.value("contact", "lubrication"), -b.velocity[-1, 0, 2]
        gap = (b.position[:, 0, 2] - radius + 0.5 * speed * run.series.dt) / radius  # of the step
        force = b.fluid_force[:, 0, 2] + b.contact_force[:, 0, 2]
        factor = force / (6 * np.pi * viscosity * radius * speed)
        cell = run.grid.spacing[2] / radius
        exact, thin = brenner(gap), (gap < cell) & (gap > 0.1 * cell)
        errors = (factor / exact - 1)[thin]
        said = run.folder.name.replace("_", " ")
        about = f"{said}: resistance of the film from 0.1 to 1 cell"
        checks.below(f"{about}, largest error", np.abs(errors).max(), FILM_BAND, film)
        checks.below(f"{about}, mean error", abs(errors.mean()), MEAN_BAND, film)
        curves = ({n: (gap[5:] / cell, f[5:])} for n, f in ((said, factor), (WALL, exact)))
        checks.figure("moved to the floor", "gap / cell", "- / Stokes", *curves, smooth=True)


def check(runs: list[Run], checks: Checks) -> None:
    """Speed before the wall, height of the first rebound."""
    approach(checks, [run for run in runs if run.folder.name.startswith("approach")])
    falls = [run for run in runs if not run.folder.name.startswith("approach")]
    for name, impact in IMPACT.items():
        times, gaps = table(__file__, f"{name}.csv").to_numpy().T
        top = gaps[times > 0].max()
        for run in falls:
            if (liquid(run)[1] > 0.05) != (name == "St27"):
                continue
            b, diameter, film = run.bodies, size(run), run.value("contact", "lubrication")
            gap = b.position[:, 0, 2] - diameter / 2
            struck = int(np.flatnonzero(b.contacts[:, 0] > 0)[0])
            cells = cells_along(run, diameter)
            said = f"{name}, {cells:g} cells per diameter{'' if film else ', without films'}"
            away = gap[:struck] > diameter / 2
            arrived = -b.velocity[:struck, 0, 2][away][-1]
            checks.close(f"{said}: speed at half a diameter [m/s]", arrived, impact, 0.05, False)
            later = gap[struck:]
            down = np.flatnonzero(np.diff(later[later.argmax() :]) > 0)
            end = int(later.argmax()) + (int(down[0]) if down.size else len(later))
            height, about = later[:end].max(), f"{said}: height of the first rebound [mm]"
            checks.close(about, 1e3 * height, 1e3 * top, BAND, film)
            if film:
                heights = {cells: 1e3 * height}
                checks.study(f"{name}: height [mm]", heights, 1e3 * top, "cells per diameter")
            curves = {said: (b.time - b.time[struck], 1e3 * gap)}
            checks.figure(name, "t [s]", "gap [mm]", curves, {"measured": (times, 1e3 * gaps)})
