"""When blocks come to rest, by their places: velocities of resting blocks have a noise of some
mm/s, while their places move by micrometres."""

from dataclasses import dataclass

import numpy as np

from micstools.reading.reader import Run
from micstools.reading.scales import fall_time
from micstools.shapes.geometry import Array, attitude_change_deg

WAY = 5e-3
"""A block that moves by less than this part of its length stays."""
_STAY = 4.0  # for so long it must stay at least [sqrt(D/g)], D the length of the block


@dataclass(frozen=True)
class Rest:
    """Whether and when one block came to rest."""

    block: int  # number, from 1
    time: float  # after which it stays where it ends [s]; nan: it still moves
    moved: (
        float  # largest distance of its place in the `span` before the end from that of the end [m]
    )
    span: float  # for so long a block must stay to be at rest [s]
    limit: float  # of `moved` [m]


def of_block(run: Run, k: int) -> Rest:
    """Of block `k`, from 0. It is at rest from the first row after which none of its points is
    farther than `WAY` of its length from where it ends, if that lasts to the end of the run for
    4 sqrt(D/g) or more."""
    b = run.bodies
    length = run.shapes[b.shape[k]].length
    limit, span = WAY * length, _STAY * fall_time(run, length)
    start = int(np.searchsorted(b.time, b.release_time[k] - 1e-12))
    if not np.isfinite(span):  # no weight: what the case calls rest
        span = float(run.value("run", "rest_time"))
    if start >= b.time.size:
        return Rest(k + 1, float("nan"), float("nan"), span, limit)
    time, away = b.time[start:], _away(run, k, start)
    late = time >= time[-1] - span
    far = np.flatnonzero(away > limit)
    since = float(time[far[-1] + 1] if far.size else time[0])  # the last row is never far
    stays = time[-1] - since >= span * (1 - 1e-9)
    return Rest(k + 1, since if stays else float("nan"), float(away[late].max()), span, limit)


def of_blocks(run: Run) -> list[Rest]:
    """Of every free block that was released, in the order of release."""
    b = run.bodies
    present = b.present(-1)
    return [of_block(run, int(k)) for k in b.dropped if present[k]]


def _away(run: Run, k: int, start: int) -> Array:
    """Bound of the distance of all points of a block from where they are in the last row, in each
    row from `start` on [m]."""
    b = run.bodies
    way = np.linalg.norm(b.position[start:, k] - b.position[-1, k], axis=1)
    turn = np.radians(attitude_change_deg(b.quaternion[start:, k], b.quaternion[-1, k]))
    return np.asarray(way + turn * run.shapes[b.shape[k]].radius)
