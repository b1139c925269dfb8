"""What happened to each free block of a run: when it came and lay still, how hard it was struck."""

from dataclasses import dataclass

import numpy as np

from micstools.reading import rest
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, attitude_change_deg

SETTLED = 0.05  # change of a terminal speed
LEAST = 10  # rows of a fall that tell of it


@dataclass(frozen=True)
class BlockNumbers:
    """One block; nan where something did not happen, or too few rows tell of a fall."""

    block: int  # number, from 1
    released: float  # [s]
    at_rest: float  # after which it stays where it ends [s]
    fall_time: float  # from its release to the first row in which it touches something [s]
    fastest: float  # its largest speed until then [m/s]
    terminal: float  # its speed down once that has settled, see `terminal_speed` [m/s]
    drift: float  # its way until then, seen from above [m]
    impact_speed: (
        float  # before its first touch, the largest over an eighth to a quarter of its length
    )
    contact_force: float  # the largest since it came, a mean over a step [N]
    peak_force: float  # the largest within a step: an impact's impulse over contact_time [N]
    fluid_force: float  # the largest, buoyancy included [N]
    weight: float  # [N]
    turned: float  # from its attitude at the release to that at the end [degrees]
    place: tuple[float, float, float]  # of its centroid at the end [m]


def of_blocks(run: Run) -> list[BlockNumbers]:
    """The numbers of every free block that was released, in the order of their release."""
    released = run.bodies.released(-1)
    return [_of_block(run, int(k)) for k in run.bodies.dropped if released[k]]


def _of_block(run: Run, k: int) -> BlockNumbers:
    b = run.bodies
    came, start = np.searchsorted(b.time, np.array([b.entry_time[k], b.release_time[k]]) - 1e-12)
    x, y, z = (float(v) for v in b.position[-1, k])
    touched = np.flatnonzero(b.contacts[start:, k] > 0)
    end = start + touched[0] if touched.size else len(b.time) - 1
    way = b.position[end, k, :2] - b.position[start, k, :2]
    length, falling = run.shapes[b.shape[k]].length, slice(start, end + 1)
    time, fastest, terminal, drift = (float(v) if end - start >= LEAST else np.nan for v in (
        b.time[end] - b.release_time[k] if touched.size else np.nan,
        _largest(b.velocity[falling, k]),
        terminal_speed(b.time[falling], b.position[falling, k, 2], length),
        np.linalg.norm(way)))  # fmt: skip
    return BlockNumbers(
        block=k + 1,
        released=float(b.release_time[k]),
        at_rest=rest.of_block(run, k).time,
        fall_time=time,
        fastest=fastest,
        terminal=terminal,
        drift=drift,
        impact_speed=float(b.impact_speed[k]),
        contact_force=_largest(b.contact_force_max[came:, k, None]),
        peak_force=_largest(b.contact_force_peak[came:, k, None]),
        fluid_force=_largest(b.fluid_force[came:, k]),
        weight=float(b.mass[k] * np.linalg.norm(run.gravity)),
        turned=float(attitude_change_deg(b.quaternion[-1, k], b.quaternion[start, k])),
        place=(x, y, z),
    )


def terminal_speed(time: Array, height: Array, length: float) -> float:
    """Mean speed down [m/s] from the middle of a fall to a length of the block above its end; nan
    where it differs by more than SETTLED between the halves of that stretch."""
    marks = np.linspace((height[0] + height[-1]) / 2, height[-1] + length, 3)
    passed = np.interp(-marks, -np.minimum.accumulate(height), time)
    if not (marks[0] > marks[2] and (np.diff(passed) > 0).all()):
        return float("nan")
    first, second = (marks[0] - marks[1]) / np.diff(passed)
    if abs(first - second) > SETTLED * first:
        return float("nan")
    return float((marks[0] - marks[2]) / (passed[2] - passed[0]))


def _largest(vectors: np.ndarray) -> float:
    """The largest of vectors (T, 3); nan where none is known."""
    size = np.linalg.norm(vectors, axis=1)
    return float(np.nanmax(size)) if np.isfinite(size).any() else float("nan")
