"""Initial velocity of the Taylor-Green vortices, one file for each grid."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import write_initial_state

for n in (16, 32, 64, 128):
    centres = (np.arange(n) + 0.5) * 2.0 * np.pi / n
    x, z = centres[None, None, :], centres[:, None, None]
    u, w = np.cos(x) * np.sin(z), -np.sin(x) * np.cos(z)
    write_initial_state(Path(f"cells_{n}.h5"), velocity=np.stack([u, 0.0 * u, w], axis=-1))
