"""Write the sinusoidal surfaces: amplitude a hundredth of the wavelength of 1 m, half a wave."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))

from micstools.cases.initial_state import below_surface, write_initial_state  # noqa: E402

for cells in (16, 32, 64):  # per wavelength
    x = np.arange(cells // 2 + 1) / cells
    z = np.arange(-cells, cells // 2 + 1) / cells
    liquid = below_surface(lambda s: 0.01 * np.cos(2 * np.pi * s), x, z)
    write_initial_state(Path(f"wave_{cells}.h5"), liquid)
