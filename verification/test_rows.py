"""What is told of blocks does not depend on how often rows are written."""

from pathlib import Path

import numpy as np
import pytest

import shared_runs
from micstools.reading import block_numbers, places
from micstools.reading.reader import Run

CUBES = """&run t_end = {t_end}  dt = 0.01  physics = 'dry'  output = '{name}'
 history_interval = {rows}  stop_when_settled = {stop} /
&grid cells = 8, 8, 8  length = 8, 8, 8 /
&contact contact_time = 0.02 /
&shape name = 'c'  kind = 'cube'  size = 2  density = 2300 /
&body shape = 'c'  position = 2, 2, 1.5  axis = 1, 1, 0  angle_deg = 10 /
&body shape = 'c'  position = 5, 2, 2.5 /
&body shape = 'c'  position = 5, 5, 4.0 /
"""
T_END = 1.72
"""Two cubes lie by then; the last has been still for less than rest_time [s]."""


def told(work: Path, name: str, rows: float, t_end: float = T_END, stop: str = "F") -> Run:
    """The results of a run, gone on with once at its middle."""
    for end, more in ((t_end / 2, ()), (t_end, ("--restart", f"{name}/restart-a.h5"))):
        case = CUBES.format(t_end=end, name=name, rows=rows, stop=stop)
        assert shared_runs.told(work, case, *more)[0] == 0
    return Run(work / name)


def test_any_interval_of_rows_tells_the_same(tmp_path: Path) -> None:
    """Of a slow landing on an edge and two falls: rows each step, each .1 s, each second, at the
    ends. The fall of 3 m ends with sqrt(2 g 3 m)."""
    runs = [told(tmp_path, f"r{k}", rows) for k, rows in enumerate((0, 0.1, 1, 20))]
    every = [block_numbers.of_blocks(run) for run in runs]
    for found in every[1:]:
        for one, same in zip(found, every[0], strict=True):
            assert one.contact_force == same.contact_force > 1e5
            assert one.impact_speed == same.impact_speed > 1
            assert np.array_equal(one.at_rest, same.at_rest, equal_nan=True)
    last = every[0][2]
    assert last.impact_speed == pytest.approx(np.sqrt(2 * 9.81 * 3.0), rel=0.02)
    mean = [np.linalg.norm(run.bodies.contact_force[:, 2], axis=1).max() for run in runs]
    assert mean[0] == last.contact_force and mean[-1] < 0.5 * mean[0]
    assert [p.at_rest for p in places.places(runs[-1])] == [1, 1, 0]


def test_what_settled_is_at_rest(tmp_path: Path) -> None:
    """Units of 2 m, in a run that ends `rest_time` after the last of them came to rest."""
    run = told(tmp_path, "settled", 0.1, t_end=20, stop="T")
    assert run.bodies.time[-1] < 5
    assert [p.at_rest for p in places.places(run)] == [1, 1, 1]
