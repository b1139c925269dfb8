"""A box slides over two bars, flush: only friction slows it."""

from pathlib import Path

import pytest

from shared_runs import results

SLOPE, FRICTION, G = 0.6, 0.5, 9.81
DOWN = G / (1 + SLOPE**2) ** 0.5
"""Weight per mass across the slope [m/s2]."""
CASE = f"""&run physics = 'dry'  t_end = 0.52  dt = 0.02 /
&grid cells = 40, 40, 20  length = 0.4, 0.4, 0.2 /
&fluid gravity = 0, {SLOPE * DOWN}, {-DOWN} /
&contact solver = '{{solver}}'  contact_time = 0.002  friction = {FRICTION}  sleep = F /
&shape name = 'bar'  kind = 'box'  size = 0.02, 0.3, 0.02  density = 2300 /
&shape name = 'box'  kind = 'box'  size = 0.12, 0.02, 0.02  density = 2300 /
&body shape = 'bar'  position = 0.17, 0.2, 0.05  fixed = T /
&body shape = 'bar'  position = 0.23, 0.2, 0.05  fixed = T /
&body shape = 'box'  position = 0.2, 0.2, 0.070002 /
"""


@pytest.mark.parametrize("solver", ["springs", "impulses"])
def test_only_friction_slows_a_box(solver: str, tmp_path: Path) -> None:
    """Over .1 m it gains g (sin - mu cos) t, within 1 %, and does not turn."""
    with results(tmp_path, CASE.format(solver=solver)) as h5:
        time, velocity, spin = (
            h5[f"bodies/{name}"][:] for name in ("time", "velocity", "angular_velocity")
        )
    gained = (velocity[-1, 2, 1] - velocity[5, 2, 1]) / (time[-1] - time[5])
    assert gained == pytest.approx(DOWN * (SLOPE - FRICTION), rel=0.01)
    assert abs(spin[:, 2]).max() < 0.01
