"""What a run keeps that goes on from a restart file: its bits, its other restart file, which is
named where one is no good, its results where it is refused; and how a run ends."""

import random
import resource
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

from micstools.reading.reader import Run
from run_cases import CASES
from shared_runs import after_restart, texts
from shared_runs import told as mics

TEXTS = texts("going_on")
WET = TEXTS["wet"]


@pytest.mark.parametrize("coupling", ["monolithic", "mics"])
def test_outflow_with_the_predictor_of_the_paper(coupling: str, tmp_path: Path) -> None:
    """It asks for what is outside the tank at the start of a step."""
    case = (CASES / "ranks" / "current.nml").read_text()
    case += f"&numerics momentum = 'c_ismac'  coupling = '{coupling}' /\n"
    assert after_restart(tmp_path, case) == []


def test_fast_small_blocks(tmp_path: Path) -> None:
    """Where blocks are as fast as contact follows, which of them are near limits the substep."""
    chance = random.Random(2)
    case = TEXTS["fast"].format(first=chance.choice([0.05, 0.06, 0.07, 0.08]))
    places: list[list[float]] = []
    while len(places) < 40:
        place = [chance.uniform(*ends) for ends in ((0.01, 0.09), (0.01, 0.09), (0.05, 0.35))]
        if all(np.linalg.norm(np.subtract(place, other)) > 0.0095 for other in places):
            places.append(place)
    for x, y, z in places:
        u, v, w, spin = (chance.uniform(*ends) for ends in ((-1, 1), (-1, 1), (-3, 0), (-30, 30)))
        case += f"&body shape = 'a'  position = {x:.6f}, {y:.6f}, {z:.6f}\n"
        case += f"  velocity = {u:.4f}, {v:.4f}, {w:.4f}  angular_velocity = {spin:.2f}, 0, 5 /\n"
    assert after_restart(tmp_path, case) == []


def test_another_shape_file_is_refused(tmp_path: Path) -> None:
    case = TEXTS["of_a_file"]
    (tmp_path / "block.txt").write_text(TEXTS["block"].format(size=0.1))
    assert mics(tmp_path, case) == (0, "")
    (tmp_path / "block.txt").write_text(TEXTS["block"].format(size=0.2))
    code, said = mics(tmp_path, case, "--restart", "mics-out/restart-a.h5")
    assert code == 2, said
    assert "checksum of the shape a" in said


@pytest.mark.parametrize(
    ("folder", "name"), [("mics-out", "restart-a.h5"), (".", "mics-out//restart-a.h5")]
)
def test_the_file_that_a_run_goes_on_from_stays(folder: str, name: str, tmp_path: Path) -> None:
    """Its first restart file takes the place of the other one."""
    assert mics(tmp_path, WET.format(t_end=0.02)) == (0, "")
    good = (tmp_path / "mics-out" / "restart-a.h5").read_bytes()
    longer = WET.format(t_end=0.03).replace("restart_interval = 0.01", "restart_interval = 1")
    assert mics(tmp_path, longer, "--restart", name, folder=folder) == (0, "")
    assert (tmp_path / "mics-out" / "restart-a.h5").read_bytes() == good


@pytest.mark.parametrize("lost", ["fields.vtkhdf", "run.h5"])
def test_refused_results_stay_as_they_are(lost: str, tmp_path: Path) -> None:
    """A file is missing or has lost rows: no other one is changed."""
    case = WET.format(t_end=0.03)
    assert mics(tmp_path, case) == (0, "")
    out = tmp_path / "mics-out"
    (out / lost).rename(out / "away")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    code, said = mics(tmp_path, case, "--restart", "mics-out/restart-b.h5")
    assert code == 4, said
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    (out / "away").rename(out / lost)
    assert mics(tmp_path, case, "--restart", "mics-out/restart-b.h5") == (0, "")


def test_a_restart_file_alone_goes_nowhere(tmp_path: Path) -> None:
    """Its rows are in no folder: older results are not set aside for it, no folder is made."""
    case = WET.format(t_end=0.02)
    assert mics(tmp_path, case) == (0, "")
    (tmp_path / "mics-out" / "restart-a.h5").rename(tmp_path / "alone.h5")
    for folder in "mics-out", "new":
        found = mics(tmp_path, case, "--restart", "alone.h5", "--output", folder)
        why = "./run.h5: is missing; a restart file goes on with the run.h5 beside it"
        assert found == (4, f"mics: {why}\n")
    assert {path.name for path in tmp_path.iterdir() if path.is_dir()} == {"mics-out"}


def test_rows_of_every_step_wanted_later(tmp_path: Path) -> None:
    """The first of them is of the first step, not of the time of the restart file."""
    case = WET.format(t_end=0.04).replace("&run", "&run history_interval = 0.04 ")
    assert mics(tmp_path, case) == (0, "")
    case = case.replace("history_interval = 0.04", "history_interval = 0")
    assert mics(tmp_path, case, "--restart", "mics-out/restart-a.h5") == (0, "")
    found = Run(tmp_path / "mics-out").series
    assert found.time == pytest.approx([0.0, 0.04])
    assert (found.transport_parts[1:] > 0).all()


def test_attitude_after_a_stop_between_rows(tmp_path: Path) -> None:
    """q and -q are one attitude; which of them is written follows the rows that are due."""
    whole, part = (TEXTS["turning"].format(t_end=t_end) for t_end in (3, 0.6))
    assert mics(tmp_path, whole, "--output", "whole") == (0, "")
    assert mics(tmp_path, part, "--output", "parts") == (0, "")
    assert mics(tmp_path, whole, "--restart", "parts/restart-a.h5") == (0, "")
    one, two = (Run(tmp_path / name).bodies.quaternion for name in ("whole", "parts"))
    assert one.shape == two.shape == (4, 1, 4)
    assert np.abs(one - two).max() < 1e-6


def test_no_room_for_the_last_frame(tmp_path: Path) -> None:
    """A limit stands for a full disk: the results say that the run did not end well."""
    case = TEXTS["many"] + "".join(
        f"&body shape = 'a'  position = {x}, {y}, 5 /\n" for x in range(1, 9) for y in range(1, 9)
    )
    assert mics(tmp_path, case, "--output", "free") == (0, "")
    sizes = {path.name: path.stat().st_size for path in (tmp_path / "free").iterdir()}
    frames = sizes.pop("blocks.vtkhdf")
    assert max(sizes.values()) < frames // 2
    codes = set()
    for percent in range(80, 160, 5):  # a frame asks for its bytes before they are compressed

        def no_room(limit: int = frames * percent // 100) -> None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        folder = f"full{percent}"
        code, said = mics(tmp_path, case, "--output", folder, preexec_fn=no_room)
        assert (code == 4) == ("blocks.vtkhdf" in said)
        assert Run(tmp_path / folder).provenance["exit_status"] == code
        codes.add(code)
    assert codes == {0, 4}


def test_nothing_left_to_stop(tmp_path: Path) -> None:
    """The time that is given is over with the last step: the run has reached its end."""
    case = WET.format(t_end=0.01).replace("8, 8, 8", "96, 96, 96")
    assert mics(tmp_path, case, "--max-wall", "0:00:01") == (0, "")


def test_only_up_is_open_to_fall_back_from(tmp_path: Path) -> None:
    """With gravity a little aslant a block that leaves by a side is out."""
    code, said = mics(tmp_path, TEXTS["aslant"])
    assert code == 0 and "body 1 is out" in said


@pytest.mark.parametrize("harm", ["cut", "changed", "gone"])
@pytest.mark.parametrize(("bad", "good"), ["ab", "ba"])
def test_other_file_is_named(bad: str, good: str, harm: str, tmp_path: Path) -> None:
    """One file is no good: the message tells the command with the other one, and that goes on."""
    case = WET.format(t_end=0.04)
    assert mics(tmp_path, case) == (0, "")
    file = tmp_path / "mics-out" / f"restart-{bad}.h5"
    data = file.read_bytes()
    at = len(data) // 2
    harmed = {"cut": data[:at], "changed": data[:at] + b"x" * 2000 + data[at + 2000 :]}
    file.unlink()
    if harm != "gone":
        file.write_bytes(harmed[harm])
    code, said = mics(tmp_path, case, "--restart", f"mics-out/restart-{bad}.h5")
    assert code == 4, said
    hint = f"; the other one is there: --restart mics-out/restart-{good}.h5"
    assert said.startswith(f"mics: mics-out/restart-{bad}.h5: ")
    assert said.endswith(hint + "\n"), said
    assert mics(tmp_path, case, "--restart", f"mics-out/restart-{good}.h5") == (0, "")


def test_no_other_file(tmp_path: Path) -> None:
    code, said = mics(tmp_path, WET.format(t_end=0.04), "--restart", "mics-out/restart-a.h5")
    assert code == 4 and "the other one" not in said


def test_disk_refuses(tmp_path: Path) -> None:
    """A disk that cannot store a restart file (fsync fails): code 4, the older file stays whole."""
    fault = ("strace", "-f", "-qq", "-o", "/dev/null", "-e", "inject=fsync:error=EIO:when=3")
    if not shutil.which("strace") or subprocess.run([*fault, "true"]).returncode != 0:
        pytest.skip("no strace, or it may not be used")
    case = WET.format(t_end=0.04)
    code, said = mics(tmp_path, case, before=fault)
    assert code == 4, said
    assert "restart-a.h5.part: cannot store: Input/output error" in said
    left = sorted(path.name for path in (tmp_path / "mics-out").glob("restart*"))
    assert left == ["restart-a.h5", "restart-b.h5"]
    for name in left:
        assert mics(tmp_path, case, "--restart", f"mics-out/{name}")[0] == 0
