"""Fixed bodies moved by a table: where they are, what they push, restarts, and damaged tables."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import shared_runs
from measures.budget import Budget
from micstools.reading.reader import Run

TEXTS = shared_runs.texts("motion")
DRY, WET, PLATE, MOVED, CUBE = (TEXTS[name] for name in ("dry", "wet", "plate", "moved", "cube"))
STEADY, DOOR = TEXTS["steady"], TEXTS["door"]


def mics(work: Path, case: str, table: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Run a case with its table beside it."""
    work.mkdir(exist_ok=True)
    (work / "way.csv").write_text(table)
    return shared_runs.mics(work, case, *options)


def run(work: Path, case: str, table: str) -> h5py.File:
    """The results of a good run."""
    done = mics(work, case, table)
    assert done.returncode == 0, done.stderr
    return h5py.File(work / "mics-out" / "run.h5")


@pytest.mark.parametrize("physics", ["dry", "light"])
def test_a_plate_pushes_a_cube(physics: str, tmp_path: Path) -> None:
    """Half way at half its time, through its rows, held at the end; the cube lies before it."""
    table = "time,x,y,z\n0.1,0.02,0.04,0.03\n0.9,0.08,0.04,0.03\n"
    case = DRY.format(end=1.2).replace("dry", physics) + PLATE + MOVED.format(more="") + CUBE
    case += "&fluid water_level = 0.001 /\n"
    with run(tmp_path, case, table) as h5:
        time, x, v = (h5[f"bodies/{name}"][:] for name in ("time", "position", "velocity"))
        s = np.clip((time - 0.1) / 0.8, 0, 1)
        assert x[:, 0, 0] == pytest.approx(0.02 + 0.06 * s**2 * (3 - 2 * s), abs=1e-15)
        assert v[:, 0, 0] == pytest.approx(0.06 / 0.8 * 6 * s * (1 - s), abs=1e-15)
        assert x[-1, 1, 0] == pytest.approx(0.095, abs=5e-4), "cube, plate and half of each"
        assert np.abs(v[-1]).max() < 1e-6
        pushed = h5["bodies/contact_force"][:, 1, 0].max()
        assert pushed > 0.4 * 0.9 * 9.81 * 0.02**3 * 2300, "friction on the floor"


def test_sleepers_wake_for_it(tmp_path: Path) -> None:
    """A cube asleep on a held plate follows it when that begins to sink after two seconds."""
    table = "time,x,y,z\n2,0.06,0.04,0.03\n2.5,0.06,0.04,0.01\n"
    case = DRY.format(end=3.0) + PLATE.replace("0.01, 0.06, 0.06", "0.06, 0.06, 0.01")
    case += MOVED.format(more="") + CUBE.replace("0.04, 0.01 /", "0.04, 0.0451 /")
    with run(tmp_path, case, table) as h5:
        time, x = h5["bodies/time"][:], h5["bodies/position"][:, 1, 2]
        before = h5["series/sleeping"][:][np.searchsorted(time, 1.99)]
        assert before == 1
        assert x[-1] - x[np.searchsorted(time, 1.99)] == pytest.approx(-0.02, abs=1e-5)


def test_steady_rows_are_a_given_velocity(tmp_path: Path) -> None:
    """Between rows of a steady motion the flow is that of a body with `velocity`."""
    case = WET.format(end=0.1) + PLATE
    with run(tmp_path / "a", case + MOVED.format(more=""), STEADY) as a, \
            run(tmp_path / "b", case + TEXTS["given"], STEADY) as b:  # fmt: skip
        for name in ("bodies/position", "bodies/velocity", "bodies/fluid_force"):
            scale = np.abs(b[name][:]).max()
            assert np.abs(a[name][:] - b[name][:]).max() < 1e-7 * scale, name
        assert np.abs(a["series/liquid_volume_drift"][:]).max() < 1e-12


def way(pose: Callable[[float], tuple[float, float, float]]) -> str:
    """A table of x, z and turn about y."""
    rows = ["time,x,y,z,qw,qx,qy,qz"]
    for t in np.linspace(0, 0.4, 41):
        x, z, turn = pose(t)
        attitude = f"{np.cos(turn / 2):.17g},0,{np.sin(turn / 2):.17g},0"
        rows.append(f"{t:.17g},{x:.17g},0.08,{z:.17g},{attitude}")
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    "poses",
    [
        [lambda t: (0.2 + 1.5 * t**2, 0.3, 0)],
        [lambda t: (0.2 + 0.3 * t, 0.3, 2 * t)],
        [lambda t, s=s: (0.25 - s * 0.103 * np.cos(2 * t), 0.3 - 0.1 * np.sin(2 * t), 2 * s * t)
         for s in (-1, 1)],
    ],
    ids=["pushed", "pushed and turned", "two doors"],
)  # fmt: skip
def test_momentum_of_what_moves(
    poses: list[Callable[[float], tuple[float, float, float]]], tmp_path: Path
) -> None:
    """The force on bodies that accelerate by a table is what the fluid gains and the walls bear."""
    case = TEXTS["large"]
    for b, pose in enumerate(poses):
        (tmp_path / f"{b}.csv").write_text(way(pose))
        case += f"&body shape = 'plate'  fixed = T  motion = '{b}.csv' /\n"
    run(tmp_path, case, "").close()
    budget = Budget(Run(tmp_path / "mics-out"))
    error = budget.momentum - budget.momentum[0] - budget.impulse
    force = budget.bodies.fluid_force[1:]
    exchanged = np.abs(force * np.diff(budget.time)[:, None, None]).sum()
    assert np.abs(error).max() < 2e-5 * exchanged


@pytest.mark.parametrize("coupling", ["monolithic", "mics"])
def test_fluid_of_a_door(coupling: str, tmp_path: Path) -> None:
    """A door that starts, turns and stops in water: liquid kept, divergence met, its rates those of
    its poses."""
    case = WET.format(end=0.12) + PLATE + MOVED.format(more="")
    case += f"&numerics coupling = '{coupling}' /\n"
    with run(tmp_path, case, DOOR) as h5:
        assert np.abs(h5["series/liquid_volume_drift"][:]).max() < 1e-12
        if coupling == "monolithic":  # the other one overlays bodies on the flow
            assert h5["series/divergence_max"][:].max() < 1e-5
        assert h5["series/cfl"][:].max() <= 0.5 * (1 + 1e-9)
        b = h5["bodies"]
        time, x, v = b["time"][:], b["position"][:, 0], b["velocity"][:, 0]
        step = np.diff(time)[:, None]
        mean = np.diff(x, axis=0) / step
        assert np.abs(mean - 0.5 * (v[1:] + v[:-1])).max() < 0.05 * np.abs(v).max()
        assert np.abs(v[time > 0.1 + 1e-9]).max() == 0
        assert np.abs(b["fluid_force"][:]).max() > 0.1


@pytest.mark.parametrize("physics", ["dry", "light", "coupled"])
def test_restart_changes_no_bit(physics: str, tmp_path: Path) -> None:
    """Gone on with from the restart file before the last, in the middle of the motion."""
    head = WET.replace(" /", f"  physics = '{physics}' /", 1)
    case = (head + PLATE + MOVED.format(more="") + CUBE.replace("0.06,", "0.10,")).format(end=0.09)
    (tmp_path / "way.csv").write_text(DOOR)
    assert shared_runs.after_restart(tmp_path, case) == []
    older = f"whole/{Run(tmp_path / 'whole').restart_files[0]}"
    done = mics(
        tmp_path, case, DOOR.replace("0.07,", "0.071,"), "--restart", older, "--output", "third"
    )
    assert done.returncode == 2 and "motion" in done.stderr, done.stderr


@pytest.mark.parametrize(("more", "message"), TEXTS["taken_over"])
def test_what_a_table_takes_over(more: str, message: str, tmp_path: Path) -> None:
    done = mics(tmp_path, DRY.format(end=1) + PLATE + MOVED.format(more=more), DOOR)
    assert done.returncode == 2 and message in done.stderr, done.stderr


def test_the_same_place_and_free_bodies(tmp_path: Path) -> None:
    """The place of the table may be repeated; a free body cannot be moved; no such file."""
    case = DRY.format(end=0.02) + PLATE
    good = case + MOVED.format(more="position = 0.05, 0.04, 0.05")
    assert mics(tmp_path / "good", good, DOOR).returncode == 0
    free = mics(tmp_path / "free", case + MOVED.format(more="").replace("fixed = T", ""), DOOR)
    assert "needs fixed = .true." in free.stderr and free.returncode == 2
    none = mics(tmp_path / "none", good.replace("way.csv", "no.csv"), DOOR)
    assert "there is no such file" in none.stderr and none.returncode == 2


@pytest.mark.parametrize(("other", "told"), TEXTS["in_the_way"])
def test_what_stands_in_the_way(other: str, told: str, tmp_path: Path) -> None:
    """Fixed bodies, moved ones and the bed are met before the run; free blocks are pushed."""
    (tmp_path / "across.csv").write_text("time,x,y,z\n0,0.1,0.015,0.05\n1,0.1,0.065,0.05\n")
    (tmp_path / "bed.txt").write_text("3 2 0 0 .08 .08\n0 0 .08 0 0 .08\n")
    case = DRY.format(end=1) + PLATE + MOVED.format(more="") + CUBE.splitlines()[0] + "\n" + other
    away = "time,x,y,z\n0,0.03,0.04,0.04\n1,0.13,0.04,0.04\n"
    done = mics(tmp_path, case, away, "--check")
    assert (done.returncode, told in done.stderr) == (2 if told else 0, True), done.stderr
    assert len(done.stderr.splitlines()) == (1 if told else 0) or "across" in done.stderr
