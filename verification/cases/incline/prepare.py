"""One case file for each row of D5.csv: a flat box and a sphere on a floor under tilted gravity.
With sleep, and without in three steps."""

from pathlib import Path

import numpy as np

ROWS = np.loadtxt(Path(__file__).with_name("D5.csv"), delimiter=",", skiprows=2)

for theta, mu, a_block, _ in ROWS:
    along, down = 9.81 * np.sin(np.radians(theta)), -9.81 * np.cos(np.radians(theta))
    runs = [("", "T", 1e-2)] + [(f"_{1e3 * dt:g}ms", "F", dt) for dt in (1e-3, 4e-3, 2e-2)]
    for kind, sleep, dt in runs:
        Path(f"deg{theta:.0f}_mu{100 * mu:03.0f}{kind}.nml").write_text(f"""\
! Flat box and sphere on an incline of {theta:g} degrees, friction {mu:g}.
! cost: 0.1 s
&run
  title = 'incline'
  physics = 'dry'
  t_end = {0.6 if a_block > 0.0 else 2.0}
  dt = {dt:g}
  field_interval = 0.0
  restart_interval = 0.0
/
&grid  cells = 100, 20, 10  length = 16.0, 0.3, 0.1 /
&fluid gravity = {along:.15g}, 0.0, {down:.15g} /
&contact friction = {mu:g}  wall_friction = {mu:g}  sleep = {sleep} /
&shape name = 'box'  kind = 'box'  size = 0.04, 0.04, 0.02 /
&shape name = 'sphere'  kind = 'sphere'  size = 0.04 /
&body  shape = 'box'  position = 0.1, 0.1, 0.01 /
&body  shape = 'sphere'  position = 0.1, 0.2, 0.02 /
""")
