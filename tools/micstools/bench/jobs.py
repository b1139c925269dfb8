"""The jobs of the bench, run by the program."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from micstools.bench import dry_pile
from micstools.bench.timing import Timing, mpirun, timed
from micstools.cases import settings
from micstools.ensembles.ensemble import NO_ROOM
from micstools.reading.reader import Run

INPUT = Path(__file__).parents[3] / "input"
_NOT_STEPPING = ("output", "restart files")


@dataclass(frozen=True)
class DamBreak:
    """A column of water that collapses in a box with an open top, between walls that let slip."""

    cells: tuple[int, int, int] = (80, 20, 40)
    length: tuple[float, float, float] = (0.6, 0.15, 0.3)  # [m]
    column: tuple[float, float, float] = (0.15, 0.15, 0.2)  # [m]
    water: tuple[float, float] = (998.2, 1.0e-3)  # [kg/m3, Pa s]
    air: tuple[float, float] = (1.2, 1.8e-5)
    seconds: float = 0.3


DAM = DamBreak()


@dataclass(frozen=True)
class Job:
    """A case and how it is run."""

    name: str
    text: str
    threads: int = 1
    ranks: int = 1


def blocks(seconds: float, factor: int = 1) -> str:
    """The first seconds of the main job, on `factor` times its cells in each direction."""
    text = (INPUT / "blocks.nml").read_text()
    cells = [factor * n for n in settings.value(text, "grid", "cells")]
    text = settings.set_group(text, "grid", {"cells": cells})
    return settings.set_group(text, "run", {"t_end": seconds})


def whole(name: str) -> str:
    """A case of input/ as it is."""
    return (INPUT / f"{name}.nml").read_text()


def dam_break(dam: DamBreak = DAM) -> str:
    """The case of a dam break."""
    cells, length, column = (", ".join(map(repr, v)) for v in (dam.cells, dam.length, dam.column))
    text = Path(__file__).with_name("dam_break.nml").read_text()
    return text.format(dam=dam, cells=cells, length=length, column=column)


def run(job: Job, programs: Sequence[Path], folder: Path) -> Timing:
    """Run a job with the serial or, on several ranks, the parallel program of `programs`. A
    block that never found room is no fault here: the run came to its end."""
    path, output = folder / "case.nml", folder / "result"
    path.write_text(job.text)
    program = [*mpirun(job.ranks), programs[job.ranks > 1]]
    words = [*program, "--quiet", "--threads", job.threads, "--output", output, path]
    wall, cpu, memory = timed(words, folder, excused=NO_ROOM)
    found = Run(output)
    seconds = {k: v for k, (v, _) in found.timers.items() if k not in _NOT_STEPPING}
    stepping = sum(seconds.values())
    return Timing(
        wall=wall, cpu=cpu, memory=memory, stepping=stepping,
        simulated=float(found.series.time[-1]), steps=len(found.series.time) - 1,
        size=int(np.prod(settings.value(job.text, "grid", "cells"))),
        phases={k: v / stepping for k, v in seconds.items()},
    )  # fmt: skip


def pile(n: int, seconds: float, program: Path, threads: int, folder: Path, **case: Any) -> Timing:
    """Run the dry pile of n blocks; a step is one of contact, the size that of the pile."""
    path, output = folder / "pile.nml", folder / "result"
    path.write_text(dry_pile.case(n, output, seconds, **case))
    words = [program, "--quiet", "--threads", threads, path]
    wall, cpu, memory = timed(words, folder)
    return Timing(wall, cpu, memory, seconds, int(Run(output).series.substeps.sum()), n)
