"""`stop_when_settled`: a run ends when nothing moves and no block is to come any more; what is told
of blocks does not depend on how often rows are written."""

from pathlib import Path

import h5py
import numpy as np
import pytest

import shared_runs
from micstools.reading import block_numbers, places
from micstools.reading.reader import Run
from shared_runs import mics

RELEASED = 0.2
"""When the second cube is due [s]."""
CASE = """&run t_end = 5  dt = 0.01  physics = 'dry'  stop_when_settled = {stop}  rest_time = 0.3 /
&grid cells = 4, 4, 4  length = 0.4, 0.4, 0.4 /
&shape name = 'c'  kind = 'cube'  size = 0.1  density = 2300 /
&drop shape = 'c'  position = 0.1, 0.2, 0.06  count = {count}  interval = 0.2 /
"""
LATER = "&drop shape = 'c'  position = 0.3, 0.2, 0.06  count = 1  first_time = 2 /\n"
ALL_AT_REST = "1 due block(s) never found room, and all others are at rest"


def run(work: Path, case: str) -> tuple[int, str, float]:
    """Exit code, messages and last time [s] of a run."""
    done = mics(work, case)
    with h5py.File(work / "mics-out" / "run.h5") as h5:
        told = int(np.ravel(h5["provenance"].attrs["exit_status"])[0])
        assert told == done.returncode
        return done.returncode, done.stderr, float(h5["series/time"][-1])


def test_ends_when_all_rest(tmp_path: Path) -> None:
    """A cube falls 1 cm: at rest well within a second."""
    code, said, end = run(tmp_path, CASE.format(stop="T", count=1))
    assert (code, said) == (0, "")
    assert 0.3 < end < 1.0


def test_ends_when_the_last_one_finds_no_room(tmp_path: Path) -> None:
    """The second cube's place is the first one's; nobody will ever make room."""
    code, said, end = run(tmp_path, CASE.format(stop="T", count=2))
    assert code == 3 and ALL_AT_REST in said, said
    assert RELEASED + 0.3 < end < 1.0


def test_waits_for_those_to_come(tmp_path: Path) -> None:
    """Beside a cube that waits in vain another is due at 2 s: the run sees it to the floor."""
    code, said, end = run(tmp_path, CASE.format(stop="T", count=2) + LATER)
    assert code == 3 and ALL_AT_REST in said, said
    assert 2.3 < end < 3.0


DOOR = """&shape name = 'd'  kind = 'box'  size = 0.2, 0.2, 0.02  density = 2300 /
&body shape = 'd'  fixed = .true.  motion = 'door.csv' /
&drop shape = 'c'  position = 0.12, 0.2, 0.2601  count = 1 /
"""


def test_waits_for_a_door_to_open(tmp_path: Path) -> None:
    """A cube rests on a shut door, which is drawn from under it after 2 s."""
    (tmp_path / "door.csv").write_text(
        "time,x,y,z\n0,0.12,0.2,0.2\n2,0.12,0.2,0.2\n2.1,0.3,0.2,0.2\n"
    )
    code, said, end = run(tmp_path, CASE.format(stop="T", count=1).split("&drop")[0] + DOOR)
    with h5py.File(tmp_path / "mics-out" / "run.h5") as h5:
        height = h5["bodies/position"][-1, 1, 2]
    assert (code, said) == (0, "")
    assert 2.4 <= end < 4.0 and height == pytest.approx(0.05, abs=1e-3)


def test_waits_while_a_fixed_body_moves(tmp_path: Path) -> None:
    """A plate that goes on at its given speed may still meet the cube that rests."""
    plate = (
        DOOR.split("&drop")[0].replace("motion = 'door.csv'", "{}")
        + "&drop"
        + DOOR.split("&drop")[1]
    )
    given = "position = 0.3, 0.3, 0.35  velocity = -0.01, 0, 0"
    text = CASE.format(stop="T", count=1).split("&drop")[0].replace("t_end = 5", "t_end = 2")
    code, said, end = run(tmp_path, text + plate.format(given).replace("0.2601", "0.06"))
    assert (code, said, end) == (0, "", 2.0)


SLOSHING = """&run t_end = 3  dt = 0.02  stop_when_settled = T /
&grid cells = 20, 4, 12  length = 0.4, 0.08, 0.24 /
&fluid water_level = 0.12  gravity = 0.8, 0.0, -9.8 /
&shape name = 'c'  kind = 'cube'  size = 0.06  density = 2300 /
&drop shape = 'c'  position = 0.2, 0.04, 0.0301  count = 1 /
"""


def test_settles_in_water_that_sloshes(tmp_path: Path) -> None:
    """A cube lies still on the floor. The pressure that changes within each step leaves it with up
    to 2 mm/s, twice `rest_speed`, which contact takes back in the next step: it is at rest."""
    code, said, end = run(tmp_path, SLOSHING)
    with h5py.File(tmp_path / "mics-out" / "run.h5") as h5:
        late = h5["bodies/time"][:] > 0.3
        speed = np.linalg.norm(h5["bodies/velocity"][late, 0], axis=1)
        way = np.ptp(h5["bodies/position"][late, 0], axis=0)
    assert (code, said) == (0, "")
    assert speed.max() > 1e-3 and way.max() < 1e-6
    assert end < 1.0


def test_a_settled_run_has_no_more_to_do(tmp_path: Path) -> None:
    """Gone on with, it makes no step: an ensemble that is called again keeps its table."""
    case = CASE.format(stop="T", count=1)
    _, _, end = run(tmp_path, case)
    newest = Run(tmp_path / "mics-out").restart_files[-1]
    assert mics(tmp_path, case, "--restart", f"mics-out/{newest}").returncode == 0
    assert Run(tmp_path / "mics-out").series.time[-1] == end


@pytest.mark.parametrize(
    "body",
    [
        "",
        "&body shape = 'c'  position = 0.2, 0.2, 0.05  fixed = T /\n",
        "&body shape = 's'  position = 0.2, 0.2, 0.2  angular_velocity = 0, 0, 50 /\n",
    ],
    ids=["no block", "a held one", "one that spins in its place"],
)
def test_what_never_settles(body: str, tmp_path: Path) -> None:
    """Where no block comes to rest there is nothing to settle."""
    text = CASE.format(stop="T", count=1).replace("t_end = 5", "t_end = 1")
    text = text.split("&drop")[0] + "&shape name = 's'  kind = 'sphere'  size = 0.1 /\n"
    text = text.replace("physics", "history_interval = 0.1  physics")
    code, said, end = run(tmp_path, text + "&fluid gravity = 0, 0, 0 /\n" + body)
    assert (code, said, end) == (0, "", 1.0)


def test_goes_on_when_not_asked(tmp_path: Path) -> None:
    """Without `stop_when_settled` the run goes to its end and does not speak of rest."""
    text = CASE.format(stop="F", count=2).replace("rest_time = 0.3", "")
    code, said, end = run(tmp_path, text)
    assert code == 3 and end == pytest.approx(5.0)
    assert "1 due block(s) never found room" in said and "at rest" not in said


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
    assert last.fall_time == pytest.approx(np.sqrt(2 * 3.0 / 9.81), rel=0.02)
    few = every[-1][2]  # rows
    assert np.isnan([few.fall_time, few.fastest, few.terminal, few.drift]).all()
    mean = [np.linalg.norm(run.bodies.contact_force[:, 2], axis=1).max() for run in runs]
    assert mean[0] == last.contact_force and mean[-1] < 0.5 * mean[0]
    assert [p.at_rest for p in places.places(runs[-1])] == [1, 1, 0]


def test_what_settled_is_at_rest(tmp_path: Path) -> None:
    """Units of 2 m, in a run that ends `rest_time` after the last of them came to rest."""
    run = told(tmp_path, "settled", 0.1, t_end=20, stop="T")
    assert run.bodies.time[-1] < 5
    assert [p.at_rest for p in places.places(run)] == [1, 1, 1]
