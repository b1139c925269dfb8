"""What is predicted of a fall: drag, shadow, terminal speed, the way to it, heights and speeds."""

import re
from pathlib import Path

import numpy as np
import pytest

from calls import MICS, needs_mics
from micstools.pages import falls, set_up
from micstools.reading.reader import BadRun
from micstools.shapes.shape import cube, hexapod

G = 9.81
MEAN = (3 + 6 * 2**0.5 + 4 * 3**0.5) / 13  # shadow of a cube over the thirteen directions


def test_forms() -> None:
    """Shadows and drag of forms that are known: settling_units gives 0.92 on a sphere's area."""
    block = cube(1.0)
    assert falls.mean_shadow(block) == pytest.approx(MEAN, rel=0.02)
    assert falls.surface(block) == pytest.approx(6.0)
    assert falls.surface(hexapod(1.0)) == pytest.approx(30.0)
    assert falls.drag_coefficient(1.0, 6.0) * 1.23 == pytest.approx(0.92, rel=0.01)
    assert falls.drag_coefficient(np.pi / 6, np.pi) == pytest.approx(0.42, rel=1e-6)
    pull = 0.5 * 1000 * 0.3 * falls.terminal_speed(2.5, 1.0, 0.3, G) ** 2
    assert pull == pytest.approx(1500 * G, rel=1e-9)


@pytest.mark.parametrize("start", [0.0, 6.0, 12.0])
def test_speed_after_a_way(start: float) -> None:
    """As that of stepping the equation of motion, with the added mass of a sphere."""
    area, dt, v, z = 1.2, 1e-4, start, 0.0
    while z < 1.5:
        half = v + 0.5 * dt * (1500 * G - 500 * area * v**2) / 3000
        before, v = v, v + dt * (1500 * G - 500 * area * half**2) / 3000
        z += 0.5 * dt * (before + v)
    assert falls.speed_after_water(2.5, 1.0, area, G, start, 1.5) == pytest.approx(v, rel=1e-3)
    assert falls.speed_after_water(2.5, 1.0, area, G, start, 0.0) == pytest.approx(start)
    end = falls.terminal_speed(2.5, 1.0, area, G)
    assert falls.speed_after_water(2.5, 1.0, area, G, start, 1e3) == pytest.approx(end)


BASIN = """&run t_end = 10 {run} /
&grid cells = 40, 40, 40  length = 4, 4, 4 /
&boundary {sides} /
&fluid {fluid} /
&shape name = 'cube'  kind = 'cube'  size = 1 /
&shape name = 'ball'  kind = 'sphere'  size = 1  density = 500 /
{blocks}
"""
CUBE = "&drop shape = 'cube'  position = "


def told(blocks: str, fluid: str = "water_level = 2", sides: str = "", run: str = "") -> str:
    """What is said of the falls in a basin of 4 m."""
    text = BASIN.format(blocks=blocks, fluid=fluid, sides=sides, run=run)
    try:
        with set_up.read(MICS, text) as found:
            parts = [part for part in found.plan if part.heading == "Falls"]
    except set_up.Refused as refused:
        raise BadRun(str(refused)) from None
    return "\n".join(f"{name} {words}" for part in parts for name, words in part.pairs)


def speed(said: str, start: str) -> float:
    """The speed that is told [m/s]."""
    found = re.search(re.escape(start) + r" (\S+) m/s", said)
    assert found, said
    return float(found[1])


@needs_mics
def test_falls_are_predicted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Height, depth and cells; free fall in air; under water the estimate."""
    said = told(f"{CUBE} 2, 2, 6.5  velocity = 0, 0, -1 /")
    high = "lowest point 6 m above the floor, 4 m above the water; water 2 m deep there, 20 cells"
    assert high in said
    enters = (1 + 2 * G * 4) ** 0.5
    assert speed(said, "meets the water at") == pytest.approx(enters, rel=0.01)
    s, pull = 2300 / 998.2, falls.drag_coefficient(1.0, 6.0) * MEAN
    end = falls.terminal_speed(s, 1.0, pull, G)
    assert speed(said, "a long fall in water ends at about") == pytest.approx(end, rel=0.03)
    floor = falls.speed_after_water(s, 1.0, pull, G, enters, 2.0)
    assert speed(said, "meets the floor at about") == pytest.approx(floor, rel=0.03)

    said = told(f"{CUBE} 2, 2, 6.5 /", run="physics = 'dry'", fluid="")
    assert "lowest point 6 m above the floor;" in said
    assert speed(said, "meets the floor at") == pytest.approx((2 * G * 6) ** 0.5, rel=0.01)
    said = told(f"{CUBE} 2, 2, 2  count = 3 /")
    assert "the first of 3: lowest point 1.5 m above the floor, 0.5 m under water" in said
    assert "meets the water" not in said
    said = told(f"{CUBE} 2, 2, 3  axis = 1, 0, 0  angle_deg = 45 /")
    assert f"lowest point {3 - 0.5**0.5:.3g} m above the floor" in said
    said = told("&body shape = 'ball'  position = 2, 2, 3 /")
    assert "&body on line 7 lowest point 2.5 m above the floor, 0.5 m above the water" in said
    assert "is lighter than the liquid and floats" in said
    said = told(f"{CUBE} 2, 2, 5 /", "single_phase = .true.")
    assert "0.5 m above the water; water 4 m deep there, 40 cells" in said
    said = told(f"{CUBE} 2, 2, 3 /", sides="z_min = 'open'")
    assert "lowest point at 2.5 m, 0.5 m above the water; water 2 m deep there, 20 cells" in said
    assert "if no block is in its way" not in said and "a long fall" in said
    end = "a long fall in water ends at about"
    said = told(f"{CUBE} 2, 2, 3 /", run="physics = 'light'")
    light = (2 * (2300 / 998.2 - 1) * G / (0.55 * 2)) ** 0.5
    assert speed(said, end) == pytest.approx(light, rel=0.02)
    said = told(
        "&body shape = 'ball'  position = 2, 2, 3 /", "water_level = 2 liquid_density = 250"
    )
    assert speed(said, end) == pytest.approx((4 / 3 * G / 0.42) ** 0.5, rel=0.02)
    said = told(f"{CUBE} 2, 2, 3 /", "gravity = 1, 0, -9  water_level = 2")
    assert "lowest point 2.5 m" in said and "m/s" not in said
    assert told("&body shape = 'cube' position = 2,2,2 fixed = T /") == ""
    monkeypatch.chdir(tmp_path)
    Path("bed.txt").write_text("2 2 0 0 4 4\n0 2 0 2\n")
    said = told(f"&bed file = 'bed.txt' / {CUBE} 3, 2, 3 /")
    high = "lowest point 1 m above the bed, 0.5 m above the water; water 0.5 m deep there, 5 cells"
    assert high in said
    Path("plan.csv").write_text("shape,x,y,z,time,fixed\ncube,1,1,,1,0\ncube,2,1,3,2,1\n")
    said = told("&drop file = 'plan.csv' /")
    assert (
        "the first of 2: is set on what lies there; places from plan.csv: 2 rows, 1 fixed" in said
    )


@needs_mics
def test_a_block_on_a_crane_does_not_fall() -> None:
    lowered = CUBE + "2, 2, 3  if_blocked = 'raise'  lowering_speed = 0.5  release = "
    said = told(lowered + "'height'  release_height = 0.2 /")
    assert "lowered at 0.5 m/s, let go 0.2 m over what lies below" in said
    assert "raised above what lies there" in said and "meets the" not in said
    assert "where it touches" in told(lowered + "'touch' /")
