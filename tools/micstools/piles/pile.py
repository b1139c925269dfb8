"""What can be said of any pile, and the paper's words on its figures 5 to 7, checked on a run.

Every finding is seen or not seen, with the figures behind it, in which blocks are counted from 1.
Geometry is that of the true shapes; a contact counts where the gap is within the reach of `scales`.
"""

from dataclasses import dataclass

import numpy as np

from micstools.reading import health, kicks, rest, units
from micstools.reading.overlap import find_contacts, overlap, present_bodies
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import Unit, figure
from micstools.shapes.geometry import attitude_change_deg, below_plane

TURN_LIMIT = 5.0  # [degrees]
LEVEL_BAND = 0.01  # share of the rise
PICTURES = 16  # of one view, where no times are asked for


@dataclass(frozen=True)
class Finding:
    """One statement, whether the run shows it, and the figures."""

    statement: str
    seen: bool | None  # None: not known
    figures: str


@dataclass(frozen=True)
class Level:
    """Rise of the water against the rise that the submerged volume demands [m]."""

    start: float
    found: float
    demanded: float

    @property
    def error(self) -> float:
        """Relative error of the rise."""
        return (self.found - self.start) / (self.demanded - self.start) - 1

    def shows(self, run: Run) -> bool:
        """Is there a rise to speak of, a hundredth of a cell at least?"""
        return bool(abs(self.demanded - self.start) >= 0.01 * run.grid.spacing[2])


def findings(run: Run, paper: bool | None = None) -> list[Finding]:
    """Everything that can be said about the run so far; with what the `paper` says of its pile if
    the tank is the paper's, or as given."""
    if not run.bodies.n:
        raise BadRun(f"{run.folder} holds no blocks: there is no pile to look at")
    found = [at_rest(run), depth(run)]
    if is_papers_tank(run) if paper is None else paper:
        found = [turning(run), *first_block(run), walls(run), found[0], pattern(run), found[1]]
    if kick := kicks.largest(run):
        found.append(untouched(kick))
    if has_level(run) and (rise := water_level(run)).shows(run):
        found.append(level(rise, units.of_run(run).length))
    return found


def is_papers_tank(run: Run) -> bool:
    """Do blocks drop on the paper's three fixed ones in water that was written?"""
    return bool(run.field_times.size and has_papers_blocks(run))


def has_papers_blocks(run: Run) -> bool:
    """Do blocks of 60 mm drop on three fixed ones in a tank of 0.3 x 0.1 x 0.2 m, so that their
    piles have the paper's patterns?"""
    b, size = run.bodies, run.grid.high - run.grid.low
    lengths = [np.ptp(run.shapes[name].points, axis=0) for name in set(b.shape)]
    return bool(
        np.allclose(size, (0.3, 0.1, 0.2))
        and b.fixed.sum() == 3
        and b.dropped.size
        and np.allclose(lengths, 0.06)
    )


def has_level(run: Run) -> bool:
    """Is the level known from the fields, and from the blocks?"""
    return bool(run.field_times.size and level_follows(run))


def level_follows(run: Run) -> bool:
    """Does the level follow from the blocks alone: still water, in a box, that cannot leave?"""
    ways_out = {"inflow", "outflow", "open"} & {k for s, k in run.sides.items() if s != "z_max"}
    wet = run.physics in ("coupled", "light")
    known = run.value("fluid", "water_level") is not None and not run.parameters.get("water")
    return bool(wet and known and not ways_out and not len(run.bed[1]))


def _named(blocks: list[int]) -> list[int]:
    """Numbers of blocks as a person reads them, from 1."""
    return [k + 1 for k in blocks]


def telling_times(run: Run) -> list[float]:
    """Times [s] worth a picture, at most PICTURES: the first block on its way down (figure 5),
    shortly before each further drop (figure 6), of many drops evenly, and the end."""
    b = run.bodies
    released = np.sort(b.release_time[b.dropped])
    released = released[released <= b.time[-1]]
    if not released.size:
        return [float(t) for t in np.linspace(b.time[0], b.time[-1], 5)]
    drawn = run.field_times if run.field_times.size else b.time
    before = [drawn[drawn < t - 1e-9].max(initial=drawn[0]) for t in released[1:]]
    first = released[0] + np.array([0.0, 0.1, 0.2, 0.3, 0.5])
    some = np.linspace(0, len(before), min(len(before), PICTURES - 6), endpoint=False).astype(int)
    wanted = np.concatenate([first, np.array(before)[some], drawn[-1:]])
    nearest = [drawn[np.abs(drawn - t).argmin()] for t in wanted]
    return [float(t) for t in np.unique(nearest)]


def turning_before_touch(run: Run) -> dict[int, float]:
    """Largest turn [degrees] of each dropped block between its release and its first touch."""
    b = run.bodies
    turns = {}
    for k in b.dropped:
        after = np.flatnonzero(b.time >= b.release_time[k] - 1e-12)
        touched = np.flatnonzero(b.contacts[after, k] > 0)
        free = after[: touched[0]] if touched.size else after
        if free.size:
            q = b.quaternion[free, k]
            turns[int(k)] = float(attitude_change_deg(q, q[0]).max())
    return turns


def turning(run: Run) -> Finding:
    """The paper on figure 5: no change of attitude is seen while a block falls."""
    turns = turning_before_touch(run)
    worst = max(turns.values(), default=np.nan)
    figures = ", ".join(f"block {k + 1}: {turn:.2f}" for k, turn in turns.items())
    statement = f"attitude changes less than {TURN_LIMIT:g} degrees before the first touch"
    return Finding(statement, bool(worst < TURN_LIMIT), f"degrees, {figures}")


def first_block(run: Run) -> list[Finding]:
    """The paper on figure 5: the block stops in touch with the fixed blocks and a wall."""
    b = run.bodies
    if b.dropped.size == 0:
        return []
    first = int(b.dropped[0])
    rows = {"at the end": len(b.time) - 1}
    if b.dropped.size > 1 and b.time[0] < b.release_time[b.dropped[1]] <= b.time[-1]:
        before = int(np.flatnonzero(b.time < b.release_time[b.dropped[1]])[-1])
        rows = {"before the second is dropped": before, **rows}
    found = []
    for when, row in rows.items():
        seen = find_contacts(run, row)
        on_fixed = [k for k in seen.of(first) if b.fixed[k]]
        sides = [side for side in seen.walls_of(first) if not side.startswith("z")]
        speed = float(np.linalg.norm(b.velocity[row, first]))
        found.append(
            Finding(
                f"the first block lies on fixed blocks and a wall {when}",
                bool(on_fixed) and bool(sides),
                f"t = {b.time[row]:.3f} s: fixed blocks {_named(on_fixed)}, walls {sides}, "
                f"speed {figure(speed)} m/s",
            )
        )
    return found


def walls(run: Run) -> Finding:
    """The paper on figure 7: the blocks pile up in touch with the front and the back wall."""
    seen = find_contacts(run, len(run.bodies.time) - 1)
    by_side = {s: [k for k, side in seen.walls if side == s] for s in ("y_min", "y_max")}
    figures = ", ".join(f"{side}: blocks {_named(blocks)}" for side, blocks in by_side.items())
    statement = "blocks of the final pile touch the front and the back wall"
    return Finding(statement, all(by_side.values()), figures)


def at_rest(run: Run) -> Finding:
    """The blocks come to rest."""
    b, length = run.bodies, units.of_run(run).length
    found = rest.of_blocks(run)
    waiting, out = int(b.to_come(-1).sum()), int((b.status == 4).sum())
    worst = max(found, key=lambda one: one.moved, default=None)
    figures = "no free block"
    statement = "all blocks at rest in the end"
    if worst:
        figures = f"block {worst.block} moved most, by {length.text(worst.moved)} in "
        figures += f"{figure(worst.span)} s"
        last = [one.time for one in found]
        if not np.isnan(last).any() and not waiting:
            figures += f"; all at rest from t = {figure(max(last))} s on"
        speed = figure(1e3 * float(run.value("run", "rest_speed")))
        statement += f" (slower than {speed} mm/s for {figure(worst.span)} s)"
    if waiting:
        figures += f", {waiting} blocks not released yet"
    if out:
        figures += f", {out} out of the tank"
    return Finding(statement, not waiting and all(one.time == one.time for one in found), figures)


def classify(run: Run, row: int = -1) -> tuple[str, list[int]]:
    """Pattern of the pile, and the dropped blocks that touch the floor.

    'A': every dropped block lies above the floor, on the fixed ones; 'B': one of them came down
    to the floor, which then carries four; 'other': more than one, or not all are released.
    """
    b = run.bodies
    row = row % len(b.time)
    seen = find_contacts(run, row)
    low = [int(k) for k in b.dropped if seen.on_floor(int(k))]
    if not b.present(row).all() or len(low) > 1:
        return "other", low
    return ("B" if low else "A"), low


def pattern(run: Run) -> Finding:
    """The paper on figure 6 (e): all dropped blocks lie on the three of the floor, pattern A."""
    kind, low = classify(run)
    statement = "all dropped blocks lie on the fixed ones (pattern A)"
    b = run.bodies
    released = int(b.released(-1)[b.dropped].sum())
    figures = f"pattern {kind}; dropped blocks on the floor: {_named(low)}"
    return Finding(statement, kind == "A", f"{figures}; {released} of {b.dropped.size} released")


def depth(run: Run) -> Finding:
    """True overlap of the final pile."""
    found, limit, length = overlap(run), health.overlap_limit(run), units.of_run(run).length
    where = health.deepest(found) or "none"
    pairs = len(found.blocks) + len(found.walls)
    figures = f"largest {length.text(found.largest)} ({where}), {pairs} overlapping pairs"
    statement = f"true overlap of the pile below {length.text(limit)}"
    return Finding(statement, found.largest < limit, figures)


def submerged_volume(run: Run, row: int, level: float) -> float:
    """Volume [m3] of the released bodies below the height `level` [m]."""
    bodies = present_bodies(run, row)
    return sum(below_plane(body.tets, level)[0] for body in bodies.values())


def demanded_level(run: Run, row: int) -> float:
    """Height [m] at which the liquid of the start stands around the bodies of a row."""
    size = run.grid.high - run.grid.low
    area, floor = float(size[0] * size[1]), float(run.grid.low[2])
    start = run.value("fluid", "water_level")
    start = floor if start is None else float(start)
    placed_by_case = len(run.parameters.get("body", []))  # the dropped ones raise the level
    at_start = {k: body for k, body in present_bodies(run, 0).items() if k < placed_by_case}
    inside = sum(below_plane(body.tets, start)[0] for body in at_start.values())
    liquid = area * (start - floor) - inside
    level = start
    for _ in range(200):  # converges because the blocks cross only a part of the surface
        before, level = level, floor + (liquid + submerged_volume(run, row, level)) / area
        if abs(level - before) < 1e-12:
            break
    return level


def still_level(run: Run) -> float | None:
    """Level [m] of the water when it has come to rest around the blocks of the last row; that of
    the start where it does not follow from the blocks."""
    wet = run.physics != "dry"
    level = run.value("fluid", "water_level")
    if not wet or level is None or bool(run.value("fluid", "single_phase")):
        return None
    if not level_follows(run):
        return float(level)
    return demanded_level(run, len(run.bodies.time) - 1)


def water_level(run: Run) -> Level:
    """Level at the last written field."""
    t = float(run.field_times[-1])
    demanded = demanded_level(run, run.bodies.row(t))
    start = float(run.value("fluid", "water_level"))
    # The mean height over all columns of cells: blocks through the surface count as the liquid
    # around them, which `liquid` continues in them, so waves of any length cancel. Only cells
    # within five of the level demanded are summed: no bubbles under blocks, no drops on walls
    fields, grid = run.fields_at(t), run.grid
    step = float(grid.spacing[2])
    middle = int((demanded - grid.low[2]) / step)
    low, high = max(0, middle - 5), min(len(grid.z) - 1, middle + 6)
    columns = fields.liquid[low:high].sum(axis=0, dtype=np.float64)
    return Level(start, float(grid.z[low] + step * columns.mean()), demanded)


def level(found: Level, length: Unit) -> Finding:
    """Final level against the rise that the submerged volume demands."""
    figures = (
        f"level {length.text(found.found, 6)}, demanded {length.text(found.demanded, 6)}, "
        f"rise off by {100 * found.error:.2f} %"
    )
    statement = f"final level within {100 * LEVEL_BAND:g} % of the rise the blocks demand"
    return Finding(statement, abs(found.error) < LEVEL_BAND, figures)


def untouched(kick: kicks.Largest) -> Finding:
    """No block that touches nothing is kicked by the water."""
    statement = f"untouched blocks under water accelerate less than {kicks.LIMIT:g} g"
    return Finding(statement, kick.good, f"{kick} (mean of {kick.window:.2g} s)")


def report(found: list[Finding]) -> str:
    """The findings as lines of text, in ASCII."""
    marks = {True: "yes", False: "no", None: "?"}
    lines = [f"{marks[f.seen]:3}  {f.statement}\n     {f.figures}" for f in found]
    return units.ascii_of("\n".join(lines))
