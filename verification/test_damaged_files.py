"""Files of strangers: damaged ones are refused or taken; extreme shapes run."""

import random
import re
from pathlib import Path

import pytest

from run_cases import ROOT
from shared_runs import texts
from soak.fuzz_files import FILES, KINDS, REFUSED, TAKEN, damaged, run, try_file
from test_messages import STARTS

PROGRAM = ROOT / "mics"
DAMAGED = 40
"""Files of each kind; `verification/soak/fuzz_files.py` tries as many as you like."""

TANK = """&run t_end = 0.002 dt = 0.001 physics = 'dry' field_interval = 0 /
&grid cells = 6, 4, 5  length = {0}, {0}, {0} /
&contact model = '{1}' /
"""


@pytest.mark.parametrize("kind", KINDS)
def test_good_files_are_taken(kind: str) -> None:
    """The damage makes the difference: before it every file is taken."""
    for seed in range(4):
        good = KINDS[kind].good(random.Random(seed))
        assert try_file(KINDS[kind], good, PROGRAM) == (TAKEN, "")


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(kind: str) -> None:
    """No crash, no foreign message, soon, in little memory; some files are still good."""
    codes = set()
    for seed in range(DAMAGED):
        data = damaged(KINDS[kind], random.Random(f"{kind} {seed}"))
        code, fault = try_file(KINDS[kind], data, PROGRAM)
        assert fault == "", f"{kind} {seed}"
        codes.add(code)
    assert REFUSED in codes
    assert codes <= {TAKEN, REFUSED, FILES}


@pytest.mark.parametrize("model", ["surface", "spheres"])
@pytest.mark.parametrize("given", texts("damaged_files")["extreme_shapes"])
def test_extreme_shapes_run(given: str, model: str, tmp_path: Path) -> None:
    """What is not refused makes its steps, in both contact models."""
    sizes = re.search(r"size = ([-+.,e\d ]+)", given)
    assert sizes
    length = min(max(4 * max(map(float, sizes[1].split(","))), 1.0), 1e6)
    place = f"position = {length / 2}, {length / 2}, {length / 2}"
    text = TANK.format(length, model) + f"&shape name = 'a' {given} /\n&body shape = 'a' {place} /"
    (tmp_path / "case.nml").write_text(text)
    assert run(PROGRAM, ["--quiet"], tmp_path) == (0, "")


def test_a_shape_beyond_all_sizes(tmp_path: Path) -> None:
    """A rod of 1000 m, in units of 1e9 m."""
    (tmp_path / "rod").write_text(STARTS["one"].replace("1 0 0  0", "1000 0 0  0"))
    shape = "&shape name = 'a' kind = 'file' file = 'rod' scale = 1e9 /"
    (tmp_path / "case.nml").write_text(TANK.format(1e6, "surface") + shape)
    code, errors = run(PROGRAM, ["--check"], tmp_path)
    assert code == 2 and "is 1e12 m long, it must be between 1e-6" in errors
