"""A small stack is enough; one that is too small is refused with a message."""

import os
import re
import resource
import subprocess
from pathlib import Path

import pytest

from run_cases import ROOT
from test_input import TANK

SMALL = TANK.replace("= 1 /", "= 0.01 /") + "&fluid water_level = 0.1 /\n"


@pytest.mark.parametrize("name", ["blocks", "blocks_paper", "tetrapods"])
def test_a_small_stack_is_enough(name: str, tmp_path: Path) -> None:
    """Of 96 kB, also for each thread."""

    def small_stack() -> None:
        resource.setrlimit(resource.RLIMIT_STACK, (96 * 1024, 96 * 1024))

    text = re.sub(r"t_end = \S+", "t_end = 0.06", (ROOT / "input" / f"{name}.nml").read_text())
    (tmp_path / "input").symlink_to(ROOT / "input")
    done = subprocess.run(
        [ROOT / "mics", "--quiet", "--threads", "2"],
        cwd=tmp_path,
        input=text,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        preexec_fn=small_stack,
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("size", ["16k", " 16 K", "16", "16384B", "32k"])
def test_a_stack_that_is_too_small_is_refused(size: str, tmp_path: Path) -> None:
    """Of a thread and of the program: exit code 2 and what is needed, nothing written."""
    done = subprocess.run(
        [ROOT / "mics"],
        cwd=tmp_path,
        env={**os.environ, "OMP_STACKSIZE": size},
        input=SMALL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert f"environment variable OMP_STACKSIZE = '{size.rstrip()}': the stack" in done.stderr

    def tiny_stack() -> None:
        resource.setrlimit(resource.RLIMIT_STACK, (60 * 1024, 60 * 1024))

    done = subprocess.run(
        [ROOT / "mics"],
        cwd=tmp_path,
        input=SMALL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=tiny_stack,
    )
    assert done.returncode == 2
    assert "ulimit -s 60: the stack is too small, the program needs at least" in done.stderr
    assert list(tmp_path.iterdir()) == []
