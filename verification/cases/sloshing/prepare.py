"""Write the surfaces of the first mode of a tank of 0.3 m: amplitude a hundredth of the depth."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import below_surface, write_initial_state

for cells in (16, 32, 64):  # per wavelength, which is twice the tank
    x = 0.3 * np.arange(cells // 2 + 1) / (cells // 2)
    z = 0.2 * np.arange(cells // 2 + 1) / (cells // 2)
    liquid = below_surface(lambda s: 0.15 + 0.0015 * np.cos(np.pi * s / 0.3), x, z)
    write_initial_state(Path(f"tank_{cells}.h5"), liquid)
