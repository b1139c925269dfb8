"""Draft, heave period and stability of floating boxes."""

import numpy as np

from measures.buoyancy import densities
from measures.checks import Checks
from micstools.reading.reader import Run

DRAFT_BAND, ARM_BAND = 0.01, 1e-6
G = 9.81


def tilt_deg(run: Run) -> np.ndarray:
    """Angle of the upright axis of the box to the vertical at every row."""
    x, y = run.bodies.quaternion[:, 0, 1], run.bodies.quaternion[:, 0, 2]
    return np.degrees(np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1)))


def draft_of_weight(run: Run) -> float:
    """Draft of the upright box at rest by Archimedes, water below and air above [m]."""
    liquid, gas = densities(run)
    sides = np.array(run.value("shape", "size"), float)
    immersed = (run.bodies.mass[0] - gas * sides.prod()) / (liquid - gas)
    return float(immersed / (sides[0] * sides[1]))


def metacentric_height(run: Run) -> float:
    """Height of the metacentre above the centre of mass of the floating upright box [m]."""
    width, _, height = run.value("shape", "size")
    draft = draft_of_weight(run)
    return float(width**2 / (12 * draft) + draft / 2 - height / 2)


def righting_arm(run: Run) -> tuple[float, float]:
    """Righting arm over the sine of the tilt [m] of a box of square section that is held in still
    water: ours, from the torque, and that of theory.

    The water's plane cuts the four sides only, at the height d + s x above the base, x along the
    tilt. So the immersed part has the volume B^2 d and its centroid x = B^2 s/(12 d) aside and
    (d^2 + s^2 B^2/12)/(2 d) above the base; both turn with the box.
    """
    b = run.bodies
    (liquid, gas), level = densities(run), run.value("fluid", "water_level")
    width, _, height = run.value("shape", "size")
    tilt = np.radians(tilt_deg(run)[0])
    draft = (level - b.position[0, 0, 2]) / np.cos(tilt) + height / 2
    slope = np.tan(tilt)
    aside = width**2 * slope / (12 * draft)
    above = (draft**2 + slope**2 * width**2 / 12) / (2 * draft) - height / 2
    arm = aside * np.cos(tilt) + above * np.sin(tilt)
    lift = (liquid - gas) * G * width**2 * draft
    # a torque along the axis of the tilt would tilt it further
    axis = b.quaternion[0, 0, 1:] / np.linalg.norm(b.quaternion[0, 0, 1:])
    ours = -float(b.fluid_torque[-1, 0] @ axis) / lift
    return ours / float(np.sin(tilt)), float(arm / np.sin(tilt))


def mean_draft(run: Run) -> tuple[float, float, np.ndarray]:
    """Mean draft over whole periods [m], the heave period [s] and the draft at every row, against
    the level that the liquid would have at rest."""
    b, high = run.bodies, run.grid.high - run.grid.low
    sides = np.array(run.value("shape", "size"), float)
    raised = sides[0] * sides[1] * draft_of_weight(run)
    level = (run.series.liquid_volume + raised) / (high[0] * high[1])
    draft = level - (b.position[:, 0, 2] - sides[2] / 2)
    even = np.arange(0.0, b.time[-1], 1e-3)
    d = np.interp(even, b.time, draft)
    rising = np.flatnonzero((d[:-1] < d.mean()) & (d[1:] >= d.mean()))
    period = float(np.diff(even[rising]).mean()) if len(rising) > 1 else float("nan")
    whole = slice(rising[0], rising[-1]) if len(rising) > 1 else slice(None)
    return float(d[whole].mean()), period, draft


def check(runs: list[Run], checks: Checks) -> None:
    """Each upright box: draft and period; each tilted one: whether it comes back."""
    for run in runs:
        name, b = run.folder.name, run.bodies
        kind, t = name.split("_")[0], tilt_deg(run)
        if name.endswith("held"):
            ours, arm = righting_arm(run)
            said = f"{kind} box held at {t[0]:.0f} deg: righting arm / sine [mm]"
            checks.close(said, 1e3 * ours, 1e3 * arm, ARM_BAND)
        elif name.endswith("tilted"):
            metacentre, last = 1e3 * metacentric_height(run), t[b.time > 0.75 * b.time[-1]].max()
            figures = f"{t[0]:.1f} at first, {last:.1f} deg at most in the last quarter"
            said = f"GM = {metacentre:+.1f} mm: a {kind} box"
            if metacentre > 0:
                checks.true(f"{said} comes back", 1.05 * t[0] > t.max() > 5 * t.min(), figures)
            else:
                checks.true(f"{said} capsizes", last > 45, figures)
        else:
            expected, cells = draft_of_weight(run), 0.06 / float(run.grid.spacing[2])
            found, period, draft = mean_draft(run)
            name = f"{cells:.0f} cells per height"
            checks.close(f"{name}: mean draft [m]", found, expected, DRAFT_BAND)
            low, high = (2 * np.pi * np.sqrt((1 + ca) * expected / G) for ca in (0.3, 1.0))
            checks.within(f"{name}: heave period [s]", period, low, high)
            exact = {"Archimedes": ([0.0, 3.0], [1e3 * expected] * 2)}
            checks.figure("draft", "t [s]", "mm", {name: (b.time, 1e3 * draft)}, exact, smooth=True)
            checks.study("mean draft [m]", {cells: found}, expected, "cells per height")
