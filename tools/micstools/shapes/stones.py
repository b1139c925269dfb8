"""The roughness of an underlayer: a surface of half-sunk random stones on a map of heights.

Stones are ellipsoids with axes of 1.2, 1 and 1/1.2 of their size and any direction alike, their
middles on the map. Sizes are lognormal with the median D50 and D85/D15 = 1.5, a narrow grading of
EN 13383.
"""

from dataclasses import replace

import numpy as np

from micstools.shapes.geometry import Array, rotation_matrix
from micstools.shapes.height_maps import HeightMap

POINTS = 4
"""Of the map along D50, at least."""
PITCH = 0.8  # of the middles, over D50
_JITTER = 0.3  # of a middle, over the pitch
_GRADING = np.log(1.5) / 2.07  # standard deviation of ln D: 2.07 from D15 to D85
_AXES = np.array([1.2, 1.0, 1 / 1.2])


def lay(found: HeightMap, d50: float, seed: int) -> HeightMap:
    """The map under stones of the median size `d50` [m], drawn by a seed."""
    bed = _finer(found, d50 / POINTS)
    random = np.random.default_rng(seed)
    size = np.array(bed.last) - bed.first
    n = np.maximum(1, np.round(size / (PITCH * d50)).astype(int))
    row, column = (part.ravel() for part in np.mgrid[: n[1], : n[0]])
    at = np.stack([column, row], axis=1) + 0.5 + random.uniform(-_JITTER, _JITTER, (row.size, 2))
    middle = at * size / n
    axes = d50 / 2 * random.lognormal(0, _GRADING, row.size)[:, None] * _AXES
    turn = rotation_matrix(random.normal(size=(row.size, 4)))  # any attitude alike
    form = np.einsum("nik,nk,njk->nij", turn, axes**-2.0, turn)
    z = bed.z.copy()
    for place, q, reach in zip(middle, form, axes.max(axis=1), strict=True):
        _raise(z, bed, place, q, reach)
    z = np.round(z, round(3 - np.log10(d50)))
    said = f"{row.size} stones of D50 = {d50:g} m, which raise it by {(z - bed.z).mean():.3g} m"
    return replace(bed, z=z, remarks=(*found.remarks, said))


def _raise(z: Array, bed: HeightMap, place: Array, q: Array, reach: float) -> None:
    """Raise heights (ny, nx) to an ellipsoid p^T q p = 1 (3, 3) around a place (2) on the bed."""
    step = np.array(bed.spacing)
    first = np.maximum(0, np.ceil((place - reach) / step)).astype(int)
    last = np.minimum(z.shape[::-1], np.floor((place + reach) / step).astype(int) + 1)
    window = slice(first[1], last[1]), slice(first[0], last[0])
    x = np.arange(first[0], last[0]) * step[0] - place[0]
    y = np.arange(first[1], last[1])[:, None] * step[1] - place[1]
    b = q[0, 2] * x + q[1, 2] * y
    rest = b**2 - q[2, 2] * (q[0, 0] * x**2 + 2 * q[0, 1] * x * y + q[1, 1] * y**2 - 1)
    above = (np.sqrt(np.maximum(rest, 0)) - b) / q[2, 2]
    column, row = np.minimum((place / step).astype(int), np.array(z.shape[::-1]) - 1)
    top = np.where(rest > 0, bed.z[row, column] + above, -np.inf)
    z[window] = np.maximum(z[window], top)


def _finer(found: HeightMap, spacing: float) -> HeightMap:
    """The map on points at most so far apart [m], linear in between."""
    times = np.maximum(1, np.ceil(np.array(found.spacing) / spacing - 1e-9)).astype(int)
    z = found.z
    for axis, k in ((1, times[0]), (0, times[1])):
        at = np.arange((z.shape[axis] - 1) * k + 1) / k
        low = np.minimum(at.astype(int), z.shape[axis] - 2)
        share = (at - low) if axis == 1 else (at - low)[:, None]
        z = z.take(low, axis) * (1 - share) + z.take(low + 1, axis) * share
    dx, dy = (float(s / k) for s, k in zip(found.spacing, times, strict=True))
    return replace(found, spacing=(dx, dy), z=z)
