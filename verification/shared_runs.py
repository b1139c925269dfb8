"""Runs that several tests look at, made once."""

import fcntl
import os
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import pytest

from micstools.reading.reader import Run
from run_cases import CASES, MPI_SETTINGS, ROOT, Machine, run
from same_bits import but_restarts, differences

SharedRun = Callable[[str, Machine], Path]


@pytest.fixture(scope="session")
def shared_run(tmp_path_factory: pytest.TempPathFactory) -> SharedRun:
    """The results of `verification/cases/ranks/NAME.nml` on a machine, made by the first test that
    asks and read by all, whichever process they run in. They must not be changed."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent  # each worker has a folder of its own within that of the session

    def results(name: str, machine: Machine) -> Path:
        folder = base / f"{name}-{machine.program.name}-{machine.ranks}-{machine.threads}"
        with Path(f"{folder}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not folder.exists():
                unfinished = Path(f"{folder}.unfinished")
                run(CASES / "ranks" / f"{name}.nml", unfinished, machine)
                unfinished.rename(folder)
        return folder

    return results


def texts(name: str) -> dict[str, Any]:
    """The cases of a test file, and rows of its tests, which stand in a table of their own."""
    return tomllib.loads((Path(__file__).parent / "texts" / f"{name}.toml").read_text())


def call(*words: object, **settings) -> subprocess.CompletedProcess[str]:
    """What a command said; it waits for no input. `more`: besides, in its environment."""
    own = {**os.environ, **MPI_SETTINGS, **settings.pop("more", {})}
    stdin = {} if "input" in settings else {"stdin": subprocess.DEVNULL}
    usual = {"capture_output": True, "text": True, "timeout": 300, "env": own} | stdin
    return subprocess.run(list(map(str, words)), **usual | settings)


def program(*words: object, cwd: Path, **settings) -> subprocess.CompletedProcess[str]:
    """What the program said, called on one thread from a folder."""
    before, threads = settings.pop("before", ()), settings.pop("threads", 1)
    return call(*before, ROOT / "mics", "--threads", threads, *words, cwd=cwd, **settings)


def run_text(
    work: Path, case: str, *words: str, folder: str = ".", **settings
) -> subprocess.CompletedProcess[str]:
    """Write a case into a folder and run it, from there or from a folder in it."""
    work.mkdir(exist_ok=True)
    (work / "case.nml").write_text(case)
    return program(*words, work / "case.nml", cwd=work / folder, **settings)


def mics(work: Path, case: str, *words: str, **settings) -> subprocess.CompletedProcess[str]:
    """A quiet run of a case."""
    return run_text(work, case, "--quiet", *words, **settings)


def told(work: Path, case: str, *words: str, **settings) -> tuple[int, str]:
    """Exit code and messages of a quiet run of a case."""
    done = mics(work, case, *words, **settings)
    return done.returncode, done.stderr


def results(work: Path, case: str) -> h5py.File:
    """The results of a good run."""
    done = mics(work, case)
    assert done.returncode == 0, done.stderr
    return h5py.File(work / "mics-out" / "run.h5")


def after_restart(work: Path, case: str) -> list[str]:
    """What differs after going on from the older of two restart files, in a copy; the runs may
    warn."""
    code, said = told(work, case, "--output", "whole")
    assert code == 0, said
    assert all(line.startswith("mics: warning: ") for line in said.splitlines())
    older, _ = Run(work / "whole").restart_files
    assert told(work, case, "--restart", f"whole/{older}", "--output", "again")[0] == 0
    return but_restarts(differences(work / "whole", work / "again"))
