"""When blocks come to rest: by the program's own rule, that of `stop_when_settled`, which depends
neither on how often rows are written nor on where a run ends."""

from dataclasses import dataclass

import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import attitude_change_deg


@dataclass(frozen=True)
class Rest:
    """Whether and since when one block rests."""

    block: int  # number, from 1
    time: float  # since when it was slower than `rest_speed` to the end [s]; nan: it still moves
    moved: float  # way of its points from the last row `span` before the end [m]
    span: float  # for so long a block must be slow to be at rest, `rest_time` [s]


def of_block(run: Run, k: int) -> Rest:
    """Of block `k`, from 0."""
    b = run.bodies
    span, since, end = float(run.value("run", "rest_time")), float(b.rest_since[k]), b.time[-1]
    rests = since >= 0 and end - since >= span - 1e-9
    row = max(int(np.searchsorted(b.time, end - span + 1e-9, side="right")) - 1, 0)
    way = float(np.linalg.norm(b.position[row, k] - b.position[-1, k]))
    turn = np.radians(attitude_change_deg(b.quaternion[row, k], b.quaternion[-1, k]))
    moved = way + float(turn) * run.shapes[b.shape[k]].radius
    return Rest(k + 1, since if rests else float("nan"), moved, span)


def of_blocks(run: Run) -> list[Rest]:
    """Of every free block that was released and is in the tank, in the order of release."""
    b = run.bodies
    present = b.present(-1)
    return [of_block(run, int(k)) for k in b.dropped if present[k]]
