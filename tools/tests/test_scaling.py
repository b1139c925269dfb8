"""What the model of many processes says where the answer is known."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

from micstools import cli, messages, scaling
from micstools.messages import Asked

ROOT = Path(__file__).parents[2]
DOMAIN = messages.Domain((64, 64, 64), (0.1, 0.1, 0.1), (False, False, False))
NOTHING = np.zeros(len(messages.KINDS), np.int64)


def measured(*asked: Asked) -> scaling.Measured:
    """One step of a microsecond a cell and a millisecond besides, that asked for something."""
    counted = messages.Counted(1, 1, DOMAIN, list(asked), NOTHING, NOTHING, NOTHING, NOTHING)
    return scaling.Measured(counted, per_cell=1e-6, own=1e-3)


def network(latency: float, bandwidth: float) -> scaling.Network:
    return scaling.Network("", latency, bandwidth, per_node=1)


def test_work_alone() -> None:
    """Nothing to pass: the work is divided, what every process does in full is not."""
    one, eight = scaling.strong(measured(), (64, 64, 64), (1, 8), network(1.0, 1.0))
    assert one.total == pytest.approx(64**3 * 1e-6 + 1e-3)
    assert eight.total == pytest.approx(64**3 / 8 * 1e-6 + 1e-3)


def test_layers_between_two() -> None:
    """One layer of doubles between two halves: 66 x 66 cells, the halo counted."""
    wanted = measured(*[Asked("halo", (8, 1, d), 1) for d in (1, 2, 3)])
    (step,) = scaling.strong(wanted, (64, 64, 64), (2,), network(1e-3, 1e6))
    assert step.pieces == (1, 1, 2)
    assert step.halo == pytest.approx(1e-3 + 8 * 66 * 66 / 1e6)
    assert step.reduction == step.gather == step.coarse == 0.0


@pytest.mark.parametrize(("ranks", "rounds"), [(2, 1), (3, 2), (8, 3), (1000, 10)])
def test_reductions(ranks: int, rounds: int) -> None:
    wanted = measured(Asked("reduction", (128, 0, 0), 5))
    (step,) = scaling.strong(wanted, (640, 640, 640), (ranks,), network(1e-6, 1e9))
    assert step.reduction == pytest.approx(5 * rounds * (1e-6 + 128e-9))


def test_levels_put_together() -> None:
    """Blocks of 32 cells: 32, 16, 8, 4 stay, the level of 2 x 2 x 2 each comes together."""
    wanted = measured(Asked("cycle", (0, 0, 0), 3))
    (step,) = scaling.strong(wanted, (64, 64, 64), (8,), network(0.0, 1e6))
    fine = messages.blocks(DOMAIN, 8)
    *cut, last = messages.levels(DOMAIN, fine)
    assert [level.cut for level in cut] == [True] * len(cut) and not last.cut
    cells = math.prod(last.cells)
    assert step.gather == pytest.approx(3 * (8 * 24 + 4 * cells) / 1e6)
    assert step.coarse > 0.0


def test_weak_needs_as_much_work() -> None:
    steps = scaling.weak(measured(), 32, (1, 8, 64, 1000), network(0.0, 1.0))
    assert [step.cells for step in steps] == [32**3] * 4
    assert "100 %" in scaling.table(steps, True).splitlines()[-1]


@pytest.mark.skipif(not (ROOT / "mics").exists(), reason="./mics is not built")
def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From a run to a table; a run of several threads is refused."""
    case = ROOT / "verification" / "cases" / "ranks" / "stream.nml"
    for threads in ("1", "2"):
        call = [
            ROOT / "mics",
            "--quiet",
            "--threads",
            threads,
            "--output",
            tmp_path / threads,
            case,
        ]
        subprocess.run(call, check=True, capture_output=True, timeout=60)
    with pytest.raises(SystemExit) as end:
        cli.main(["scaling", str(tmp_path / "1"), "--cells", "320,320,320", "--ranks", "1,1000"])
    said = capsys.readouterr().out
    assert not end.value.code
    assert "32768000 cells" in said and "| 1000 | " in said.splitlines()[-1]
    with pytest.raises(SystemExit) as end:
        cli.main(["scaling", str(tmp_path / "2")])
    assert end.value.code == 2
    assert "one process with one thread" in capsys.readouterr().err
