"""The trial of the two couplings: the tables of docs/decisions/coupling.md.

usage: python verification/trials/coupling.py [PART ...] [--program ./mics] [--out OUT]

PART: sphere steps still blocks fall float neutral; default: all, five minutes. Every part writes
its case files into OUT (build/trial-coupling), runs them with each coupling and prints its tables.
A finished run is used again: remove OUT to start afresh.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "verification" / "cases" / "free_sphere")]

from check import acceleration, added_mass  # noqa: E402, I001
from measures.balance import divergence  # noqa: E402
from measures.buoyancy import displaced  # noqa: E402
from micstools.reading.overlap import present_bodies  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402

G = 9.81  # [m/s2]
WATER, GAS = 998.2, 1.204  # [kg/m3]
COUPLINGS = {
    "monolithic": "coupling = 'monolithic'",
    "mics, 1 pass": "coupling = 'mics'  coupling_passes = 1",
    "mics, 2 passes": "coupling = 'mics'  coupling_passes = 2",
    "mics, 5 passes": "coupling = 'mics'  coupling_passes = 5",
}
SLIP = "  ".join(f"{side} = 'slip'" for side in ("x_min", "x_max", "y_min", "y_max"))
LEGS = "quaternion = 0.540625, 0.455768, -0.060003, -0.704554"  # on three legs, as in blocks.nml


class Trial:
    """Runs case files with one program, each into its own folder."""

    def __init__(self, program: Path, out: Path, threads: int) -> None:
        """Remember where things are."""
        self.program, self.out, self.threads = program.resolve(), out.resolve(), threads

    def run(self, name: str, text: str, numerics: str) -> tuple[Run, str]:
        """The result of a case with some `&numerics`, and how the program ended."""
        folder = self.out / name.replace(", ", "-").replace(" ", "-")
        if not (folder / "ended").is_file():
            self._start(folder, f"{text}&numerics {numerics} /\n")
        return Run(folder / "result"), (folder / "ended").read_text()

    def _start(self, folder: Path, text: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "case.nml").write_text(text)
        done = subprocess.run(
            [self.program, "--quiet", "--output", folder / "result", folder / "case.nml"],
            env={**os.environ, "OMP_NUM_THREADS": str(self.threads)},
            capture_output=True,
            text=True,
            check=False,
        )
        last = done.stderr.strip().splitlines()[-1:]
        (folder / "ended").write_text(" ".join([f"code {done.returncode}", *last]))


def table(title: str, heads: list[str], rows: list[list[str]]) -> None:
    """Print a table of the page."""
    print(f"\n{title}\n", flush=True)
    for row in [heads, ["---"] * len(heads), *rows]:
        print("| " + " | ".join(row) + " |", flush=True)


def sphere_case(ratio: float, cells: int, dt: float) -> str:
    """A sphere let go in a closed box of water three diameters wide, for 4 ms."""
    n = 3 * cells
    return f"""
&run t_end = 4.0e-3  dt = {dt}  cfl_max = 0.0  field_interval = 0.0  restart_interval = 0.0 /
&grid cells = {n}, {n}, {n}  length = 0.18, 0.18, 0.18 /
&boundary {SLIP}  z_min = 'slip'  z_max = 'slip' /
&fluid single_phase = .true.  liquid_density = 1000.0 /
&shape name = 'sphere'  kind = 'sphere'  size = 0.06  density = {1000 * ratio}  refinement = 4 /
&body shape = 'sphere'  position = 0.09, 0.09, 0.09 /
"""


def sphere_figure(run: Run, ratio: float) -> str:
    """Acceleration over gravity and its error against theory for the box."""
    volume = run.shapes["sphere"].volume
    diameter = 2 * (3 * volume / (4 * np.pi)) ** (1 / 3)
    theory = (ratio - 1) / (ratio + added_mass(diameter, 0.18))
    ours = -acceleration(run) / G
    return f"{ours:.4f} ({100 * (ours / theory - 1):+.1f} %)"


def sphere(trial: Trial) -> None:
    """Released sphere: density ratio and resolution."""
    rows = []
    cases = [(2.3, 8), (2.3, 12), (2.3, 16), (1.1, 8), (1.1, 12), (0.5, 8), (0.5, 12)]
    for ratio, cells in cases:
        row = [str(ratio), str(cells)]
        for name, numerics in COUPLINGS.items():
            text = sphere_case(ratio, cells, 1e-3)
            run, _ = trial.run(f"sphere-{ratio}-{cells}-{name}", text, numerics)
            row.append(sphere_figure(run, ratio))
        rows.append(row)
    table("Released sphere, a/g and error against theory", ["s", "D/h", *COUPLINGS], rows)


def steps(trial: Trial) -> None:
    """Released sphere: length of the step."""
    rows = []
    for ratio in (2.3, 0.5):
        for dt in (2.5e-4, 1e-3, 4e-3):
            row = [str(ratio), f"{1e3 * dt:g} ms"]
            for name, numerics in COUPLINGS.items():
                run, _ = trial.run(
                    f"steps-{ratio}-{dt}-{name}", sphere_case(ratio, 12, dt), numerics
                )
                worst = float(run.series.divergence_max[1:].max())
                row.append(f"{sphere_figure(run, ratio)}, {worst:.0e}")
            rows.append(row)
    heads = ["s", "dt", *COUPLINGS]
    table("The same at D/h = 12: a/g, error, largest divergence [1/s]", heads, rows)


STILL = f"""
&run t_end = 1.0  dt = 1.0e-2  field_interval = 0.0  restart_interval = 0.0 /
&grid cells = 24, 16, 30  length = 0.15, 0.1, 0.2 /
&fluid water_level = 0.1513 /
&shape name = 'hexapod'  kind = 'hexapod'  size = 0.02 /
&body shape = 'hexapod'  position = 0.075, 0.0487, 0.1467
  axis = 2.0, -1.0, 0.7  angle_deg = 28.0  fixed = .true. /
&body shape = 'hexapod'  position = 0.075, 0.05, 0.0288676  {LEGS}  fixed = .true. /
"""


def still(trial: Trial) -> None:
    """Held hexapods in still water, one through the surface and one on the floor."""
    rows = []
    tight = {
        f"{name}, tolerance 1e-10": f"{COUPLINGS[name]}  divergence_tolerance = 1e-10"
        for name in ("monolithic", "mics, 1 pass")
    }
    for name, numerics in (COUPLINGS | tight).items():
        run, ended = trial.run(f"still-{name}", STILL, numerics)
        speed = float(np.abs(run.restart()["flow/u"]).max())
        errors = []
        for k, body in present_bodies(run, -1).items():
            mass, _ = displaced(body, 0.1513, WATER, GAS)
            errors.append(f"{run.bodies.fluid_force[-1, k, 2] / (mass * G) - 1:+.1e}")
        drift = float(np.abs(run.series.liquid_volume_drift).max())
        rows.append([name, f"{speed:.1e}", *errors, f"{drift:.0e}", ended])
    heads = ["coupling", "max abs(u) [m/s]", "buoyancy, crossing", "submerged", "drift", "end"]
    table("Still water, held hexapods, after 1 s", heads, rows)


BLOCKS = (
    """
&run t_end = 3.0  dt = 1.0e-2  field_interval = 0.0  restart_interval = 0.25 /
&grid cells = 60, 10, 20  length = 0.3, 0.1, 0.2 /
&fluid water_level = 0.15 /
&contact model = 'spheres' /
&shape name = 'hexapod'  kind = 'hexapod'  size = 0.02  density = 2300.0 /
"""
    + "".join(
        f"&body shape = 'hexapod'  fixed = .true.  position = {x}, 0.05, 0.0288676  {LEGS} /\n"
        for x in (0.09, 0.15, 0.21)
    )
    + "&drop shape = 'hexapod'  position = 0.15, 0.05, 0.16  count = 3  interval = 0.6 /\n"
)


def noise(force: np.ndarray, time: np.ndarray, weight: float) -> float:
    """Root mean square of the second differences of a force from row to row, over weight; where
    the step changes by a tenth or more they tell nothing and are left out."""
    second, step = np.diff(force, n=2, axis=0), np.diff(time)
    equal = np.abs(np.diff(step)) < 0.1 * step[1:]
    return float(np.sqrt((second[equal] ** 2).sum(axis=1).mean())) / weight if any(equal) else 0.0


def blocks(trial: Trial) -> None:
    """Three blocks dropped through the surface onto three fixed ones."""
    rows, motion = [], []
    for name, numerics in COUPLINGS.items():
        run, ended = trial.run(f"blocks-{name}", BLOCKS, numerics)
        b, s = run.bodies, run.series
        first, free = b.dropped[0], b.dropped
        n = len(s.time) - 1
        in_file = max(
            float(np.abs(divergence(run, run.restart(f))).max()) for f in run.restart_files
        )
        rows.append(
            [
                name,
                str(n),
                f"{s.wall_time[-1] / n:.3f}",
                f"{s.pressure_passes[1:].mean():.1f}",
                f"{s.solver_iterations[1:].mean():.1f}",
                f"{np.median(s.divergence_max[1:]):.1e}",
                f"{s.divergence_max[1:].max():.1e}",
                f"{in_file:.1e}",
                f"{np.abs(s.liquid_volume_drift).max():.0e}",
                ended,
            ]
        )
        touched = np.flatnonzero(b.contacts[:, first] > 0)
        row = touched[0] if touched.size else len(b.time) - 1
        rest = (b.time > 2.5) & (np.abs(b.velocity[:, free]).max(axis=(1, 2)) < 5e-3)
        weight = float(b.mass[first]) * G
        quiet = "never" if rest.sum() < 5 else f"{rest.mean() / (b.time > 2.5).mean():.2f}"
        held = np.flatnonzero(b.fixed)
        rest_rows, fall_rows = b.time > 2.5, (b.time > 0.05) & (b.time < b.time[row])

        def loudest(rows_, group, b=b, weight=weight):
            found = (noise(b.fluid_force[rows_, k], b.time[rows_], weight) for k in group)
            return f"{max(found):.1e}"

        motion.append(
            [
                name,
                f"{b.time[row]:.3f}",
                f"{-b.velocity[:row, first, 2].min():.3f}",
                f"{np.abs(b.velocity[b.time > 2.5][:, free]).max():.1e}",
                quiet,
                *(loudest(rest_rows, group) for group in (free, held)),
                *(loudest(fall_rows, group) for group in ([first], held)),
            ]
        )
    heads = ["coupling", "steps", "s/step", "passes", "iterations", "div median", "div max"]
    heads += ["div max, from the restart files", "drift", "end"]
    table("Three drops, 60 x 10 x 20 cells, 3 s; divergence in 1/s", heads, rows)
    heads = ["coupling", "first touch [s]", "largest fall speed before [m/s]"]
    heads += ["largest speed after 2.5 s [m/s]", "share of that time below 5 mm/s"]
    heads += [f"noise of force / weight: {k}" for k in ("resting", "held, at rest")]
    heads += [f"{k}, first fall" for k in ("falling", "held")]
    table("The blocks in that run", heads, motion)


def fall_case(cells: str, steps: str, tilt: float) -> str:
    """One block let go half in the surface of the tank above the three fixed ones."""
    one = f"count = 1  axis = 1.0, 0.6, -0.3  angle_deg = {tilt}"
    text = BLOCKS.replace("60, 10, 20", cells).replace("count = 3  interval = 0.6", one)
    return text.replace("t_end = 3.0  dt = 1.0e-2", f"t_end = 0.15  {steps}")


def fall(trial: Trial) -> None:
    """Speed of the first block just before it touches: grids, length of step, upright or tilted."""
    rows = []
    for cells, ms, tilt in (
        ("60, 10, 20", 0, 0),
        ("60, 10, 20", 1, 0),
        ("60, 20, 40", 0, 0),
        ("60, 10, 20", 0, 25),
        ("60, 20, 40", 0, 25),
    ):
        steps_ = f"dt = {ms}e-3  cfl_max = 0.0" if ms else "dt = 1.0e-2"
        row = [cells, f"{ms} ms" if ms else "Courant 0.5", f"{tilt} deg"]
        for name, numerics in list(COUPLINGS.items())[:3]:
            text = fall_case(cells, steps_, tilt)
            run, _ = trial.run(f"fall-{cells}-{ms}-{tilt}-{name}", text, numerics)
            b = run.bodies
            speed, depth = -b.velocity[-1, -1, 2], b.position[0, -1, 2] - b.position[-1, -1, 2]
            wild = noise(b.fluid_force[5:, -1], b.time[5:], float(b.mass[-1]) * G)
            row.append(f"{speed:.3f}, {1e3 * depth:.1f}, {wild:.3f}")
        rows.append(row)
    heads = ["cells", "step", "tilt", *list(COUPLINGS)[:3]]
    table("Fall at 0.15 s: speed [m/s], depth [mm], noise of the force / weight", heads, rows)


BOX = (0.06, 0.06, 0.04)
RATIO = 0.6
FLOAT = f"""
&run t_end = 4.0  dt = 1.0e-2  field_interval = 0.0  restart_interval = 0.0 /
&grid cells = 24, 24, 20  length = 0.18, 0.18, 0.15 /
&boundary {SLIP} /
&fluid water_level = 0.0813 /
&shape name = 'box'  kind = 'box'  size = {BOX[0]}, {BOX[1]}, {BOX[2]}  density = {WATER * RATIO} /
&body shape = 'box'  position = 0.09, 0.09, 0.0853  axis = 1.0, 0.4, 0.0  angle_deg = 8.0 /
"""


def floating(trial: Trial) -> None:
    """A light box settles into flotation; Archimedes gives its draft."""
    rows = []
    for name, numerics in COUPLINGS.items():
        run, ended = trial.run(f"float-{name}", FLOAT, numerics)
        b = run.bodies
        immersed = (float(b.mass[0]) - GAS * np.prod(BOX)) / (WATER - GAS)  # volume under water
        draft = immersed / (BOX[0] * BOX[1])
        level = (run.series.liquid_volume[0] + immersed) / 0.18**2
        late = b.time > 3.0
        height = b.position[late, 0, 2]
        ours = level - height + BOX[2] / 2
        tilt = np.degrees(2 * np.arcsin(np.linalg.norm(b.quaternion[late, 0, 1:3], axis=1)))
        rows.append(
            [
                name,
                f"{1e3 * ours.mean():.3f}",
                f"{1e3 * draft:.3f}",
                f"{100 * (ours.mean() / draft - 1):+.2f} %",
                f"{1e3 * np.ptp(height) / 2:.3f}",
                f"{tilt.mean():.2f}",
                f"{np.abs(b.velocity[b.time > 0.05][:, 0]).max():.2f}",
                f"{np.abs(run.series.liquid_volume_drift).max():.0e}",
                f"{run.series.divergence_max[1:].max():.0e}",
                ended,
            ]
        )
    heads = ["coupling", "mean draft [mm]", "Archimedes [mm]", "error", "heave amplitude [mm]"]
    heads += ["tilt [deg]", "largest speed [m/s]", "drift", "div max [1/s]", "end"]
    table("Floating box, s = 0.6, last of 4 s", heads, rows)


NEUTRAL = f"""
&run t_end = 0.5  dt = 1.0e-2  field_interval = 0.0  restart_interval = 0.0 /
&grid cells = 28, 20, 28  length = 0.14, 0.12, 0.14 /
&fluid water_level = 0.1213 /
&shape name = 'hexapod'  kind = 'hexapod'  size = 0.02  density = {WATER} /
&body shape = 'hexapod'  position = 0.0712, 0.0603, 0.0624
  axis = 1.0, 0.6, -0.3  angle_deg = 31.0 /
"""


def neutral(trial: Trial) -> None:
    """A hexapod as heavy as water stays where it is."""
    rows = []
    for name, numerics in COUPLINGS.items():
        run, ended = trial.run(f"neutral-{name}", NEUTRAL, numerics)
        b = run.bodies
        speed = float(np.linalg.norm(b.velocity[:, 0], axis=1).max())
        turn = float(np.linalg.norm(b.angular_velocity[:, 0], axis=1).max())
        moved = float(np.linalg.norm(b.position[-1, 0] - b.position[0, 0]))
        rows.append([name, f"{speed:.1e}", f"{speed / (G * 0.5):.1e}", f"{turn:.1e}"])
        rows[-1] += [f"{moved:.1e}", ended]
    heads = ["coupling", "largest speed [m/s]", "over free fall", "turning [rad/s]"]
    heads += ["moved in 0.5 s [m]", "end"]
    table("Neutrally buoyant hexapod", heads, rows)


PARTS: dict[str, Callable[[Trial], None]] = {
    "sphere": sphere,
    "steps": steps,
    "still": still,
    "blocks": blocks,
    "fall": fall,
    "float": floating,
    "neutral": neutral,
}


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", nargs="*", default=list(PARTS), help=" ".join(PARTS))
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "trial-coupling")
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    trial = Trial(given.program, given.out, given.threads)
    for part in given.part:
        PARTS[part](trial)


if __name__ == "__main__":
    main()
