"""Beds as maps of heights and as an STL file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

SLOPE = np.tan(np.radians(20.0))


def heights(
    name: str,
    low: tuple[float, float],
    high: tuple[float, float],
    n: tuple[int, int],
    height: Callable[[float, float], float],
) -> None:
    """A map of n points over a rectangle."""
    x, y = (np.linspace(low[k], high[k], n[k]) for k in range(2))
    step = [(high[k] - low[k]) / (n[k] - 1) for k in range(2)]
    rows = [" ".join(f"{height(a, b):.17g}" for a in x) for b in y]
    head = f"{n[0]} {n[1]} {low[0]:.17g} {low[1]:.17g} {step[0]:.17g} {step[1]:.17g}"
    Path(name).write_text("\n".join(["# made by prepare.py", head, *rows, ""]))


def octahedra(name: str, centres: np.ndarray, radius: float) -> None:
    """Closed stones that float and hang over: octahedra turned at random, as one STL file."""
    rng = np.random.default_rng(3)
    lines = ["solid stones"]
    for centre in centres:
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.linalg.det(turn)
        for signs in np.array(np.meshgrid(*[[1, -1]] * 3)).reshape(3, -1).T:
            corners = centre + radius * (turn @ np.diag(signs)).T[:: int(np.prod(signs))]
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(f"{c:.17g}" for c in corner) for corner in corners]
            lines += ["endloop", "endfacet"]
    Path(name).write_text("\n".join([*lines, "endsolid stones", ""]))


rough = np.random.default_rng(1)
heights("slope.txt", (0.0, 0.0), (1.1, 0.3), (56, 16), lambda x, _: 0.45 - SLOPE * x)
heights("flat.txt", (-0.013, -0.02), (0.12, 0.13), (8, 6), lambda *_: 0.02)
heights("groove.txt", (0.0, 0.0), (0.1, 0.1), (21, 11), lambda x, _: 0.02 + abs(x - 0.05))
ends = (-0.01, -0.01), (0.11, 0.11)
heights("rough.txt", *ends, (25, 25), lambda *_: 0.015 + 0.012 * rough.random())
centres = [[0.025, 0.03, 0.02], [0.07, 0.03, 0.03], [0.03, 0.07, 0.05], [0.075, 0.072, 0.055]]
octahedra("stones.stl", np.array(centres), 0.019)
