"""What a hand-over needs to be told: the survey, the tolerance, the layer.

It is kept beside the results, in handover.json, so that every command and page tells the same of a
run, whichever was given it. It is no part of the case, for it changes nothing that is computed and
may be known later only.
"""

import json
from argparse import Namespace
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np

from micstools import files
from micstools.piles.layer import Corners
from micstools.reading.places import Survey
from micstools.reading.reader import BadRun, Run

FILE = "handover.json"


@dataclass(frozen=True)
class Options:
    """None: what is usual."""

    origin: list[float] | None = None  # easting, northing, level of 0, 0, 0 of the case [m]
    north: float | None = None  # from +y towards +x [degrees]
    crs: str | None = None  # as EPSG:25832
    tolerance: float | None = None  # of the deviation [m]
    layers: int | None = None
    area: list[float] | None = None  # x0, y0, x1, y1 [m] of the layer, or where blocks should lie
    section: list[float] | None = None  # likewise: from x0, y0 to x1, y1 [m]

    @property
    def survey(self) -> Survey:
        """Where the tank lies."""
        x, y, z = self.origin or (0.0, 0.0, 0.0)
        return Survey((x, y, z), self.north or 0.0, self.crs)

    def corners(self, run: Run) -> Corners | None:
        """The area, which must lie in the tank of a run."""
        if self.area is None:
            return None
        x0, y0, x1, y1 = self.area
        low, high = run.grid.low[:2], run.grid.high[:2]
        if (np.array([x0, y0]) < low).any() or (np.array([x1, y1]) > high).any():
            raise BadRun(f"--area {' '.join(f'{v:g}' for v in self.area)}: the tank reaches from "
                         f"{low.tolist()} to {high.tolist()} m")  # fmt: skip
        return (x0, y0), (x1, y1)


def told(folder: Path, words: Namespace | None = None) -> Options:
    """Those of a user's words; what they leave open as it was told before of these results."""
    path = folder / FILE
    try:
        before = Options(**json.loads(path.read_text())) if path.is_file() else Options()
    except (ValueError, TypeError) as error:
        raise BadRun(f"{path}: holds no options ({error})") from error
    now = {field.name: getattr(words, field.name, None) for field in fields(Options)}
    return replace(before, **{name: value for name, value in now.items() if value is not None})


def keep(found: Options, folder: Path) -> None:
    """For the next command; usual ones need no file."""
    known = {name: value for name, value in asdict(found).items() if value is not None}
    path, text = folder / FILE, json.dumps(known, indent=2) + "\n"
    if known and not (path.is_file() and path.read_text() == text):  # it may be on a read-only disk
        files.write(path, text)
