"""Write the sinusoidal surfaces: amplitude a hundredth of the wavelength of 1 m, half a wave."""

from pathlib import Path

import numpy as np

from micstools.cases.initial_state import below_surface, write_initial_state

for cells in (16, 32, 64):  # per wavelength
    x = np.arange(cells // 2 + 1) / cells
    z = np.arange(-cells, cells + 1) / cells
    liquid = below_surface(lambda s: 0.01 * np.cos(2 * np.pi * s), x, z)
    write_initial_state(Path(f"wave_{cells}.h5"), liquid)
