"""Write the drops: exact liquid shares of a quarter disc and of an eighth of a ball."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import ball_shares, disc_shares, write_initial_state

plane = np.linspace(0.0, 0.01, 33)
write_initial_state(Path("plane.h5"), disc_shares((0.0, 0.0), 0.004, plane, plane))
space = np.linspace(0.0, 0.01, 25)
write_initial_state(Path("space.h5"), ball_shares((0.0, 0.0, 0.0), 0.007, (space,) * 3))
