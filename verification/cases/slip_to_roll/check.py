"""A sphere thrown along the floor slips, then rolls with 5/7 of its speed."""

from pathlib import Path

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run

BAND = 0.01
VARIES = ("contact wall_friction",)
ROWS = np.loadtxt(Path(__file__).with_name("D4.csv"), delimiter=",", skiprows=2)


def check(runs: list[Run], checks: Checks) -> None:
    """When slipping ends, where, and the speed from then on."""
    for run in runs:
        b = run.bodies
        radius = 0.02
        speed, along = b.velocity[:, 0, 0], b.position[:, 0, 0] - b.position[0, 0, 0]
        slip = speed - radius * b.angular_velocity[:, 0, 1]
        mu = float(run.value("contact", "wall_friction"))
        row = next(r for r in ROWS if np.allclose(r[:2], (speed[0], mu)))
        v0, _, v_roll, t_roll, x_roll = row
        rolling = int(np.argmax(slip <= 0.01 * v0))  # first row
        share = (slip[rolling - 1] - 0.0) / (slip[rolling - 2] - slip[rolling - 1])
        ours = b.time[rolling - 1] + share * (b.time[rolling - 1] - b.time[rolling - 2])
        name = f"v = {v0:g}, mu = {mu:g}:"
        checks.close(f"{name} slip ends at t [s]", float(ours), t_roll, BAND)
        place = float(np.interp(ours, b.time, along))
        checks.close(f"{name} there x [m]", place, x_roll, BAND)
        checks.close(f"{name} speed at the end [m/s]", float(speed[-1]), v_roll, BAND)
        spin = float(radius * b.angular_velocity[-1, 0, 1])
        checks.close(f"{name} rim speed at the end [m/s]", spin, v_roll, BAND)
        t = np.array([0.0, t_roll, b.time[-1]])
        ideal = (t, np.array([v0, v_roll, v_roll]))
        checks.figure(name, "t [s]", "m/s", {"mics": (b.time, speed)}, {"exact": ideal}, True)
