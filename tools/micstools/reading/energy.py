"""Energy that steps and contacts make, which they must not."""

from dataclasses import dataclass

import numpy as np

from micstools.reading.overlap import WALL_KINDS
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, turns

ENERGY_LIMIT = 0.01  # of the energy set free: more than was put in is to be looked at
_SAME = 1e-6  # relative, of a step and the distance of two rows


@dataclass(frozen=True)
class Excess:
    """Largest energy of fluid and blocks over what was put in, of what was set free."""

    share: float
    time: float  # s

    @property
    def good(self) -> bool:
        """Is it within what a step may be off?"""
        return self.share <= ENERGY_LIMIT

    def __str__(self) -> str:
        return f"{100 * max(self.share, 0.0):.2g} %, t = {self.time:.3g} s"


def largest_excess(run: Run) -> Excess | None:
    """None where the program does not know it: `energy_excess` of `/series` is NaN."""
    values = run.series.energy_excess
    if not np.isfinite(values).any():
        return None
    row = int(np.nanargmax(values))
    return Excess(float(values[row]), float(run.series.time[row]))


@dataclass(frozen=True)
class Made:
    """The energy that contact made in a step, where it is the most over its limit."""

    energy: float  # [J]; nan: not known
    limit: float  # of it in that step [J]
    time: float  # at the end of the step [s]
    block: int  # number, from 1, of the one that got most of it; 0: it is in springs
    reason: str  # why it is not known; empty where it is


def largest_made(run: Run, limit: Array) -> Made:
    """The energy that contact made in the step where that is the most over the `limit` of each row
    (T) [J]; known where each row is a step and no wall moves, which may give energy."""
    unknown = float("nan")
    # Does a side of the tank that blocks can touch move along itself?
    if any(
        np.any(run.value("boundary", f"{side}_velocity"))
        for side, kind in run.sides.items()
        if kind in WALL_KINDS
    ):
        reason = "a wall moves and gives energy by friction"
        return Made(unknown, float(limit.min()), unknown, 0, reason)
    gains = _gains(run)
    made = _made(run, gains)
    if not np.isfinite(made).all():
        reason = "needs a row every step: &run history_interval = 0"
        return Made(unknown, float(limit.min()), unknown, 0, reason)
    row = int((made / limit).argmax())
    gain = gains[row]
    block = int(gain.argmax()) + 1 if gain.max() > made[row] / 2 else 0
    return Made(float(made[row]), float(limit[row]), float(run.bodies.time[row]), block, "")


def made_by_contact(run: Run) -> Array:
    """Energy that contact gave to the blocks and to its springs in the step that ends at each row
    [J] (T); negative where contact takes energy, as it should; nan in a row of several steps."""
    return _made(run, _gains(run))


def _made(run: Run, gains: Array) -> Array:
    """The same from what each block got, `gains` (T, N) [J]."""
    s = run.series
    made, n = gains.sum(axis=1), min(len(gains), s.time.size)  # of a run that goes on
    made[1:n] += np.diff(np.nan_to_num(s.contact_energy[:n]))
    time = run.bodies.time
    single = np.ones(time.size, dtype=bool)  # rows that end one step after the row before
    dt = s.dt[1 : time.size]
    single[1 : dt.size + 1] = np.abs(np.diff(time)[: dt.size] - dt) <= _SAME * dt
    return np.where(single, made, np.nan)


def _gains(run: Run) -> Array:
    """What the mean contact force and torque of a step gave to each block [J] (T, N).

    Their work is that on the mean of the velocities before and after the step if contact is an
    impact in the middle of it, and that on the way of the block if it lasts for the step. Weight
    and water change the velocity, too, so the two differ in large steps; the smaller one counts,
    and energy that was made shows in both.
    """
    b = run.bodies
    found = np.zeros(b.contact_force.shape[:2])
    dt = np.diff(b.time)[:, None]
    for k in np.flatnonzero(np.any(b.contact_force, axis=(0, 2))):
        force, torque = b.contact_force[1:, k], b.contact_torque[1:, k]
        speed, spin = (dt * (v[1:, k] + v[:-1, k]) / 2 for v in (b.velocity, b.angular_velocity))
        way, turn = np.diff(b.position[:, k], axis=0), turns(b.quaternion[:, k])
        found[1:, k] = np.minimum(
            (force * speed + torque * spin).sum(axis=1), (force * way + torque * turn).sum(axis=1)
        )
    return found
