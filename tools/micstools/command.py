"""What all scripts do alike: find the results asked for, say in one line what is wrong."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py

from micstools.cases import settings
from micstools.reading.reader import BadRun, Run

OUTPUT = "mics-out"
"""Folder of a case that names none."""


def results_of(path: Path) -> Path:
    """The folder of results that is meant by a folder, a file in it, or the case file of the run.

    The folder a case file names is taken from where we are, as the program does.
    """
    folder = output_of(path)
    if folder != path and not (folder / "run.h5").is_file():
        raise BadRun(f"{folder}, the output of {path}, holds no run.h5: run the case first")
    return folder


def output_of(path: Path) -> Path:
    """The same where the case may not have been run yet."""
    if path.is_dir():
        return path
    if not path.exists():
        raise BadRun(f"{path}: there is no such folder or file")
    if h5py.is_hdf5(path):
        return path.parent
    try:
        case = settings.read(path)
        output = folder_in(case)
    except BadRun as error:
        raise BadRun(f"{path}: neither a folder of results nor a case file ({error})") from error
    if "grid" not in (name for name, _, _ in settings.groups(case)):
        raise BadRun(f"{path}: neither a folder of results nor a case file (it has no &grid)")
    return output


def folder_in(case: str) -> Path:
    """The folder that the text of a case names."""
    return Path(str(settings.value(case, "run", "output") or OUTPUT).strip())


def open_run(path: Path) -> Run:
    """The run of a folder or of a case file, with one row at least."""
    run = Run(results_of(path))
    if not (run.bodies.time.size and run.series.time.size):
        raise BadRun(f"{run.folder} holds no row of results yet")
    return run


def run_script(main: Callable[[], None], name: str | None = None) -> None:
    """Call a script; trouble with what the user gave it is one line and the exit code 2. Who reads
    its output may go at any time, as `head` does."""
    try:
        try:
            main()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is left to say
        raise SystemExit(141) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    except (BadRun, OSError, subprocess.SubprocessError) as problem:
        said: object = problem
        if isinstance(problem, OSError) and problem.strerror and problem.filename:
            said = f"{problem.filename}: {problem.strerror}"
        print(f"{name or Path(sys.argv[0]).stem}: {said}", file=sys.stderr)
        raise SystemExit(2) from problem
