"""Speed of a settling sphere against the measurements of ten Cate et al. (2002)."""

import csv
from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

HERE = Path(__file__).resolve().parent
VARIES = ("contact lubrication",)
CURVE_BAND = 0.05  # of the measured largest speed
START_BAND = 0.02  # of the measured largest speed
START = 0.05  # diameters of fall in which the start is judged


def peak_band(cells: float) -> float:
    """Band of the largest speed at so many cells per diameter."""
    return 0.025 if cells > 14 else 0.04


def rows(name: str) -> list[dict[str, str]]:
    """A reference file without its comment lines."""
    lines = (HERE / name).read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def measured(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and downward speeds [m/s] of a digitised curve."""
    found = [(float(r["t_s"]), float(r["speed_down_m_s"])) for r in rows(name)]
    times, speeds = np.array(found).T
    return times, speeds


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
    liquid = float(run.value("fluid", "liquid_density"))
    viscosity = float(run.value("fluid", "liquid_viscosity"))
    solid, radius = run.shapes["sphere"].density, float(run.value("shape", "size")) / 2
    steps, volume = 2000, 4 / 3 * np.pi * radius**3
    dt = end / steps
    inertia = (solid + liquid / 2) * volume / dt
    weight = (solid - liquid) * volume * 9.81
    stokes = 6 * np.pi * viscosity * radius
    basset = 6 * radius**2 * np.sqrt(np.pi * liquid * viscosity)
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
    for reference in rows("cases.csv"):
        case, peak = reference["case"], float(reference["umax_exp_m_s"])
        density = float(reference["rho_f"])
        mine = [r for r in runs if float(r.value("fluid", "liquid_density")) == density]
        curves, peaks, heights = {}, {}, {}
        times, speeds = measured(f"{case}_velocity.csv")
        for run in sorted(mine, key=lambda r: -r.grid.spacing[0]):
            diameter = float(run.value("shape", "size"))
            cells = round(diameter / float(run.grid.spacing[0]), 1)
            b = run.bodies
            speed = -b.velocity[:, 0, 2]
            gap = b.position[:, 0, 2] - diameter / 2
            name = f"{case}, {cells:g} cells per diameter"
            curves[f"{cells:g} cells"] = (b.time, speed)
            peaks[cells] = float(speed.max())
            gated = cells > 10
            checks.close(
                f"{name}: largest speed [m/s]", peaks[cells], peak, peak_band(cells), counts=gated
            )
            way, scaled = scaled_to_way(times, speeds, float(b.position[0, 0, 2]) - diameter / 2)
            falling = slice(None, int(np.argmin(gap)) + 1)
            passed = way < gap[0] - gap.min() + 1e-3 * diameter
            ours = np.interp(-(gap[0] - way), -gap[falling], speed[falling])
            apart = np.abs(ours - scaled) / peak
            said = "speed at the same height, largest deviation / peak"
            checks.below(f"{name}: {said}", float(apart[passed].max()), CURVE_BAND, gated)
            # the first points an exact solution contradicts; the last is on the floor, yet moves
            between = passed & (way >= START * diameter) & (way < way[-1])
            said += ", without start and floor"
            checks.below(f"{name}: {said}", float(apart[between].max()), CURVE_BAND, False)
            start, start_way, start_speed = exact_start(run, float(b.time[-1]) / 10)
            started = b.time < np.interp(START * diameter, start_way, start)
            exact = np.interp(b.time[started], start, start_speed)
            off = float(np.abs(speed[started] - exact).max()) / peak
            said = f"speed in the first {START:g} diameters against the exact start, / peak"
            checks.below(f"{name}: {said}", off, START_BAND, gated)
            at_time = np.abs(np.interp(times, b.time, speed) - speeds)[times <= b.time[-1]]
            said = "speed at the same time, not scaled, median deviation / peak"
            checks.below(f"{name}: {said}", float(np.median(at_time)) / peak, CURVE_BAND, False)
            heights[f"{cells:g} cells"] = (gap[falling] / diameter, speed[falling])
            sideways = float(np.abs(b.velocity[:, 0, :2]).max()) / peak
            checks.below(f"{name}: sideways speed / peak", sideways, 1e-3, counts=gated)
        if not mine:
            continue
        soon = way < START * diameter
        exact = np.interp(way[soon], start_way, start_speed)
        off = float(np.abs(scaled[soon] - exact).max()) / peak
        said = f"measured speed in the first {START:g} diameters against the exact start, / peak"
        checks.below(f"{case}: {said}", off, START_BAND, False)
        finest = max(peaks)
        lattice = float(reference["umax_LBM_m_s"])
        checks.close(
            f"{case}: largest speed against the lattice-Boltzmann one of the paper",
            peaks[finest],
            lattice,
            0.05,
            counts=False,
        )
        checks.study(f"{case}: largest speed [m/s]", peaks, resolution="cells per diameter")
        checks.figure(
            f"case {case}: speed at a height",
            "gap / diameter",
            "downward speed [m/s]",
            heights,
            {"fig. 8(b), scaled to the way": ((gap[0] - way) / diameter, scaled)},
        )
        shown = {"fig. 8(b)": (times, speeds)}
        if case == "E1":
            shown["read a second time"] = measured("E1_velocity_second_digitisation.csv")
        checks.figure(f"case {case}", "t [s]", "downward speed [m/s]", curves, shown)
