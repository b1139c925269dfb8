"""Fluid beyond the open volume of cells when blocks land, in rows, restart file and frames."""

import numpy as np

from measures.balance import excess
from measures.checks import Checks
from micstools.reading.health import EXCESS_LIMIT
from micstools.reading.reader import Fields, Run

LEVEL_BAND = 1e-3  # of the rise
FRAME_BAND = 1e-6  # of the volume of the liquid


def squeezed(run: Run, frame: Fields) -> float:
    """Share by which the fluid of a closed tank must be more than its room: what overlaps of blocks
    with one another and with the floor leave open; none in a tank with an open top."""
    if run.sides["z_max"] == "open":
        return 0.0
    bodies = run.bodies
    there = bodies.release_time < frame.time - 1e-9  # a drop that is due now is not there yet
    volume = np.array([run.shapes[name].volume for name in bodies.shape])
    tank = np.prod(run.grid.high - run.grid.low)
    room = (1.0 - frame.solid.astype(float)).mean() * tank
    return float((tank - volume[there].sum()) / room - 1.0)


def excess_of(run: Run, name: str, checks: Checks) -> None:
    """At all rows, with a lid at the rows of the frames, and in all cells of the restart file."""
    series = run.series
    times = run.field_times[1:]  # at 0 no drop is there
    frames = [run.fields_at(t) for t in times]
    share = np.array([squeezed(run, frame) for frame in frames])
    if run.sides["z_max"] == "open":
        checks.below(f"{name}: largest excess [V]", series.volume_excess_max.max(), EXCESS_LIMIT)
    else:
        rows = [run.bodies.row(t) for t in times]
        unlike = np.abs(series.volume_excess_max[rows] - np.abs(share)).max()
        checks.below(f"{name}: excess against that of overlaps [V]", unlike, EXCESS_LIMIT)
    state = run.restart()
    open_share = 1.0 - np.asarray(state["flow/alpha"]).squeeze()
    left = np.abs(excess(run, state) - share[-1] * open_share).max()
    checks.below(f"{name}: in the restart file [V]", left, EXCESS_LIMIT)
    volume = run.grid.spacing.prod()
    held = [(f.liquid.astype(float) * (1.0 - f.solid.astype(float))).sum() for f in frames]
    counted = np.interp(times, series.time, series.liquid_volume)
    off = np.array(held) * volume * (1.0 + share) / counted - 1.0
    checks.below(f"{name}: liquid of the frames / of the rows - 1", np.abs(off).max(), FRAME_BAND)


def check(runs: list[Run], checks: Checks) -> None:
    """Every run keeps its room; where all blocks are dropped the level tells their volume."""
    for run in runs:
        name = run.folder.name
        excess_of(run, name, checks)
        if name.startswith(("case", "flat")):
            # Height of the water with the blocks under it at the end, over that of the start
            length = run.grid.high - run.grid.low
            frame = run.fields_at(run.field_times[-1])
            solid = frame.solid.astype(float)
            height = (solid + (1.0 - solid) * frame.liquid).mean() * length[2]
            wanted = sum(run.shapes[shape].volume for shape in run.bodies.shape) / length[:2].prod()
            rise = height - run.value("fluid", "water_level")
            checks.close(f"{name}: rise of the level [m]", rise, wanted, LEVEL_BAND)
        curves = {name: (run.series.time, run.series.volume_excess_max)}
        checks.figure("largest excess of fluid in a cell", "t [s]", "V", curves)
