"""Numbers recomputed from the double-precision state of a restart file.

Nothing here trusts what the program reports of itself: divergence comes from the face data,
liquid from the cells.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from micstools.reading.overlap import WALL_KINDS
from micstools.reading.reader import Grid, Run
from micstools.shapes.geometry import Array

State = dict[str, Any]


def faces(state: State, name: str, grid: Grid, periodic: tuple[bool, ...]) -> list[Array]:
    """A face quantity as three arrays (z, y, x), one cell longer in their own direction.

    In the file element (d, k, j, i) is the lower face of cell (i, j, k) in direction d. In a
    periodic direction the last face is the first one again.
    """
    stored = np.asarray(state[name])
    shape = [len(f) - 1 for f in reversed(grid.faces)]
    found = []
    for d in range(3):
        axis, values = 2 - d, stored[d]
        own = tuple(slice(0, n + (a == axis and not periodic[d])) for a, n in enumerate(shape))
        values = values[own]
        if periodic[d]:
            values = np.concatenate([values, np.take(values, [0], axis=axis)], axis=axis)
        found.append(values)
    return found


def excess(run: Run, state: State) -> Array:
    """Fluid that each cell holds beyond its open volume, of the cell volume (nz, ny, nx)."""
    volume = np.asarray(state["flow/fluid_volume"]).squeeze() / run.grid.spacing.prod()
    return np.asarray(volume - (1.0 - np.asarray(state["flow/alpha"]).squeeze()))


def divergence(run: Run, state: State) -> Array:
    """Net outflow of fluid and solid of each cell per cell volume (nz, ny, nx) [1/s], zero in
    cells that have no open face but walls of the tank and so no fluid that moves."""
    return _divergence(run, state)[0]


def uneven_divergence(run: Run, state: State) -> Array:
    """The same, in a closed tank less its mean over the cells with fluid that moves: what a block
    presses into a wall all cells share, as the program has it (`uneven` of
    src/pressure/pressure.f90)."""
    found, moves = _divergence(run, state)
    if all(kind in {*WALL_KINDS, "periodic"} for kind in run.sides.values()):
        found[moves] -= found[moves].mean()
    return found


def _divergence(run: Run, state: State) -> tuple[Array, NDArray[np.bool_]]:
    """The divergence, and which cells hold fluid that moves."""
    h = run.grid.spacing
    walls = {
        (d, end): run.sides[f"{axis}_{('min', 'max')[end]}"] in WALL_KINDS
        for d, axis in enumerate("xyz")
        for end in (0, 1)
    }
    data = [
        faces(state, f"flow/{name}", run.grid, run.periodic)
        for name in ("aperture", "uf", "solid_flux")
    ]
    outflow = np.zeros([len(f) - 1 for f in reversed(run.grid.faces)])
    openness = np.zeros_like(outflow)
    for d, (share, velocity, solid) in enumerate(zip(*data, strict=True)):
        area, axis = h.prod() / h[d], 2 - d
        outflow += np.diff(share * area * velocity + solid, axis=axis)
        for end in (0, 1):
            beyond = np.moveaxis(share, axis, 0)
            if walls[d, end]:
                beyond = beyond.copy()
                beyond[-end] = 0.0
            n = len(beyond) - 1
            openness += np.moveaxis(beyond[end : end + n], 0, axis)
    moves = openness > 0
    return np.where(moves, outflow / h.prod(), 0.0), moves


def liquid_between(run: Run, state: State, axis: int, low: float, high: float) -> float:
    """Volume of liquid [m3] in the cells whose centres lie between two coordinates [m]."""
    here = (run.grid.centres[axis] > low) & (run.grid.centres[axis] < high)
    liquid = np.asarray(state["flow/liquid"])
    cells = np.compress(here, liquid.reshape(liquid.shape[-3:]), axis=2 - axis)
    return float(cells.sum(dtype=np.longdouble))
