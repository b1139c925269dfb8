"""Write the drops: exact liquid shares of a quarter disc and of an eighth of a ball."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.cases.initial_state import ball_shares, disc_shares, write_initial_state  # noqa: E402

plane = np.linspace(0.0, 0.01, 33)
write_initial_state(Path("plane.h5"), disc_shares((0.0, 0.0), 0.004, plane, plane))
space = np.linspace(0.0, 0.01, 25)
write_initial_state(Path("space.h5"), ball_shares((0.0, 0.0, 0.0), 0.007, (space,) * 3))
