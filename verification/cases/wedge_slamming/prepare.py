"""Write `wedge_NN.txt`: half a wedge of NN degrees deadrise, 0.15 wide, 0.02 long along y."""

from pathlib import Path

import numpy as np

from micstools.shapes.meshing import shape_text

WIDTH, LENGTH = 0.15, 0.02

for degrees in (20, 30, 40):
    height = WIDTH * np.tan(np.radians(degrees))
    section = [(0.0, 0.0), (WIDTH, height), (0.0, height)]
    points = [(x, y, z) for y in (0.0, LENGTH) for x, z in section]
    tets = np.array([(0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)])
    Path(f"wedge_{degrees}.txt").write_text(shape_text(np.array(points), tets))
