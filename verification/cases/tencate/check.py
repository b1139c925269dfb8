"""Speed of a settling sphere against the measurements of ten Cate et al. (2002)."""

import csv
from pathlib import Path

import numpy as np

from micstools.checks import Checks, sound
from micstools.reader import Run

HERE = Path(__file__).resolve().parent
CURVE_BAND = 0.05  # of the measured largest speed


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


def check(runs: list[Run]) -> Checks:
    """Largest speed and the whole curve; errors over resolution."""
    checks = Checks("settling sphere of ten Cate")
    for reference in rows("cases.csv"):
        case, peak = reference["case"], float(reference["umax_exp_m_s"])
        density = float(reference["rho_f"])
        mine = [r for r in runs if float(r.value("fluid", "liquid_density", 0.0)) == density]
        curves, peaks, heights = {}, {}, {}
        times, speeds = measured(f"{case}_velocity.csv")
        for run in sorted(mine, key=lambda r: -r.grid.spacing[0]):
            diameter = float(run.value("shape", "size", 0.0))
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
            worst = float(np.abs(ours - scaled)[passed].max()) / peak
            said = "speed at the same height, largest deviation / peak"
            checks.below(f"{name}: {said}", worst, CURVE_BAND, gated)
            at_time = np.abs(np.interp(times, b.time, speed) - speeds)[times <= b.time[-1]]
            said = "speed at the same time, not scaled, median deviation / peak"
            checks.below(f"{name}: {said}", float(np.median(at_time)) / peak, CURVE_BAND, False)
            heights[f"{cells:g} cells"] = (gap[falling] / diameter, speed[falling])
            sideways = float(np.abs(b.velocity[:, 0, :2]).max()) / peak
            checks.below(f"{name}: sideways speed / peak", sideways, 1e-3, counts=gated)
            sound(run, checks)
        if not mine:
            continue
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
    return checks
