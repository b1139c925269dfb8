"""Units that pass an open side: they are out, and the run goes on as if they had gone."""

from pathlib import Path

import numpy as np
import pytest

from micstools.piles.pile import at_rest
from micstools.reading import places
from micstools.reading.reader import Run
from shared_runs import told

SLIDE = """&run physics = '{physics}'  t_end = 1  dt = 0.01 /
&fluid water_level = 0.9 /
&grid cells = 8, 8, 8  length = 1, 1, 1 /
&boundary {side} /
&shape name = 'a'  kind = 'cube'  size = 0.1 /
&body shape = 'a'  position = 0.2, 0.2, 0.05 /
&body shape = 'a'  position = {place}  velocity = {velocity} /
"""
STREAM = "y_max = 'inflow'  y_max_velocity = 0, -1, 0  x_max = 'outflow'"
RIVER = """&run t_end = 0.8  dt = 0.01  history_interval = 0 /
&grid cells = 30, 12, 18  length = 0.6, 0.24, 0.36 /
&boundary x_min = 'inflow'  x_min_velocity = 0.3, 0, 0  x_max = 'outflow'  z_max = 'open' /
&fluid water_level = 0.2  velocity = 0.3, 0, 0 /
&shape name = 'a'  kind = 'cube'  size = 0.08  density = 1100 /
&body shape = 'a'  position = 0.45, 0.12, 0.1  velocity = 0.5, 0, 0 /
"""


def run(work: Path, case: str, *options: str) -> tuple[int, str, Run]:
    """Exit code, messages and results of a run."""
    return *told(work, case, *options), Run(work / "mics-out")


@pytest.mark.parametrize(
    ("physics", "side", "place", "velocity", "axis", "at"),
    [
        ("dry", "x_max = 'open'", "0.8, 0.5, 0.5", "1.5, 0, 0", 0, 1.0),
        ("dry", "y_min = 'open'", "0.5, 0.3, 0.5", "0, -2, 0", 1, 0.0),
        ("light", STREAM, "0.8, 0.5, 0.5", "2.5, 0, 0", 0, 1.0),
        ("light", STREAM, "0.5, 0.8, 0.5", "0, 2.5, 0", 1, 1.0),
    ],
)
def test_out_through_a_side(
    physics: str, side: str, place: str, velocity: str, axis: int, at: float, tmp_path: Path
) -> None:
    """Within a step of the side it stops to count, with the place and the speed of then. The block
    at rest in the tank is the only one that is left."""
    case = SLIDE.format(physics=physics, side=side, place=place, velocity=velocity)
    code, said, found = run(tmp_path, case)
    b = found.bodies
    assert code == 0 and said.count("is out") == 1, said
    assert list(b.status) == [2, 4]
    assert list(b.released(-1)) == [True, True] and list(b.present(-1)) == [True, False]
    gone = b.time >= b.exit_time[1]
    moved = 0.01 * abs(b.velocity[-1, 1, axis])
    assert 0 < gone.sum() < gone.size and moved > 0.01
    assert abs(b.position[-1, 1, axis] - at) <= moved
    for values in (b.position, b.velocity, b.contact_force):
        assert np.ptp(values[gone, 1], axis=0).max() == 0
    stays, out = places.places(found)
    assert stays.at_rest == 1 and out.at_rest == 0 and out.exit_time == b.exit_time[1]
    assert places.within([stays, out], 10.0).count == 1
    assert at_rest(found).figures.endswith("1 out of the tank")


def test_water_comes_in_its_place(tmp_path: Path) -> None:
    """A cube drifts out of a river: water of its volume comes in, on the books, without a jolt."""
    code, said, found = run(tmp_path, RIVER)
    s, b = found.series, found.bodies
    out = int(np.searchsorted(s.time, b.exit_time[0]))
    assert code == 0 and "body 1 is out" in said, said
    assert 0 < out < len(s.time) - 5
    left = 0.08**3 * (0.5 - (b.position[out, 0, 0] - 0.6) / 0.08)  # of it, still in the tank
    gained = np.diff(s.liquid_volume)[out] - np.median(np.diff(s.liquid_volume)[out + 1 : out + 6])
    assert gained == pytest.approx(left, rel=0.1)
    assert np.abs(s.liquid_volume_drift).max() < 1e-13
    energy = s.kinetic_energy_fluid
    assert abs(energy[out + 1] / energy[out] - 1) < 0.03
    assert np.abs(np.diff(energy[out + 1 :]) / energy[out]).max() < 0.01


def test_a_restart_keeps_it_out(tmp_path: Path) -> None:
    """Gone on with from a file written after it went, the run has the same rows."""
    case = SLIDE.format(
        physics="dry", side="x_max = 'open'", place="0.8, 0.5, 0.5", velocity="1.5, 0, 0"
    )
    _, _, whole = run(tmp_path, case)
    wanted = whole.bodies.position, whole.bodies.exit_time
    longer = case.replace("&run", "&run output = 'half'")
    run(tmp_path, longer.replace("t_end = 1", "t_end = 0.5"))
    file = Run(tmp_path / "half").restart_files[0]
    code, _, _ = run(tmp_path, longer, "--restart", f"half/{file}")
    again = Run(tmp_path / "half").bodies
    assert code == 0
    assert np.array_equal(again.position, wanted[0]) and np.array_equal(again.exit_time, wanted[1])
