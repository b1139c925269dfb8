"""Whether the numbers of a run can be trusted: each check with its figure, place and time, and what
to do where it is not as wanted. Every limit grows with the blocks, their weight and gravity."""

from dataclasses import dataclass

import numpy as np

from micstools.reading import energy, kicks, rest, scales
from micstools.reading.energy import ENERGY_LIMIT
from micstools.reading.overlap import Overlap, overlap
from micstools.reading.reader import Run
from micstools.reading.units import Units, figure

DRIFT = 1e-9
"""Of the liquid volume: what rounding explains."""
EXCESS_LIMIT = 1e-6
"""Of the volume of a cell: what the program lets a cell hold beyond its room."""
OVERLAP = 0.01
"""Of the smallest block's length, at the end of a run."""
OVERLAP_AT_ANY_TIME = 3 * OVERLAP
MADE = 3e-3
"""Energy of contact in a step, of the lightest block's weight times the smallest one's length."""
MADE_OF_MOTION = 0.01
"""The same, of the kinetic energy of the blocks: in a row a spring may be compressed by half of a
substep more than the blocks have slowed down, which is 0.6 % with 20 substeps in an impact."""
CELLS = 10.0
"""Along the smallest block, as the readme asks for."""
_ENDINGS = {
    0: ("regular", ""),
    3: ("numerics, or a drop without room", "the last messages of the program name the cause; "
        "mend it and go on with --restart"),
    4: ("files could not be written or read", "make room on the disk and go on with --restart"),
    130: ("stopped by a user", "go on with --restart"),
    143: ("stopped by a signal or a limit of time", "go on with --restart"),
    -1: ("still running, or killed", "wait for its end, or go on with --restart"),
}  # fmt: skip


@dataclass(frozen=True)
class Check:
    """One number of the computation."""

    name: str
    found: str  # with place and time
    wanted: str
    good: bool | None  # None: not known
    advice: str = ""  # what to do where it is not good
    share: float = float("nan")  # found over wanted: the worst of several runs has the largest

    @property
    def todo(self) -> str:
        """What to do; empty where nothing needs to be done."""
        return self.advice if self.good is False else ""


def checks(run: Run, units: Units) -> list[Check]:
    """All that are known of a run."""
    code = int(run.provenance.get("exit_status", -1))
    words, advice = _ENDINGS.get(code, ("unknown", "see the last messages of the program"))
    when = f"{words} (code {code}), t = {figure(float(run.series.time[-1]))} s"
    found = [Check("end of the run", when, "regular", code == 0, advice, float(code != 0))]
    if run.bodies.n:
        found += [*_rest(run, units), *_overlaps(run, units), _made(run, units)]
    if np.isfinite(run.series.liquid_volume_drift).any():
        found += [_drift(run), *_excess(run), _energy(run), _divergence(run)]
        if kick := kicks.largest(run):
            found.append(_kick(kick))
        if run.bodies.n:
            found.append(_cells(run, units))
    return found


def overlap_limit(run: Run) -> float:
    """What no overlap may exceed at the end of a run [m]."""
    return OVERLAP * scales.smallest(run)


def divergence_limit(run: Run) -> float:
    """What the case allows [1/s]."""
    return float(run.value("numerics", "divergence_tolerance"))


def deepest(found: Overlap) -> str:
    """The pair of the largest overlap in words; empty without one."""
    pairs = {f"blocks {i + 1} and {j + 1}": d for (i, j), d in found.blocks.items()}
    pairs |= {f"block {k + 1} in the wall {side}": d for (k, side), d in found.walls.items()}
    return max(pairs, key=lambda key: pairs[key], default="")


def _rest(run: Run, units: Units) -> list[Check]:
    """One check, where there are free blocks."""
    b = run.bodies
    waiting = [int(k) + 1 for k in b.dropped if b.to_come(-1)[k]]
    found = rest.of_blocks(run)
    if not found and not waiting:
        return []
    moving = [one for one in found if one.time != one.time]
    name, wanted = "blocks at rest at the end", "all"
    if not moving and not waiting:
        last = max(found, key=lambda one: one.time)
        said = f"all from t = {figure(last.time)} s on, block {last.block} last"
        return [Check(name, said, wanted, True, share=0.0)]
    words, advice = [], []
    if moving:
        most = max(moving, key=lambda one: one.moved)
        words.append(
            f"{_numbers([one.block for one in moving])} still moving: block {most.block} by "
            f"{units.length.text(most.moved)} in the last {figure(most.span)} s"
        )
        wanted = f"all, slower than {figure(1e3 * float(run.value('run', 'rest_speed')))} mm/s"
        advice.append("a larger t_end, with --restart")
    if waiting:
        words.append(f"{_numbers(waiting)} not let go by t = {figure(float(b.time[-1]))} s")
        advice.append("a larger t_end, and room where blocks are dropped")
    return [Check(name, "; ".join(words), wanted, False, "; ".join(advice),
                  float(len(moving) + len(waiting)))]  # fmt: skip


def _numbers(blocks: list[int], most: int = 6) -> str:
    """As in `blocks 4, 7`, the first of many."""
    words = ", ".join(map(str, blocks[:most])) + (", ..." if len(blocks) > most else "")
    return ("block " if len(blocks) == 1 else "blocks ") + words


def _overlaps(run: Run, units: Units) -> list[Check]:
    """Of the true shapes at the end, and of the largest at any time."""
    length, stiffer = scales.smallest(run), _stiffer(run)
    end = overlap(run)
    row = int(np.nanargmax(np.nan_to_num(run.series.max_overlap, nan=-1.0)))
    time, highest = float(run.series.time[row]), float(run.series.max_overlap[row])
    at_any_time = f"t = {figure(time)} s"
    if highest >= OVERLAP_AT_ANY_TIME * length:
        at_any_time += _before(", ", deepest(overlap(run, run.bodies.row(time))))
    rows = (
        ("overlap of the true shapes at the end", end.largest, OVERLAP, _before("", deepest(end))),
        ("largest overlap at any time", highest, OVERLAP_AT_ANY_TIME, at_any_time),
    )
    return [
        Check(
            name,
            f"{units.length.text(value)}, {figure(100 * value / length)} % of the smallest block's "
            f"length" + _before(", ", where if value > 0 else ""),
            f"below {figure(100 * limit)} %, {units.length.text(limit * length)}",
            value < limit * length,
            stiffer,
            value / (limit * length),
        )
        for name, value, limit, where in rows
    ]


def _before(joint: str, words: str) -> str:
    """Words after a joint, nothing without words."""
    return joint + words if words else ""


def _stiffer(run: Run) -> str:
    """What makes blocks sink less into each other."""
    if run.value("contact", "model") == "spheres":
        return "&contact model = 'surface': contact spheres leave edges and corners free"
    duration = float(run.value("contact", "contact_time"))
    return f"a shorter &contact contact_time, now {figure(duration)} s"


def _made(run: Run, units: Units) -> Check:
    # What contact may make in the step of each row (T) by rounding and by the length of its
    # substeps [J]; infinite where nothing has weight
    at_rest = MADE * scales.weight(run) * scales.smallest(run) or np.inf
    limits = np.full(run.bodies.time.size, at_rest)
    moving = run.series.kinetic_energy_bodies[: limits.size - 1]
    limits[1 : moving.size + 1] += MADE_OF_MOTION * np.nan_to_num(moving)
    made = energy.largest_made(run, limits)
    name = "largest energy that contact made in a step"
    wanted = f"below {units.energy.text(made.limit)}" if np.isfinite(made.limit) else "none"
    if made.reason:
        return Check(name, f"not known: {made.reason}", wanted, None)
    words = units.energy.text(made.energy)
    if made.energy > 0:
        words += f", t = {figure(made.time)} s, "
        words += f"block {made.block}" if made.block else "in the springs between blocks"
    step = "contact_time" if run.value("contact", "solver") == "impulses" else "substep_ratio"
    advice = f"a smaller &contact {step} or &run dt; see the block at that time in the player"
    return Check(name, words, wanted, made.energy < made.limit, advice, made.energy / made.limit)


def _largest(run: Run, name: str) -> tuple[float, float]:
    """Largest size of a column of /series after the start, and its time [s]."""
    values = np.nan_to_num(np.abs(getattr(run.series, name)))
    if values.size > 1:
        values[0] = 0.0
    row = int(values.argmax())
    return float(values[row]), float(run.series.time[row])


def _then(run: Run, time: float) -> str:
    """When, and where to look: the block that is struck hardest at that time, or moves fastest."""
    b, words = run.bodies, f"t = {figure(time)} s"
    if not b.n:
        return words
    row = b.row(time)
    blow = np.linalg.norm(b.contact_force[row], axis=1) / b.mass
    blow[b.fixed] = 0.0
    speed = np.linalg.norm(b.velocity[row], axis=1)
    if blow.max() > 2 * np.linalg.norm(run.gravity):
        return f"{words}, when block {int(blow.argmax()) + 1} strikes"
    if speed.max() > 0:
        return f"{words}, when block {int(speed.argmax()) + 1} is the fastest"
    return words


def _drift(run: Run) -> Check:
    worst, time = _largest(run, "liquid_volume_drift")
    tolerance = divergence_limit(run)
    advice = f"a smaller &numerics divergence_tolerance, now {tolerance:.0e} 1/s"
    return Check("drift of the liquid volume", _at(worst < DRIFT, f"{worst:.1e}", run, time),
                 f"below {DRIFT:.0e}", worst < DRIFT, advice, worst / DRIFT)  # fmt: skip


def _at(good: bool, words: str, run: Run, time: float) -> str:
    """A figure with its time, and with the place to look at where it is not good."""
    return f"{words}, t = {figure(time)} s" if good else f"{words}, {_then(run, time)}"


def _excess(run: Run) -> list[Check]:
    """Largest difference of the fluid of a cell from its open volume [V], where it is known."""
    if not np.isfinite(run.series.volume_excess_max).any():
        return []
    worst, time = _largest(run, "volume_excess_max")
    good = worst <= EXCESS_LIMIT
    advice = (
        "cells hold more or less fluid than fits beside the blocks, so the level of the water is "
        "not exact; in a closed tank overlaps of blocks do this: " + _stiffer(run)
        if run.bodies.n
        else "the level of the water is not exact: a smaller &run dt or cfl_max"
    )
    return [Check("largest excess of fluid in a cell, of its volume",
                  _at(good, f"{worst:.1e}", run, time), f"up to {EXCESS_LIMIT:.0e}", good, advice,
                  worst / EXCESS_LIMIT)]  # fmt: skip


def _energy(run: Run) -> Check:
    """Largest energy of fluid and blocks over what was put in."""
    name = "largest energy of fluid and blocks over what was put in, of what was set free"
    wanted = f"up to {100 * ENERGY_LIMIT:.0f} %"
    if not (excess := energy.largest_excess(run)):
        return Check(name, "not known", f"{wanted}; known where only weight does work", None)
    share = figure(100 * max(excess.share, 0.0), 2)
    words = _at(excess.good, f"{share} %", run, excess.time)
    advice = "the steps make energy: a smaller &run dt or cfl_max"
    return Check(name, words, wanted, excess.good, advice, excess.share / ENERGY_LIMIT)


def _divergence(run: Run) -> Check:
    worst, time = _largest(run, "divergence_max")
    limit, passes = divergence_limit(run), run.value("numerics", "max_pressure_passes")
    advice = f"a larger &numerics max_pressure_passes, now {passes}"
    return Check("largest divergence", _at(worst < limit, f"{worst:.1e} 1/s", run, time),
                 f"below {limit:.0e} 1/s", worst < limit, advice, worst / limit)  # fmt: skip


def _kick(kick: kicks.Largest) -> Check:
    wanted = f"below {kicks.LIMIT:g} g over {figure(kick.window, 2)} s"
    return Check("largest acceleration of an untouched block", kick.figures, wanted, kick.good,
                 kick.advice, kick.acceleration / kicks.LIMIT)  # fmt: skip


def _cells(run: Run, units: Units) -> Check:
    length, cell = scales.smallest(run), float(run.grid.spacing.max())
    name = min(set(run.bodies.shape), key=lambda one: run.shapes[one].length)
    found = f"{figure(length / cell)}, along a block '{name}' of {units.length.text(length)}"
    good = length / cell >= CELLS - 1e-9
    advice = f"cells of {units.length.text(length / CELLS)} for drag and speeds of fall"
    return Check("cells along the smallest block", found, f"{CELLS:.0f} or more", good, advice,
                 CELLS * cell / length)  # fmt: skip
