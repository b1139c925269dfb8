"""A few trials of the long fault tests in soak/, which `make test` has time for."""

import random
import signal
from pathlib import Path

import pytest

from run_cases import ROOT, Machine
from soak import (
    any_number,
    full_disk,
    memory,
    moved_folders,
    signals,
    still_pile,
    strangers,
    two_programs,
)
from soak.shop import Shop, open_shop

MICS, PARALLEL = ROOT / "mics", ROOT / "mics_mpi"
ALONE = Machine(MICS, 1, 1)


@pytest.fixture(scope="module")
def disk_shop(tmp_path_factory: pytest.TempPathFactory) -> Shop:
    return open_shop(ALONE, tmp_path_factory.mktemp("disk"))


@pytest.mark.parametrize("share", [0.05, 0.2, 0.3, 0.5, 0.65, 0.75])
@pytest.mark.parametrize("kind", ["disk", "limit"])
def test_full_disk(disk_shop: Shop, kind: str, share: float, tmp_path: Path) -> None:
    """What was written before stays readable, and the run goes on once there is room."""
    if kind == "disk" and not full_disk.may_mount():
        pytest.skip("no right to mount a small disk")
    size = int(share * full_disk.largest(disk_shop, kind))
    said, found = full_disk.check_size(disk_shop, kind, size, tmp_path)
    assert found == [], said
    assert said.startswith("exit 4")


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Shop:
    return open_shop(ALONE, tmp_path_factory.mktemp("programs"), two_programs.CASE)


@pytest.mark.parametrize("start", two_programs.STARTS)
def test_two_programs(shop: Shop, start: str, tmp_path: Path) -> None:
    """Of three programs that start at once, one gets the folder and the others say who has it."""
    assert two_programs.trial(shop, start, 3, tmp_path / "run") == []


def test_late_comers(shop: Shop, tmp_path: Path) -> None:
    assert two_programs.late_comer(shop, tmp_path / "run") == []


def test_lock_of_a_killed_run(shop: Shop, tmp_path: Path) -> None:
    assert two_programs.killed(shop, tmp_path / "run") == []


@pytest.mark.parametrize("seconds", [0.05, 0.1, 0.15, 0.2, 0.25, 0.35])
def test_kill(disk_shop: Shop, seconds: float, tmp_path: Path) -> None:
    """What a killed run has written can be read, and goes on to the same bits."""
    said, found = signals.trial(disk_shop, signal.SIGKILL, seconds, False, tmp_path)
    assert found == [], said


@pytest.mark.parametrize("seconds", [0.1, 0.3])
@pytest.mark.parametrize("way", moved_folders.WAYS)
def test_folder_moved(disk_shop: Shop, way: str, seconds: float, tmp_path: Path) -> None:
    """The run ends with code 4; nothing of the run that has its place is touched."""
    said, found = moved_folders.trial(disk_shop, way, seconds, tmp_path)
    assert found == [], said


@pytest.fixture(scope="module")
def parallel_shop(tmp_path_factory: pytest.TempPathFactory) -> Shop:
    return open_shop(Machine(PARALLEL, 2, 1), tmp_path_factory.mktemp("signals"))


@pytest.mark.xdist_group("ranks")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1, signal.SIGKILL])
def test_signal_to_mpirun(parallel_shop: Shop, number: int, tmp_path: Path) -> None:
    """The run ends in good order; what a process that is killed leaves behind goes on, too."""
    said, found = signals.trial(parallel_shop, number, 1.0, False, tmp_path)
    assert found == [], said


@pytest.mark.xdist_group("ranks")
@pytest.mark.parametrize("way", ["moved", "unseen in place"])
def test_folder_moved_from_ranks(parallel_shop: Shop, way: str, tmp_path: Path) -> None:
    said, found = moved_folders.trial(parallel_shop, way, 0.5, tmp_path)
    assert found == [], said


@pytest.mark.xdist_group("ranks")
def test_stop_and_go_on_elsewhere(tmp_path: Path) -> None:
    """A whole job in small: stopped in the middle of a contact, gone on with on other numbers."""
    case = tmp_path / "case.nml"
    case.write_text(any_number.SMALL)
    found = dict(any_number.try_case(case, ["1x2", "2x1"], 1, tmp_path))
    assert len(found) == 3 and not any(found.values()), found


def test_memory_does_not_grow(tmp_path: Path) -> None:
    """With a restart file after every step a run takes no more memory in the end."""
    said, found = memory.growth(ALONE, 600, tmp_path)
    assert found == [], said


@pytest.mark.parametrize("way", strangers.WAYS)
def test_damaged_run(way: str, tmp_path: Path) -> None:
    """It is told in a line with the name of the file, or does not matter."""
    whole = strangers.write_run(tmp_path / "run", strangers.Motion(t_end=0.2))
    said, found = strangers.damaged_run(way, whole, random.Random(way), tmp_path)
    assert found == [], said


@pytest.mark.parametrize("sleep", [True, False])
def test_still_pile(sleep: bool, tmp_path: Path) -> None:
    """Blocks that lie on one another under water do not creep."""
    said, found = still_pile.creep(ALONE, 5.0, sleep, tmp_path)
    assert found == [], said
