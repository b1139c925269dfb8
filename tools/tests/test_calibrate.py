"""`mics-tools calibrate`: a coefficient that is known is found again."""

import json
from pathlib import Path

import numpy as np
import pytest

from calls import MICS, mics_tools, needs_mics
from micstools.cases import calibrate
from micstools.cases.calibrate import Calibration, Fall
from micstools.reading.reader import BadRun

CASE = """
&run t_end = 1 /
&grid cells = 1, 1, 1  length = 1, 1, 1 /
&shape name = 'other' kind = 'sphere' size = 1 /
&shape name = 'unit' kind = 'cube' size = 2.0 density = 2400 drag_coefficient = 9 /
"""


@needs_mics
def test_finds_what_is_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Light falls of C = 0.8 in place of resolved ones: 0.8 again, hardly any scatter or error."""
    truth = Calibration.fall

    def fall(self: Calibration, number: int, light: float | None = None) -> Fall:
        return truth(self, number, 0.8 if light is None else light)

    monkeypatch.setattr(Calibration, "fall", fall)
    monkeypatch.setattr(calibrate, "DEEP", (2.0, 3.0))
    case = tmp_path / "a.nml"
    case.write_text(CASE)
    words = ["calibrate", str(case), "--shape", "unit", "--falls", "2", "--program", str(MICS)]
    words += ["--set", "run.title=set"]
    assert mics_tools([*words, "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "calibrate.json").read_text())
    assert found["drag_coefficient"] == pytest.approx(0.8, rel=0.03)
    assert found["scatter"] < 0.03 and found["rms_speed"] < 0.02
    assert abs(found["mean_time"]) < 0.02 and abs(found["mean_impact"]) < 0.02
    assert len(found["falls"]) == 2 and found["falls"][1]["way"][-1] > found["falls"][0]["way"][-1]
    assert "drag_coefficient = 0." in capsys.readouterr().out


def test_errors_of_a_faster_fall() -> None:
    t = np.linspace(0, 1, 9)
    one, fast = (Fall(t / k, 10 * t, np.full(9, 10.0 * k)) for k in (1.0, 1.1))
    found = calibrate.errors(fast, one, 1.0)
    assert (found.speed, found.time, found.impact) == pytest.approx((0.1, -1 / 11, 0.1))


def test_a_shape_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BadRun, match="no such &shape; it has: other, unit"):
        Calibration(MICS, CASE, "block", tmp_path / "out")
    with pytest.raises(BadRun, match="cannot be read: a repeat count must be 1 to 1000"):
        Calibration(MICS, CASE + "&drop a = 999999999*0.1 /", "unit", tmp_path / "out")
