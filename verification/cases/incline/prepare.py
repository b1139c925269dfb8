"""One case file for each row of D5.csv: a flat box and a sphere on a floor under tilted gravity.
With sleep, and without in three steps."""

from pathlib import Path

import numpy as np

TEXT = Path(__file__).with_name("template.txt").read_text()
ROWS = np.loadtxt(Path(__file__).with_name("D5.csv"), delimiter=",", skiprows=2)

for theta, mu, a_block, _ in ROWS:
    along, down = 9.81 * np.sin(np.radians(theta)), -9.81 * np.cos(np.radians(theta))
    runs = [("", "T", 1e-2)] + [(f"_{1e3 * dt:g}ms", "F", dt) for dt in (1e-3, 4e-3, 2e-2)]
    for kind, sleep, dt in runs:
        Path(f"deg{theta:.0f}_mu{100 * mu:03.0f}{kind}.nml").write_text(TEXT.format(
            theta=theta, mu=mu, end=0.6 if a_block > 0.0 else 2.0, dt=dt, along=along, down=down,
            sleep=sleep))  # fmt: skip
