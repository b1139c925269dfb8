"""Blocks placed from tables and by a crane: what is accepted, told, and becomes of them."""

import csv
import resource
from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools.reading.reader import Run
from micstools.shapes.geometry import quaternion_from_axis, rotation_matrix
from shared_runs import after_restart, texts
from test_input import mics

TANK = """&run t_end = 0.01  physics = 'dry'  dt = 0.01 /
&grid cells = 6, 4, 4  length = 0.3, 0.2, 0.2 /
&shape name = 'cube'  kind = 'cube'  size = 0.02 /
&shape name = 'tetrapod'  kind = 'tetrapod'  size = 0.04 /
"""
HEAD = "shape,x,y,z,time,yaw_deg,pitch_deg,roll_deg,vx,vy,vz,fixed,name\n"
ROW = "cube,0.1,0.1,0.1,0,0,0,0,0,0,0,no,A1\n"


def put(folder: Path, table: str | bytes, drop: str = "", tank: str = TANK) -> str:
    """A case with a table beside it; the name of the case."""
    data = table.encode() if isinstance(table, str) else table
    (folder / "plan.csv").write_bytes(data)
    (folder / "case.nml").write_text(f"{tank}&drop file = 'plan.csv'  {drop}/\n")
    return str(folder / "case.nml")


def test_missing_file_and_idle_variables(tmp_path: Path) -> None:
    """A table that is not there; variables that it leaves without a meaning."""
    case = tmp_path / "case.nml"
    case.write_text(f"{TANK}&drop file = 'no.csv' /\n")
    done = mics([str(case)], tmp_path)
    assert (done.returncode, done.stderr) == (
        2, "mics: &drop file = 'no.csv': there is no such file, or it may not be read (line 5)\n"
    )  # fmt: skip
    put(tmp_path, HEAD + ROW, "shape = 'cube'  position = 3*0.1  count = 3  velocity = 3*0  ")
    errors = mics([str(case)], tmp_path).stderr.splitlines()
    assert len(errors) == 4 and all("the file has it" in line for line in errors), errors


DIALECTS = texts("placing")["dialects"]


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects_mean_the_same(dialect: str, tmp_path: Path) -> None:
    """Separators, order, quotes, units, remarks, ends of lines and a byte-order mark."""
    done = mics([put(tmp_path, DIALECTS[dialect])], tmp_path)
    assert done.returncode == 0, done.stderr
    bodies = Run(tmp_path / "mics-out").bodies
    assert bodies.shape == ["cube", "tetrapod"]
    assert np.array_equal(bodies.position[0], [[0.1, 0.15, 0.05], [0.2, 0.1, 0.1]])
    assert np.array_equal(bodies.release_time, [0.5, 1.0])
    with h5py.File(tmp_path / "mics-out" / "run.h5") as h5:
        assert [name.decode() for name in h5["bodies/name"][:]] == ["A 1", ""]


def test_names_in_other_letters(tmp_path: Path) -> None:
    """Names are kept in UTF-8; a table in Latin-1 is taken as such."""
    for code in ("utf-8", "latin-1"):
        folder = tmp_path / code
        folder.mkdir()
        table = "shape,x,y,z,time,name\ncube,0.1,0.1,0.1,0,Pfähle 7\n"
        assert mics([put(folder, table.encode(code))], folder).returncode == 0
        with h5py.File(folder / "mics-out" / "run.h5") as h5:
            assert h5["bodies/name"][0].decode() == "Pfähle 7"


def test_angles_turn_as_documented(tmp_path: Path) -> None:
    """Roll about x, then pitch about y, then yaw about z; a quaternion of any length."""
    table = "shape,x,y,z,time,yaw_deg,pitch_deg,roll_deg\ncube,0.1,0.1,0.1,1,50,-20,110\n"
    assert mics([put(tmp_path, table)], tmp_path).returncode == 0
    x, y, z = np.eye(3)
    turns = [rotation_matrix(quaternion_from_axis(*turn)) for turn in ((z, 50), (y, -20), (x, 110))]
    own = rotation_matrix(Run(tmp_path / "mics-out").bodies.quaternion[0, 0])
    assert own == pytest.approx(np.linalg.multi_dot(turns), abs=1e-12)


def test_units_and_names_of_clients(tmp_path: Path) -> None:
    """Feet to metres, a heading from north to the turn from x."""
    table = "Unit,Type,Easting [ft],Northing [cm],Elevation (mm),Time [min],Heading [rad]\n"
    table += "A1,cube,0.328083989501312,15,50,0.01,1.2\n"
    assert mics([put(tmp_path, table)], tmp_path).returncode == 0
    bodies = Run(tmp_path / "mics-out").bodies
    assert bodies.position[0, 0] == pytest.approx([0.1, 0.15, 0.05], abs=1e-14)
    assert bodies.release_time[0] == pytest.approx(0.6, abs=1e-14)
    own = rotation_matrix(bodies.quaternion[0, 0])
    assert own[:, 0] == pytest.approx([np.sin(1.2), np.cos(1.2), 0.0], abs=1e-12)


def test_a_long_plan_is_checked_quickly(tmp_path: Path) -> None:
    """1000 rows, half of them fixed, take at most 10 s of processor time."""
    rows = [
        ["tetrapod", 0.5 + 0.1 * (k % 40), 0.5 + 0.1 * (k // 40), 0.3, k, 7 * k, k % 2]
        for k in range(1000)
    ]
    with (tmp_path / "plan.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["shape", "x", "y", "z", "time", "yaw_deg", "fixed"], *rows])
    tank = TANK.replace("0.3, 0.2, 0.2", "5, 4, 1")
    (tmp_path / "case.nml").write_text(f"{tank}&drop file = 'plan.csv' /\n")
    began = sum(_children())
    done = mics(["--check", "--threads", "1", "case.nml"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "1000, the last one at 999 s" in done.stdout
    assert sum(_children()) - began < 10


def _children() -> tuple[float, float]:
    """Processor time of the programs that were run [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime, used.ru_stime


CRANE = """&run t_end = {end}  physics = '{physics}'  dt = 0.005  history_interval = 0.005
  restart_interval = 0 {more} /
&grid cells = 12, 12, 16  length = 0.12, 0.12, 0.16 /
&fluid water_level = 0.1 /
&shape name = 'cube'  kind = 'cube'  size = 0.03 /
&shape name = 'tetrapod'  kind = 'tetrapod'  size = 0.05 /
{blocks}
"""


def crane(folder: Path, blocks: str, end: float = 0.5, physics: str = "dry", more: str = "") -> str:
    """A case of a small tank."""
    folder.mkdir(exist_ok=True)
    text = CRANE.format(end=end, physics=physics, more=more, blocks=blocks)
    (folder / "case.nml").write_text(text)
    return str(folder / "case.nml")


def run(folder: Path, case: str, code: int = 0) -> tuple[dict[str, np.ndarray], str]:
    """What `/bodies` holds at the end of a run, and what was told."""
    done = mics([case], folder)
    assert done.returncode == code, done.stderr
    with h5py.File(folder / "mics-out" / "run.h5") as h5:
        return {name: data[:] for name, data in h5["bodies"].items()}, done.stderr


LYING = "&body shape = 'cube'  position = 0.06, 0.06, 0.015 /\n"


def test_a_crane_begins_above_a_slope_out_of_the_water(tmp_path: Path) -> None:
    """With an empty z, 37 mm above the water: on what lies below its upper edge."""
    (tmp_path / "slope.txt").write_text("2 2 0 0 0.12 0.12\n0 0.14 0 0.14\n")
    (tmp_path / "plan.csv").write_text("shape,x,y,z,time\ncube,0.09,0.06,,0\n")
    groups = ("&bed file = 'slope.txt' /\n&drop file = 'plan.csv'  lowering_speed = 0.2"
              "  release = 'touch' /")  # fmt: skip
    bodies, told = run(tmp_path, crane(tmp_path, groups, physics="light"))
    assert "waits" not in told and list(bodies["status"]) == [2]
    assert bodies["position"][1, 0, 2] == pytest.approx(0.07 * 1.75 + 0.015, abs=5e-4)


def test_a_blocked_block_waits_is_raised_or_left_out(tmp_path: Path) -> None:
    """The same blocked drop three ways: code 3, above the pile, not there."""
    drop = LYING + "&drop shape = 'cube'  position = 0.06, 0.06, 0.03  first_time = 0.1 "
    _, told = run(tmp_path / "a", crane(tmp_path / "a", drop + "/"), code=3)
    assert "body 2 is due but its place is taken; it waits, t = 0.1 s" in told
    bodies, told = run(tmp_path / "b", crane(tmp_path / "b", drop + "if_blocked = 'raise' /"))
    assert "body 2 was raised by 0.015 m, its place is taken, t = 0.1 s" in told
    assert bodies["raised"] == pytest.approx([0, 0.015], abs=2e-6)
    assert list(bodies["status"]) == [2, 2]
    assert bodies["position"][-1, 1] == pytest.approx([0.06, 0.06, 0.045], abs=1e-4)
    bodies, told = run(tmp_path / "c", crane(tmp_path / "c", drop + "if_blocked = 'skip' /"))
    assert "body 2 is left out, its place is taken, t = 0.1 s" in told
    assert list(bodies["status"]) == [2, 3]
    found = Run(tmp_path / "c" / "mics-out").bodies
    assert found.release_time[1] == np.inf and list(found.present(-1)) == [True, False]


def test_the_plan_is_without_the_random_shift(tmp_path: Path) -> None:
    """Of a table, a track and a body; `spread` moves the first two."""
    spread = "spread = 0.01, 0.01, 0 /\n"
    groups = (
        LYING
        + "&drop file = 'plan.csv' "
        + spread
        + (
            "&drop shape = 'cube'  position = 0.03, 0.03, 0.2  to = 0.09, 0.03, 0.2  count = 3 "
            + spread
        )
    )
    case = crane(tmp_path, groups)
    (tmp_path / "plan.csv").write_text("shape,x,y,z,time\ncube,0.03,0.09,0.2,0\n")
    bodies, _ = run(tmp_path, case)
    plan = [(0.06, 0.06), (0.03, 0.09), (0.03, 0.03), (0.06, 0.03), (0.09, 0.03)]
    assert bodies["planned"] == pytest.approx(np.array(plan), abs=1e-15)
    away = np.abs(bodies["position"][0, :, :2] - bodies["planned"]).max(axis=1)
    assert away[0] == 0 and (away[1:] > 1e-4).all() and (away < 0.01).all()
    assert bodies["status"].dtype.kind == "i"


def test_raised_out_of_the_water(tmp_path: Path) -> None:
    """A pile that reaches to the top does not stop a crane; below a lid it has to wait."""
    drop = "&drop shape = 'cube'  position = 0.06, 0.06, 0.02  count = 6  interval = 0.02 "
    case = crane(tmp_path / "a", drop + "if_blocked = 'raise' /", end=0.2)
    bodies, _ = run(tmp_path / "a", case)
    assert list(bodies["status"]) == 6 * [2]
    assert bodies["position"][-1, 5, 2] > 0.16
    lid = "&boundary z_max = 'no_slip' /"
    case = crane(tmp_path / "b", drop + "if_blocked = 'raise' /" + lid, end=0.2)
    _, told = run(tmp_path / "b", case, code=3)
    assert "body 6 is due but its place is taken; it waits" in told


@pytest.mark.parametrize("physics", ["dry", "light"])
def test_lowered_until_it_touches(physics: str, tmp_path: Path) -> None:
    """A cube goes down at its speed until it touches the one below, and is let go there."""
    drop = LYING + (
        "&drop shape = 'cube'  position = 0.06, 0.06, 0.12  first_time = 0.1 "
        "lowering_speed = 0.2  release = 'touch' /"
    )
    bodies, told = run(tmp_path, crane(tmp_path, drop, end=0.8, physics=physics))
    assert "body" not in told
    entry, released = bodies["entry_time"][1], bodies["release_time"][1]
    assert (entry, list(bodies["status"])) == (0.1, [2, 2])
    assert released == pytest.approx(0.1 + (0.12 - 0.045) / 0.2, abs=1e-4)
    held = (bodies["time"] > entry + 1e-9) & (bodies["time"] <= released)
    way = 0.12 - 0.2 * (bodies["time"][held] - entry)
    assert bodies["position"][held, 1, 2] == pytest.approx(way, abs=1e-12)
    assert bodies["position"][-1, 1] == pytest.approx([0.06, 0.06, 0.045], abs=1e-4)


def test_lowered_to_a_height_or_a_place(tmp_path: Path) -> None:
    """Release 2 cm above a cube; at a place, from the level; where something is in its way."""
    drop = LYING + "&drop shape = 'cube'  lowering_speed = 0.2  position = 0.06, 0.06, "
    case = crane(tmp_path / "a", drop + "0.12  release = 'height'  release_height = 0.02 /")
    bodies, _ = run(tmp_path / "a", case)
    assert bodies["release_time"][1] == pytest.approx((0.12 - 0.065) / 0.2, abs=1e-4)
    bodies, _ = run(tmp_path / "b", crane(tmp_path / "b", drop + "0.06 /", physics="light"))
    assert bodies["position"][0, 1, 2] == pytest.approx(0.115)  # its lowest point is at the level
    assert bodies["release_time"][1] == pytest.approx((0.115 - 0.06) / 0.2, abs=1e-4)
    bodies, told = run(tmp_path / "c", crane(tmp_path / "c", drop + "0.04 /", end=0.8))
    assert "body 2 touches what lies below and was let go 0.005 m above its place" in told
    assert list(bodies["status"]) == [2, 2]


def test_set_down_on_a_slope(tmp_path: Path) -> None:
    """A tetrapod with its base on a slope of 1:2 stays; let go upright it rolls; it slides on a bed
    of which the check tells that it is too smooth."""
    (tmp_path / "slope.txt").write_text("2 2 0 0 0.12 0.12\n0 0.06 0 0.06\n")
    steep = "100 % of it is steeper than the 21.8 degrees that friction = 0.4 holds"
    for mu, how in ((0.8, "'set_down'  attitude = 'bed'"), (0.8, "'touch'"), (0.4, "'set_down'")):
        drop = (
            f"&bed file = 'slope.txt'  friction = {mu} /\n&drop shape = 'tetrapod'  "
            f"position = 0.06, 0.06, 0.12  lowering_speed = 0.2  release = {how} /"
        )
        case = crane(tmp_path, drop, end=1.0)
        way = np.hypot(*(run(tmp_path, case)[0]["position"][-1, 0, :2] - 0.06))
        assert way < 1e-4 if "bed" in how else way > 0.01
        assert (steep in mics(["--check", case], tmp_path).stdout) == (mu < 0.5)


@pytest.mark.parametrize(
    "release", ["touch", "set_down", "set_down' swivel=T axis=1,1,0 angle_deg=20 attitude='given"]
)
def test_lowered_in_water_and_again_after_a_restart(release: str, tmp_path: Path) -> None:
    """The flow meets the held block as a moving body; a restart in the middle changes no bit."""
    drop = (
        "&drop shape = 'tetrapod'  position = 0.06, 0.06, 0.14  lowering_speed = 0.4 "
        f"release = '{release}' /"
    )
    end, slow = (0.4, 0.01) if release == "touch" else (0.6, 0.3)  # before the release
    case = Path(crane(tmp_path, drop, end=end, physics="coupled")).read_text()
    case = case.replace("restart_interval = 0", f"restart_interval = {end / 2}")
    assert after_restart(tmp_path, case) == []
    with h5py.File(tmp_path / "whole" / "run.h5") as h5:
        bodies = {name: data[:] for name, data in h5["bodies"].items()}
    assert 0.25 < bodies["release_time"][0] < end and list(bodies["status"]) == [2]
    held = (bodies["time"] > 0.1) & (bodies["time"] < bodies["release_time"][0] - slow)
    assert bodies["velocity"][held, 0, 2] == pytest.approx(-0.4)
    assert (bodies["fluid_force"][held, 0, 2] > 0).all()
    with h5py.File(tmp_path / "whole" / "restart-a.h5") as h5:
        assert list(h5["blocks/status"][:]) == [1]
