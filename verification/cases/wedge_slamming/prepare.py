"""Write `wedge_NN.txt`: half a wedge of NN degrees deadrise, 0.15 wide, 0.02 long along y."""

from pathlib import Path

import numpy as np

WIDTH, LENGTH = 0.15, 0.02

for degrees in (20, 30, 40):
    height = WIDTH * np.tan(np.radians(degrees))
    section = [(0.0, 0.0), (WIDTH, height), (0.0, height)]
    points = [(x, y, z) for y in (0.0, LENGTH) for x, z in section]
    tets = [(1, 2, 3, 6), (1, 2, 6, 5), (1, 5, 6, 4)]
    lines = ["mics-shape 1", f"points {len(points)}"]
    lines += [" ".join(f"{x:.15g}" for x in p) for p in points]
    lines += [f"tets {len(tets)}", *(" ".join(str(n) for n in t) for t in tets)]
    Path(f"wedge_{degrees}.txt").write_text("\n".join(lines) + "\n")
