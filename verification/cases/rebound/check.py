"""First rebound of a sphere from a wall in oil against Gondret et al. (2002), and its film."""

import csv
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
VARIES = ("contact restitution", "contact contact_time", "contact lubrication")
QUICK = ("approach_06",)
BAND, FILM_BAND, MEAN_BAND = 0.25, 0.05, 0.03
IMPACT = {"St27": 0.518, "St152": 0.585}  # speed of impact [m/s], in the heads of the files


def measured(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] from the impact and gaps [m]."""
    lines = (HERE / f"{name}.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    times, gaps = np.array([(float(r["t_s"]), float(r["gap_m"])) for r in rows]).T
    return times, gaps


def brenner(gap: np.ndarray) -> np.ndarray:
    """Resistance over Stokes' drag of a sphere that moves to a plane, by gap over radius; the
    difference from the asymptote is interpolated."""
    lines = (HERE / "brenner.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    at = np.array([float(row["gap_over_a"]) for row in rows])
    rest = np.array([float(r["factor_exact"]) - float(r["factor_lubrication"]) for r in rows])
    return 1 / gap + 0.2 * np.log(1 / gap) + 0.9713 + np.interp(gap, at, rest)


def approach(checks: Checks, runs: list[Run]) -> None:
    """Resistance of the film under a sphere that is moved to the floor."""
    curves, wanted = {}, {}
    for run in runs:
        b, radius = run.bodies, float(run.value("shape", "size")) / 2
        viscosity = float(run.value("fluid", "liquid_viscosity"))
        film = bool(run.value("contact", "lubrication"))
        speed = -float(b.velocity[-1, 0, 2])
        gap = (b.position[:, 0, 2] - radius + 0.5 * speed * run.series.dt) / radius  # of the step
        force = b.fluid_force[:, 0, 2] + b.contact_force[:, 0, 2]
        factor = force / (6 * np.pi * viscosity * radius * speed)
        cell = float(run.grid.spacing[2]) / radius
        exact, thin = brenner(gap), (gap < cell) & (gap > 0.1 * cell)
        errors = (factor / exact - 1)[thin]
        said = run.folder.name.replace("_", " ")
        about = f"{said}: resistance of the film from 0.1 to 1 cell"
        checks.below(f"{about}, largest error", float(np.abs(errors).max()), FILM_BAND, film)
        checks.below(f"{about}, mean error", abs(float(errors.mean())), MEAN_BAND, film)
        curves[said] = (gap[5:] / cell, factor[5:])
        wanted["Brenner (1961)"] = (gap[5:] / cell, exact[5:])
    if curves:
        checks.figure("moved to the floor", "gap / cell", "- / Stokes", curves, wanted, smooth=True)


def check(runs: list[Run], checks: Checks) -> None:
    """Speed before the wall, height of the first rebound."""
    approach(checks, [run for run in runs if run.folder.name.startswith("approach")])
    falls = [run for run in runs if not run.folder.name.startswith("approach")]
    for name, impact in IMPACT.items():
        times, gaps = measured(name)
        top = float(gaps[times > 0].max())
        curves, heights = {}, {}
        for run in falls:
            viscosity = float(run.value("fluid", "liquid_viscosity"))
            if (viscosity > 0.05) != (name == "St27"):
                continue
            film = bool(run.value("contact", "lubrication"))
            b, diameter = run.bodies, float(run.value("shape", "size"))
            gap = b.position[:, 0, 2] - diameter / 2
            struck = int(np.flatnonzero(b.contacts[:, 0] > 0)[0])
            cells = round(diameter / float(run.grid.spacing[2]), 1)
            said = f"{name}, {cells:g} cells per diameter{'' if film else ', without films'}"
            away = gap[:struck] > diameter / 2
            arrived = float(-b.velocity[:struck, 0, 2][away][-1])
            checks.close(f"{said}: speed at half a diameter [m/s]", arrived, impact, 0.05, False)
            later = gap[struck:]
            down = np.flatnonzero(np.diff(later[later.argmax() :]) > 0)
            end = struck + int(later.argmax()) + (int(down[0]) if down.size else len(later))
            height = float(gap[struck:end].max())
            checks.close(
                f"{said}: height of the first rebound [mm]", 1e3 * height, 1e3 * top, BAND, film
            )
            if film:
                heights[cells] = 1e3 * height
            curves[said] = (b.time - b.time[struck], 1e3 * gap)
        if curves:
            checks.study(f"{name}: height [mm]", heights, 1e3 * top, "cells per diameter")
            checks.figure(name, "t [s]", "gap [mm]", curves, {"measured": (times, 1e3 * gaps)})
