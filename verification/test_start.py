"""`&start`: blocks begin where another run left them; a split hopper filled dry opens in water."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from measures.budget import Budget
from micstools.reading.reader import Run
from shared_runs import mics, texts

GRID = "&grid cells = 12, 4, 12  length = 0.24, 0.08, 0.24 /\n"
CUBE = "&shape name = 'cube'  kind = 'cube'  size = 0.03 /\n"
DROP = "&drop shape = 'cube'  position = 0.06, 0.04, 0.2  count = 3  interval = 0.2 /\n"
THREE = "&body shape = 'cube'  position = 0.2, 0.04, 0.1  fixed = T /\n" + DROP
FILL = "&run t_end = 0.5  dt = 0.01  physics = 'dry'  output = 'fill'  field_interval = 0 /\n"
THEN = "&run t_end = 0.1  dt = 0.01  physics = 'dry'  output = 'then'  field_interval = 0 /\n"


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a dry run of three dropped cubes beside a held one; others find no room."""
    folder = tmp_path_factory.mktemp("filled")
    done = mics(folder, FILL + GRID + CUBE + THREE + DROP.replace("/", "if_blocked = 'skip' /"))
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("time", [-1, 0.305])
def test_blocks_begin_where_they_were(filled: Path, named: bool, time: float) -> None:
    """All free ones released by then, named again or not, shifted; the held one stays."""
    shift = "shift = 0.05, 0, 0.001"
    start = f"&start file = 'fill/run.h5'  time = {time}  {shift} /\n"
    case = THEN + GRID + CUBE + start + (THREE if named else THREE.split("&drop")[0])
    assert mics(filled, case, "--check").returncode == 0
    done = mics(filled, case)
    assert done.returncode == 0, done.stderr
    with h5py.File(filled / "fill/run.h5") as a, h5py.File(filled / "then/run.h5") as b:
        row = len(a["bodies/time"]) - 1 if time < 0 else 30
        there = 2 if time > 0 else 3  # the third is due at 0.4 s
        assert a["bodies/time"][row] == pytest.approx(0.5 if time < 0 else 0.30)
        moved = b["bodies/position"][0, 1 : 1 + there] - a["bodies/position"][row, 1 : 1 + there]
        assert moved == pytest.approx(np.broadcast_to([0.05, 0, 0.001], moved.shape), abs=1e-15)
        for name in ("velocity", "angular_velocity", "quaternion"):
            one = a[f"bodies/{name}"][row, 1 : 1 + there]
            assert b[f"bodies/{name}"][0, 1 : 1 + there] == pytest.approx(one, abs=1e-14), name
        assert (b["bodies/position"][0, 0] == a["bodies/position"][0, 0]).all()
        assert len(b["bodies/mass"]) == (4 if named else 1 + there)
        assert (b["bodies/release_time"][: 1 + there] == 0).all()


@pytest.mark.parametrize(("start", "named", "message"), texts("start")["refused"])
def test_what_is_refused(filled: Path, start: str, named: int, message: str) -> None:
    rest = THREE.replace("count = 3", f"count = {named}")
    done = mics(filled, THEN + GRID + CUBE + f"&start {start} /\n" + rest)
    assert done.returncode == 2 and message in done.stderr, done.stderr


@pytest.mark.parametrize("drop", ["", "&drop shape = 'cube'  position = 3*0.06  count = 2 /\n"])
def test_units_keep_their_names(drop: str, tmp_path: Path) -> None:
    """Whether they come along or are named again without a name."""
    table = "shape,x,y,z,time,name\ncube,0.06,0.04,0.1,0,A1\ncube,0.12,0.04,0.1,0,B 2\n"
    (tmp_path / "plan.csv").write_text(table)
    assert mics(tmp_path, FILL + GRID + CUBE + "&drop file = 'plan.csv' /\n").returncode == 0
    done = mics(tmp_path, THEN + GRID + CUBE + "&start file = 'fill/run.h5' /\n" + drop)
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "then" / "run.h5") as h5:
        assert [name.decode().strip() for name in h5["bodies/name"][:]] == ["A1", "B 2"]
    done = mics(tmp_path, FILL + GRID + CUBE + "&start file = 'fill/run.h5' /\n" + drop)
    assert done.returncode == 2 and "would be renamed" in done.stderr, "it could not be restarted"


def test_other_shapes_are_refused(filled: Path) -> None:
    start = "&start file = 'fill/run.h5' /\n"
    ball = CUBE.replace("'cube'", "'ball'", 1) + THREE.replace("'cube'", "'ball'")
    done = mics(filled, THEN + GRID + start + ball)
    assert done.returncode == 2
    assert "has 3 free blocks of the shape 'cube', which no &shape here has" in done.stderr
    done = mics(filled, THEN + GRID + start + CUBE.replace("0.03", "0.02") + THREE)
    assert done.returncode == 2 and "shapes must be the same" in done.stderr, done.stderr


def test_one_cause_is_one_message(filled: Path, tmp_path: Path) -> None:
    """Of stones of a family, which are shapes of their own, and of blocks beyond a wall."""
    rocks = "&shape name = 'rock'  kind = 'rock'  density = 2650  mass_50 = {} {} /\n"
    sizes = "mass_min = 0.001  mass_max = 0.003  variants = 6"
    drop = "&drop shape = 'rock'  position = 0.06, 0.04, 0.06  to = 0.18, 0.04, 0.06  count = 6 /\n"
    fill = FILL.replace("0.5", "0.02") + GRID + rocks.format(0.002, sizes) + drop
    assert mics(tmp_path, fill.replace("count = 6", "count = 6  interval = 0")).returncode == 0
    with h5py.File(tmp_path / "fill/run.h5") as h5:
        shapes = len(set(h5["bodies/shape"][:]))
    start = "&start file = 'fill/run.h5' /\n"
    for shape, words in (
        (rocks.format(0.0021, sizes), "shapes must be the same"),
        (CUBE, "which no &shape here has"),
    ):
        done = mics(tmp_path, THEN + GRID + start + shape)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert words in done.stderr and f"(likewise {shapes - 1} more shapes)" in done.stderr
    done = mics(filled, THEN + GRID + CUBE + start.replace("/\n", "shift = 0.3, 0, 0 /\n"))
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert "&start: position = " in done.stderr and "(likewise 2 more blocks)" in done.stderr


HINGE, HEIGHT, LONG = 0.15, 0.40, 0.23
"""Half the width of the hopper between its hinges, their height, length of its halves [m]."""
HOPPER = """&grid cells = 25, 8, 30  length = 0.5, 0.16, 0.6 /
&shape name = 'half'  kind = 'box'  size = {long}, 0.158, 0.012 /
&shape name = 'rock'  kind = 'rock'  density = 2650  mass_50 = 0.1  mass_min = 0.06
  mass_max = 0.15 /
{halves}"""
ROCKS = (
    "&drop shape = 'rock'  position = 0.25, 0.08, 0.55  count = 40  interval = 0.08\n"
    "  spread = 0.06, 0.04, 0  orientation = 'random'  seed = 5 /\n"
)


def half_of_hopper(side: int, time: np.ndarray, angle: np.ndarray) -> str:
    """The table of a half that hangs from its upper edge, `angle` below the level."""
    rows = ["time,x,y,z,qw,qx,qy,qz"]
    for t, a in zip(time, angle, strict=True):
        x = 0.25 + side * (HINGE - 0.5 * LONG * np.cos(a))
        z = HEIGHT - 0.5 * LONG * np.sin(a)
        turn = -0.5 * side * a
        rows.append(f"{t:.17g},{x:.17g},0.08,{z:.17g},{np.cos(turn):.17g},0,{np.sin(turn):.17g},0")
    return "\n".join(rows) + "\n"


@pytest.mark.cost(25)
def test_a_split_hopper(tmp_path: Path) -> None:
    """Forty rocks rest in a closed hopper, without water; opened in water all of them fall out. The
    books of momentum, of each rock and of all with the fluid, and of volume are closed."""
    closed, wide = np.radians(51.0), np.radians(88.0)
    time = np.linspace(0.0, 0.4, 9)
    swing = closed + (wide - closed) * (time / 0.4) ** 2 * (3 - 2 * time / 0.4)
    for side, name in ((-1, "left"), (1, "right")):
        table = half_of_hopper(side, time.tolist(), swing.tolist())
        (tmp_path / f"{name}.csv").write_text(table)
        (tmp_path / f"{name}-shut.csv").write_text("\n".join(table.split("\n")[:2]) + "\n")
    held = "".join(
        f"&body shape = 'half'  fixed = T  motion = '{name}{{}}.csv' /\n"
        for name in ("left", "right")
    )
    dry = "&run t_end = 4.2  dt = 0.02  physics = 'dry'  output = 'fill'  field_interval = 0 /\n"
    case = HOPPER.format(long=LONG, halves=held.format("-shut", "-shut")) + ROCKS
    done = mics(tmp_path, dry + case)
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "fill/run.h5") as h5:
        place = h5["bodies/position"][-1, 2:]
        assert place[:, 2].min() > 0.19, "all lie in the hopper"
        assert np.abs(h5["bodies/velocity"][-1, 2:]).max() < 0.02
    wet = (
        "&run t_end = 0.7  dt = 0.01  output = 'open'  field_interval = 1e-5 /\n"
        "&fluid water_level = 0.45 /\n&start file = 'fill/run.h5' /\n"
    )
    done = mics(tmp_path, wet + HOPPER.format(long=LONG, halves=held.format("", "")))
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "open/run.h5") as h5:
        b, dt = h5["bodies"], np.diff(h5["bodies/time"][:])[:, None, None]
        assert len(b["mass"]) == 42
        assert b["position"][0, 2:] == pytest.approx(place, abs=1e-15)
        mass = b["mass"][2:][None, :, None]
        force = b["fluid_force"][1:, 2:] + b["contact_force"][1:, 2:]
        gained = mass * np.diff(b["velocity"][:, 2:], axis=0)
        weight = mass * np.array([0, 0, -9.81])
        assert np.abs(gained - dt * (force + weight)).max() < 1e-12
        assert np.abs(h5["series/liquid_volume_drift"][:]).max() < 1e-11
        assert np.isfinite(b["position"][:]).all()
        low = b["position"][-1, 2:, 2]
        assert np.median(low) < 0.2 and (low < place[:, 2] + 0.01).all(), "the load falls out"
    budget = Budget(Run(tmp_path / "open"))
    under_water = (1.0 - 998.2 / 2650.0) * 9.81 * mass.sum() * budget.time[-1]
    error = budget.momentum - budget.momentum[0] - budget.impulse
    # three fillings gave 0.11, 0.12 and 0.14e-3, half of it the friction at the walls
    assert np.abs(error).max() < 3e-4 * under_water
