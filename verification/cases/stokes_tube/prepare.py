"""Write `tube.txt`: a block 2.4 wide and 4 high with a round hole of radius 1 along z."""

from pathlib import Path

import numpy as np

from micstools.shapes.meshing import shape_text

SIDES, LAYERS, HALF_WIDTH, HEIGHT = 96, 8, 1.2, 4.0

angle = 2 * np.pi * np.arange(SIDES) / SIDES  # holds the four corners
inside = np.array([np.cos(angle), np.sin(angle)]).T
area = SIDES / 2 * np.sin(2 * np.pi / SIDES)
outside = HALF_WIDTH * inside / np.abs(inside).max(axis=1)[:, None]
# the polygon has the area of the circle
ring = np.vstack([inside * np.sqrt(np.pi / area), outside])
levels = np.linspace(-HEIGHT / 2, HEIGHT / 2, LAYERS + 1)
points = [(*xy, z) for z in levels for xy in ring]

tets = []
for layer in range(LAYERS):
    for k in range(SIDES):
        a, b, c, d = k, (k + 1) % SIDES, SIDES + k, SIDES + (k + 1) % SIDES
        for corner in ((a, b, c), (b, d, c)):
            # a prism into three; the order of the numbers makes neighbours fit
            low = sorted(layer * 2 * SIDES + n for n in corner)
            high = [n + 2 * SIDES for n in low]
            tets += [(*low, high[2]), (low[0], low[1], high[1], high[2]), (low[0], *high)]

Path("tube.txt").write_text(shape_text(np.array(points), np.array(tets)))
