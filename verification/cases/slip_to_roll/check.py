"""A sphere thrown along the floor slips, then rolls with 5/7 of its speed."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from micstools.reading.reader import Run

BAND = 0.01
VARIES = ("contact wall_friction",)
ROWS = table(__file__, "D4.csv").to_numpy()


def check(runs: list[Run], checks: Checks) -> None:
    """When slipping ends, where, and the speed from then on."""
    for run in runs:
        b, radius, mu = run.bodies, 0.02, run.value("contact", "wall_friction")
        speed, along = b.velocity[:, 0, 0], b.position[:, 0, 0] - b.position[0, 0, 0]
        rim = radius * b.angular_velocity[:, 0, 1]
        slip = speed - rim
        row = next(r for r in ROWS if np.allclose(r[:2], (speed[0], mu)))
        v0, _, v_roll, t_roll, x_roll = row
        rolling = int(np.argmax(slip <= 0.01 * v0))  # first row
        share = (slip[rolling - 1] - 0.0) / (slip[rolling - 2] - slip[rolling - 1])
        ours = b.time[rolling - 1] + share * (b.time[rolling - 1] - b.time[rolling - 2])
        name = f"v = {v0:g}, mu = {mu:g}:"
        checks.close(f"{name} slip ends at t [s]", ours, t_roll, BAND)
        checks.close(f"{name} there x [m]", np.interp(ours, b.time, along), x_roll, BAND)
        checks.close(f"{name} speed at the end [m/s]", speed[-1], v_roll, BAND)
        checks.close(f"{name} rim speed at the end [m/s]", rim[-1], v_roll, BAND)
        ideal = ([0.0, t_roll, b.time[-1]], [v0, v_roll, v_roll])
        checks.figure(name, "t [s]", "m/s", {"mics": (b.time, speed)}, {"exact": ideal}, True)
