"""Speed of a settling sphere against the measurements of ten Cate et al. (2002)."""

import numpy as np

from measures.checks import Checks
from measures.facts import liquid, size, table
from micstools.reading.reader import Run

VARIES = ("contact lubrication",)
CURVE_BAND = 0.05  # of the measured largest speed
START_BAND = 0.02  # of the measured largest speed
START = 0.05  # diameters of fall in which the start is judged


def scaled_to_way(times: np.ndarray, speeds: np.ndarray, fall: float) -> tuple:
    """Way [m] at each time of a measured curve that ends on the floor, and the speeds, both scaled
    so that it ends there: the sphere cannot have gone further than `fall`."""
    t, v = np.append(0.0, times), np.append(0.0, speeds)
    way = np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(t))
    return way * fall / way[-1], speeds * fall / way[-1]


def exact_start(run: Run, end: float) -> tuple:
    """Times until `end` [s], way [m] and speed [m/s] of a sphere let go in a liquid without walls.

    Equation of Boussinesq and Basset: displaced liquid, half of it as added mass, Stokes drag and
    history. Exact while the way is short against the diameter, before the liquid's own convection
    and the walls are felt."""
    density, viscosity = liquid(run)
    solid, radius = run.shapes["sphere"].density, size(run) / 2
    steps, volume = 2000, 4 / 3 * np.pi * radius**3
    dt = end / steps
    inertia = (solid + density / 2) * volume / dt
    weight = (solid - density) * volume * 9.81
    stokes = 6 * np.pi * viscosity * radius
    basset = 6 * radius**2 * np.sqrt(np.pi * density * viscosity)
    root, speed = np.sqrt(dt * np.arange(steps + 1)), np.zeros(steps + 1)
    for n in range(1, steps + 1):
        share = 2 * (root[n:0:-1] - root[n - 1 :: -1]) / dt  # of the steps 1 to n in the history
        past = share[:-1] @ np.diff(speed[:n])
        drive = weight - basset * past + (inertia + basset * share[-1]) * speed[n - 1]
        speed[n] = drive / (inertia + stokes + basset * share[-1])
    way = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * dt))
    return root**2, way, speed


def check(runs: list[Run], checks: Checks) -> None:
    """Largest speed and the whole curve; errors over resolution."""
    for reference in table(__file__, "cases.csv").itertuples():
        case, peak = reference.case, reference.umax_exp_m_s
        mine = [r for r in runs if liquid(r)[0] == reference.rho_f]
        peaks = {}
        times, speeds = table(__file__, f"{case}_velocity.csv").to_numpy().T
        for run in sorted(mine, key=lambda r: -r.grid.spacing[0]):
            b, diameter = run.bodies, size(run)
            cells = round(diameter / float(run.grid.spacing[0]), 1)
            speed, gap = -b.velocity[:, 0, 2], b.position[:, 0, 2] - diameter / 2
            name, gated = f"{case}, {cells:g} cells per diameter", cells > 10
            peaks[cells] = speed.max()
            band = 0.025 if cells > 14 else 0.04
            checks.close(f"{name}: largest speed [m/s]", peaks[cells], peak, band, gated)
            way, scaled = scaled_to_way(times, speeds, gap[0])
            falling = slice(None, int(np.argmin(gap)) + 1)
            passed = way < gap[0] - gap.min() + 1e-3 * diameter
            ours = np.interp(-(gap[0] - way), -gap[falling], speed[falling])
            apart = np.abs(ours - scaled) / peak
            said = f"{name}: speed at the same height, largest deviation / peak"
            checks.below(said, apart[passed].max(), CURVE_BAND, gated)
            # the first points an exact solution contradicts; the last is on the floor, yet moves
            between = passed & (way >= START * diameter) & (way < way[-1])
            said += ", without start and floor"
            checks.below(said, apart[between].max(), CURVE_BAND, False)
            start, start_way, start_speed = exact_start(run, b.time[-1] / 10)
            started = b.time < np.interp(START * diameter, start_way, start)
            exact = np.interp(b.time[started], start, start_speed)
            off = np.abs(speed[started] - exact).max() / peak
            said = f"speed in the first {START:g} diameters against the exact start, / peak"
            checks.below(f"{name}: {said}", off, START_BAND, gated)
            at_time = np.abs(np.interp(times, b.time, speed) - speeds)[times <= b.time[-1]]
            said = f"{name}: speed at the same time, not scaled, median deviation / peak"
            checks.below(said, np.median(at_time) / peak, CURVE_BAND, False)
            sideways = np.abs(b.velocity[:, 0, :2]).max() / peak
            checks.below(f"{name}: sideways speed / peak", sideways, 1e-3, gated)
            height = {f"{cells:g} cells": (gap[falling] / diameter, speed[falling])}
            scale = {"fig. 8(b), scaled to the way": ((gap[0] - way) / diameter, scaled)}
            title, axis = f"case {case}: speed at a height", "downward speed [m/s]"
            checks.figure(title, "gap / diameter", axis, height, scale)
            curve, shown = {f"{cells:g} cells": (b.time, speed)}, {"fig. 8(b)": (times, speeds)}
            if case == "E1":
                again = table(__file__, "E1_velocity_second_digitisation.csv").to_numpy().T
                shown["read a second time"] = again
            checks.figure(f"case {case}", "t [s]", axis, curve, shown)
        if not mine:
            continue
        soon = way < START * diameter
        exact = np.interp(way[soon], start_way, start_speed)
        off = np.abs(scaled[soon] - exact).max() / peak
        said = f"measured speed in the first {START:g} diameters against the exact start, / peak"
        checks.below(f"{case}: {said}", off, START_BAND, False)
        said = f"{case}: largest speed against the lattice-Boltzmann one of the paper"
        checks.close(said, peaks[max(peaks)], reference.umax_LBM_m_s, 0.05, False)
        checks.study(f"{case}: largest speed [m/s]", peaks, resolution="cells per diameter")
