"""What a run will take in memory is planned; too much of it ends with a reason, nothing written. So
does too small a stack."""

import math
import os
import re
import resource
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from micstools.bench.timing import timed
from run_cases import ROOT
from shared_runs import program, run_text
from test_input import TANK

MICS = ROOT / "mics"
USUAL = "conservative"
UNITS = {"kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
CASE = """&run t_end = 2.0e-3  dt = 1.0e-3  field_interval = 1 /
&grid cells = {cells}  length = 0.1, 0.1, 0.1 /
&boundary y_min = 'slip'  y_max = 'slip'  z_min = 'slip'  z_max = 'slip' /
&fluid water_level = 0.05 /
&numerics momentum = '{momentum}' /
&shape name = 'unit'  kind = 'hexapod'  size = 0.02 /
&body shape = 'unit'  position = 0.05, 0.05, 0.06 /
"""


def mics(
    work: Path,
    cells: str,
    *options: str,
    limit: float = -1,
    case: str = CASE,
    momentum: str = USUAL,
) -> subprocess.CompletedProcess[str]:
    """Run a case in a folder, with so many bytes of memory at most."""
    bound = partial(resource.setrlimit, resource.RLIMIT_AS, (int(limit), -1))
    text = case.format(cells=cells, momentum=momentum)
    return run_text(work, text, *options, preexec_fn=bound)


def planned(plan: str) -> tuple[float, str]:
    """Bytes of the plan, and all that it says of them."""
    said = next(line for line in plan.splitlines() if re.match(r" +about +[-\d.e]+ [kMGT]B", line))
    number, unit = said.split()[1:3]
    return float(number) * UNITS[unit.rstrip(",")], said


@pytest.mark.parametrize(
    ("cells", "least"), [("2147483647, 1, 1", 8e13), ("1290, 1290, 1290", 1.7e12)]
)
def test_more_than_any_machine_has(cells: str, least: float, tmp_path: Path) -> None:
    """The plan counts beyond 32 bits and says that it is too much; a run ends at once."""
    case = CASE.replace("&body", "! body").replace("&shape", "! shape")
    case = case.format(cells=cells, momentum=USUAL)
    done = run_text(tmp_path, case, "--check")
    bytes_, said = planned(done.stdout)
    assert bytes_ > least
    if sys.platform == "linux":
        assert "MORE than the" in said and "that this machine has left" in said
    done = run_text(tmp_path, case)
    assert done.returncode == 4, done.stderr
    assert re.match(r"mics: the run takes about \d[\d.e+]* TB of memory, ", done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["case.nml"]


def least() -> float:
    """The least memory in which the program itself starts, in MB [bytes]."""

    def starts(limit: float) -> bool:
        words = ["prlimit", f"--as={limit:.0f}", str(MICS), "--version"]
        return subprocess.run(words, capture_output=True).returncode == 0

    return next(1e6 * limit for limit in range(10, 60) if starts(1e6 * limit))


@pytest.mark.parametrize("limit", [None, 50e6, 200e6, 300e6, 314e6])
def test_limit_of_the_process(limit: float | None, tmp_path: Path) -> None:
    """`ulimit -v`, as queues set it: code 4 with what was asked, nothing written."""
    done = mics(tmp_path, "64, 64, 64", limit=limit or least() + 1e6)
    assert done.returncode == 4, done.stderr
    assert re.match(r"mics: the (run|program) takes .* MB of memory", done.stderr), done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["case.nml"]


@pytest.mark.parametrize("momentum", ["conservative", "c_ismac"])
@pytest.mark.parametrize("cells", ["40, 40, 40", "128, 1, 128"])
def test_what_is_planned_is_enough(cells: str, momentum: str, tmp_path: Path) -> None:
    """A run that may have what the plan says, and a little for the program's code, has enough."""
    plan, _ = planned(mics(tmp_path, cells, "--check", momentum=momentum).stdout)
    done = mics(tmp_path, cells, "--quiet", limit=1.05 * plan + 11e6, momentum=momentum)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_block_on_the_floor_has_enough(tmp_path: Path) -> None:
    """When a block leaves or meets the floor, all cells are in the lists of the band around it."""
    case = CASE.replace("kind = 'hexapod'", "kind = 'cube'").replace("size = 0.02", "size = 0.025")
    case = case.replace(
        "0.05, 0.05, 0.06", "0.05, 0.05, 0.0125  fixed = .true.  velocity = 0, 0, 0.3"
    )
    case = case.replace("t_end = 2.0e-3", "t_end = 1.0e-2")
    plan, _ = planned(mics(tmp_path, "48, 48, 48", "--check", case=case).stdout)
    done = mics(tmp_path, "48, 48, 48", "--quiet", limit=1.05 * plan + 11e6, case=case)
    assert (done.returncode, done.stderr) == (0, "")


HEIGHTS: dict[str, Callable[[int, int], float]] = {
    "rough": lambda i, j: 1 + 0.3 * math.sin(1e4 * math.sin(12.9898 * i + 78.233 * j)),
    "wavy": lambda i, j: 2 + math.sin(i / 40) * math.cos(j / 50),
    "even": lambda i, j: 0.5 + i / 300,
}


@pytest.mark.parametrize("form", HEIGHTS)
@pytest.mark.parametrize("physics", ["dry", "fluid"])
def test_a_bed_is_in_the_plan(form: str, physics: str, tmp_path: Path) -> None:
    """Within a fifth of what a run takes, and 330 B at most for each height more: what the program
    takes without any is another matter, which libraries change by megabytes."""
    taken = {}
    for n in (200, 400):
        rows = (" ".join(f"{HEIGHTS[form](i, j):.4f}" for i in range(n)) for j in range(n))
        (tmp_path / "bed.txt").write_text(f"{n} {n} 0 0 0.25 0.25\n" + "\n".join(rows))
        case = (
            f"&run t_end = 0.01  dt = 0.01  field_interval = 0  physics = '{physics}' /\n"
            f"&grid cells = 50, 50, 20  length = {(n - 1) / 4}, {(n - 1) / 4}, 20 /\n"
            "&fluid water_level = 9.1 /\n&bed file = 'bed.txt' /\n"
        )
        plan, _ = planned(run_text(tmp_path, case, "--check").stdout)
        _, _, taken[n] = timed([MICS, "--quiet", "case.nml"], tmp_path)
    assert 0.8 < plan / taken[400] < 1.2, (plan, taken)
    assert physics != "dry" or taken[400] - taken[200] < 330 * (400**2 - 200**2), taken


SMALL = TANK.replace("= 1 /", "= 0.01 /") + "&fluid water_level = 0.1 /\n"


def stack_of(size: int) -> partial[None]:
    """A limit of the stack [kB]."""
    return partial(resource.setrlimit, resource.RLIMIT_STACK, (size * 1024, size * 1024))


@pytest.mark.parametrize("name", ["blocks", "blocks_paper", "tetrapods"])
def test_a_small_stack_is_enough(name: str, tmp_path: Path) -> None:
    """Of 96 kB, also for each thread."""

    text = re.sub(r"t_end = \S+", "t_end = 0.06", (ROOT / "input" / f"{name}.nml").read_text())
    (tmp_path / "input").symlink_to(ROOT / "input")
    done = program("--quiet", cwd=tmp_path, input=text, threads=2, preexec_fn=stack_of(96))
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("size", ["2m", "1G", "", "k", "-1", "1.5M", "16kb"])
def test_a_stack_that_is_large_or_none(size: str, tmp_path: Path) -> None:
    """What the library takes as large, or does not take."""
    given = {**os.environ, "OMP_STACKSIZE": size}
    assert program("--check", cwd=tmp_path, input=SMALL, env=given).returncode == 0


@pytest.mark.parametrize("size", ["16k", " 16 K", "16", "16384B", "32k", "0"])
def test_a_stack_that_is_too_small_is_refused(size: str, tmp_path: Path) -> None:
    """Of a thread and of the program: exit code 2 and what is needed, nothing written."""
    done = program(cwd=tmp_path, input=SMALL, env={**os.environ, "OMP_STACKSIZE": size})
    assert done.returncode == 2
    assert f"environment variable OMP_STACKSIZE = '{size.rstrip()}': the stack" in done.stderr
    done = program(cwd=tmp_path, input=SMALL, preexec_fn=stack_of(60))
    assert done.returncode == 2
    assert "ulimit -s 60: the stack is too small, the program needs at least" in done.stderr
    assert list(tmp_path.iterdir()) == []
