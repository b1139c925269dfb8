"""Way and speed of a sphere let go in still water against potential theory for the box."""

import numpy as np

from measures.checks import Checks
from measures.facts import liquid
from measures.potential import sphere_in_cube
from micstools.reading.reader import Run

VARIES = tuple(
    f"numerics {name}" for name in ("momentum", "solid_fraction", "subcells", "pressure_solver")
)
"""Of one run."""
THEORY_BAND, STEP_BAND = 0.02, 0.01
START_BAND = 0.03  # of way and speed at the ends of the first steps, at the default step
SPIN_BAND = 0.5  # speed of the surface by spin over that of the sphere
SHORT = 0.01  # s: runs with longer steps are looked at step by step


def acceleration(run: Run) -> float:
    """Mean vertical acceleration over the run [m/s2]."""
    b = run.bodies
    return float((b.velocity[-1, 0, 2] - b.velocity[0, 0, 2]) / (b.time[-1] - b.time[0]))


def start(run: Run, theory: float, checks: Checks) -> None:
    """Way and speed at the end of each step of the first thirtieth of a diameter."""
    b = run.bodies
    t = b.time - b.time[0]
    way = b.position[:, 0, 2] - b.position[0, 0, 2]
    diameter = 2 * run.shapes[b.shape[0]].radius
    for row in range(1, len(t)):
        if abs(theory) * t[row] ** 2 / 2 > diameter / 30:
            break
        name = f"{run.folder.name}: step {row}"
        checks.close(f"{name}, way [m]", way[row], theory * t[row] ** 2 / 2, START_BAND)
        checks.close(f"{name}, speed [m/s]", b.velocity[row, 0, 2], theory * t[row], START_BAND)


def check(runs: list[Run], checks: Checks) -> None:
    """Each run against theory, and those of a density against the one with the shortest step."""
    box = float((runs[0].grid.high - runs[0].grid.low)[2])
    by_ratio: dict[float, list[Run]] = {}
    for run in runs:
        shape, g, b = run.shapes[run.bodies.shape[0]], run.gravity[2], run.bodies
        ratio, dt = shape.density / liquid(run)[0], run.value("run", "dt")
        diameter = 2 * (3 * shape.volume / (4 * np.pi)) ** (1 / 3)
        theory = (ratio - 1) / (ratio + sphere_in_cube(diameter, box))
        if run.folder.name.endswith("spin"):
            spin = np.linalg.norm(b.angular_velocity[1:, 0], axis=1) * diameter / 2
            speed = np.linalg.norm(b.velocity[1:, 0], axis=1)
            name = f"{run.folder.name}: largest speed of the surface by spin / speed"
            checks.below(name, (spin / speed).max(), SPIN_BAND)
        elif dt >= SHORT:
            start(run, theory * g, checks)
        else:
            name = f"{run.folder.name}: s = {ratio:.3g}, dt = {dt:.2g} s"
            checks.close(f"{name}, a/g", acceleration(run) / g, theory, THEORY_BAND)
            sideways = np.abs(b.velocity[-1, 0, :2]).max() / abs(b.velocity[-1, 0, 2])
            checks.below(f"{name}, sideways speed / speed", sideways, 1e-6)
            by_ratio.setdefault(round(ratio, 6), []).append(run)
    for same in by_ratio.values():
        finest = min(same, key=lambda run: run.value("run", "dt"))
        for run in same:
            if run is not finest:
                name = f"{run.folder.name}: a against {finest.folder.name} [m/s2]"
                checks.close(name, acceleration(run), acceleration(finest), STEP_BAND)
