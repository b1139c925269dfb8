"""What `--check` foresees: falls, levels, volumes, and warnings set apart at the end."""

import re
from pathlib import Path

import numpy as np
import pytest

from run_cases import ROOT
from test_input import mics


def warnings_of(plan: str) -> list[str]:
    """The warnings of a plan, which stand under a heading at its end."""
    lines = plan.splitlines()
    if "Warnings" not in lines:
        assert "warning" not in plan
        return []
    warnings = lines[lines.index("Warnings") + 1 :]
    assert all(line.startswith("  warning: ") for line in warnings)
    assert plan.count("warning") == len(warnings)
    return [line.removeprefix("  warning: ") for line in warnings]


BASIN = """&run t_end = 10 /
&grid cells = 40, 40, 40  length = 4, 4, 4 /
&boundary {sides} /
&fluid {fluid} /
&shape name = 'cube'  kind = 'cube'  size = 1 /
&shape name = 'ball'  kind = 'sphere'  size = 1  density = 500 /
{blocks}
"""


def plan_of(
    tmp_path: Path, blocks: str, fluid: str = "water_level = 2", sides: str = "", run: str = ""
) -> str:
    """The plan of a basin of 4 m, blanks in a row made one."""
    text = BASIN.format(blocks=blocks, fluid=fluid, sides=sides).replace("= 10 /", f"= 10 {run} /")
    done = mics(["--check"], tmp_path, text)
    assert (done.returncode, done.stderr) == (0, "")
    return "\n".join(" ".join(line.split()) for line in done.stdout.splitlines())


CUBE = "&drop shape = 'cube'  position = "


@pytest.mark.parametrize("physics", ["dry", "fluid"])
def test_other_physics_is_tried_on_a_case_as_it_is(physics: str, tmp_path: Path) -> None:
    """What has no meaning then is passed over with warnings, by plan and run."""
    text = (ROOT / "input" / "blocks_paper.nml").read_text()
    text = text.replace("t_end = 10.0", f"t_end = 0.01  physics = '{physics}'")
    passed = {
        "dry": ["&numerics: has no", "&run cfl_max: has no", "&fluid water_level: has no"],
        "fluid": [
            "&contact: has no",
            "&shape: has no",
            "3 groups &body: have no",
            "&drop: has no",
            "&numerics solid_fraction, subcells: have no",
        ],
    }[physics]
    done = mics(["--check"], tmp_path, text)
    assert (done.returncode, done.stderr) == (0, "")
    assert [w[: w.index(" meaning")] for w in warnings_of(done.stdout) if "passed over" in w] == [
        w.removesuffix(" meaning") for w in passed
    ]
    done = mics(["--quiet"], tmp_path, text)
    assert done.returncode == 0
    said = done.stderr.splitlines()
    assert len(said) == len(passed)
    for line, start in zip(said, passed, strict=True):
        assert line.startswith(f"mics: warning: {start} meaning with physics = '{physics}'")


def test_warnings_stand_last(tmp_path: Path) -> None:
    """Those of shapes, of times and of memory, too."""
    text = (ROOT / "input" / "blocks_paper.nml").read_text().replace("t_end = 10.0", "t_end = 2.5")
    warnings = warnings_of(mics(["--check"], tmp_path, text).stdout)
    assert len(warnings) == 3
    assert warnings[0].startswith("&drop count = 6: 3 are due only after the end of the run")
    assert "cells long" in warnings[1] and "contact spheres reach up to" in warnings[2]


def test_level_rises_only_where_water_stays(tmp_path: Path) -> None:
    """Drops and late bodies raise it; not with open sides, or on a slope out of the water."""
    late = "&body shape = 'cube'  position = 1, 1, 0.5  release_time = 1 /"
    there = "&body shape = 'cube'  position = 3, 1, 0.5 /"
    blocks = f"{CUBE} 2, 2, 3  count = 2  interval = 3 / {late} {there}"
    rise = "water level rises by 0.1875 m if all that comes later ends under water"
    assert f"{rise}\n" in plan_of(tmp_path, blocks)
    assert f"{rise}, over the top of the tank\n" in plan_of(tmp_path, blocks, "water_level = 3.9")
    assert f"{rise}\n" in plan_of(tmp_path, blocks, sides="y_min = 'slip'  y_max = 'slip'")
    assert "rises" not in plan_of(tmp_path, there)
    for sides in ("x_max = 'outflow'", "y_min = 'open'", "z_min = 'open'"):
        assert "rises" not in plan_of(tmp_path, blocks, sides=sides)
    assert "rises" not in plan_of(tmp_path, blocks, "single_phase = .true.")
    (tmp_path / "low.txt").write_text("2 2 0 0 4 4\n0 0 1 1\n")
    high = "&bed file = 'low.txt' /" + CUBE + "2, 2, 3 /"
    assert "rises by 0.0625 m" in plan_of(tmp_path, high)
    assert "rises" not in plan_of(tmp_path, high, "water_level = 0.99")


@pytest.mark.parametrize(
    ("heights", "volume"),
    [("0.5 0.5 0.5 0.5", 32 - 8), ("0 4 0 4", 8), ("0 0 3 3", 32 - 64 / 3)],
    ids=["flat", "slope to the top", "slope out of the water"],
)
def test_the_bed_is_no_water(heights: str, volume: float, tmp_path: Path) -> None:
    """The volume below the level is that over the bed."""
    (tmp_path / "bed.txt").write_text(f"2 2 0 0 4 4\n{heights}\n")
    plan = plan_of(tmp_path, "&bed file = 'bed.txt' /")
    found = re.search(r"water level 2 m; (\S+) m3 below it without the bed, bodies included", plan)
    assert found and float(found[1]) == pytest.approx(volume, rel=1e-3)
    assert "water level 2 m; 32 m3 below it, bodies included" in plan_of(tmp_path, "")


def test_places_far_from_zero_keep_their_digits(tmp_path: Path) -> None:
    """Coordinates of a survey are told to a ten-thousandth of the tank."""
    text = """&run t_end = 1 /
&grid cells = 8, 8, 8  length = 4, 4, 4  origin = 354207.125, 5621083.5, 1012.25 /
&fluid water_level = 1014.375 /
"""
    done = mics(["--check"], tmp_path, text)
    assert (done.returncode, done.stderr) == (0, "")
    said = " ".join(done.stdout.split())
    assert "lower corner 354207.125, 5621083.5, 1012.25 m" in said
    assert "water level 1014.375 m;" in said


def test_a_box_of_water_has_a_volume(tmp_path: Path) -> None:
    """The part of it in the tank; several may overlap."""
    box = "&water min = -1, 0, 0  max = 2, 4, 1 /"
    assert "boxes of liquid 1, 8 m3, bodies included\n" in plan_of(tmp_path, box, "")
    assert "boxes of liquid 2\n" in plan_of(tmp_path, 2 * box, "")


def speed(plan: str, start: str) -> float:
    """The speed that a plan tells [m/s]."""
    found = re.search(re.escape(start) + r" (\S+) m/s", plan)
    assert found, plan
    return float(found[1])


def test_falls_are_predicted(tmp_path: Path) -> None:
    """Height, depth and cells; free fall in air; under water the estimate of the plan."""
    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 6.5  velocity = 0, 0, -1 /")
    assert (
        "lowest point 6 m above the floor, 4 m above the water; water 2 m deep there, 20 cells"
        in plan
    )
    enters = (1 + 2 * 9.81 * 4) ** 0.5
    assert speed(plan, "meets the water at") == pytest.approx(enters, rel=0.01)
    s, sphericity = 2300 / 998.2, (np.pi * 6**2) ** (1 / 3) / 6
    drag = 0.42 * 10 ** (0.4 * (-np.log10(sphericity)) ** 0.2)
    area = (3 * 1 + 6 * 2**0.5 + 4 * 3**0.5) / 13
    terminal = (2 * (s - 1) * 9.81 / (drag * area)) ** 0.5
    assert speed(plan, "a long fall in water ends at about") == pytest.approx(terminal, rel=0.03)
    fade = np.exp(-2 * drag * area / (s + 0.5))
    floor = (terminal**2 + (enters**2 - terminal**2) * fade) ** 0.5
    assert speed(plan, "meets the floor at about") == pytest.approx(floor, rel=0.03)
    assert "v_t^2 = 2 (s - 1) g V / (C A)" in plan and "Hoelzer and Sommerfeld" in plan

    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 6.5 /", run="physics = 'dry'", fluid="")
    assert "lowest point 6 m above the floor\n" in plan
    assert speed(plan, "meets the floor at") == pytest.approx((2 * 9.81 * 6) ** 0.5, rel=0.01)
    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 2  count = 3 /")
    assert "the first of 3: lowest point 1.5 m above the floor, 0.5 m under water" in plan
    assert "meets the water" not in plan
    plan = plan_of(tmp_path, "&body shape = 'ball'  position = 2, 2, 3 /")
    assert "&body on line 7 lowest point 2.5 m above the floor, 0.5 m above the water" in plan
    assert "is lighter than the liquid and floats" in plan
    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 3 /", "single_phase = .true.")
    assert "under water; water 4 m deep there, 40 cells" in plan
    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 5 /", "single_phase = .true.")
    assert "0.5 m above the water; water 4 m deep there, 40 cells" in plan
    (tmp_path / "bed.txt").write_text("2 2 0 0 4 4\n0 2 0 2\n")
    plan = plan_of(tmp_path, f"&bed file = 'bed.txt' / {CUBE} 3, 2, 3 /")
    assert (
        "lowest point 1 m above the bed, 0.5 m above the water; water 0.5 m deep there, 5 cells"
        in plan
    )
    plan = plan_of(tmp_path, f"{CUBE} 2, 2, 3 /", sides="z_min = 'open'")
    assert "lowest point at 2.5 m, 0.5 m above the water; water 2 m deep there, 20 cells" in plan
    assert "if no block is in its way" not in plan
    assert "Falls" not in plan_of(tmp_path, "&body shape = 'cube' position = 2,2,2 fixed = T /")


def test_a_block_on_a_crane_does_not_fall(tmp_path: Path) -> None:
    lowered = CUBE + "2, 2, 3  lowering_speed = 0.5  release = "
    plan = plan_of(tmp_path, lowered + "'height'  release_height = 0.2 /")
    assert "lowered at 0.5 m/s, let go 0.2 m over what lies below" in plan
    assert "meets the" not in plan
    assert "where it touches" in plan_of(tmp_path, lowered + "'touch' /")


def test_a_drop_far_above_the_tank_is_asked_about(tmp_path: Path) -> None:
    """From half its height on."""
    assert "warning" not in plan_of(tmp_path, f"{CUBE} 2, 2, 6.4 /")
    assert (
        "warning: &drop position = 2, 2, 40: begins 35.5 m above the tank, which is 4 m high; "
        "is that meant? (line 7)" in plan_of(tmp_path, f"{CUBE} 2, 2, 40 /")
    )
    bodies = "".join(f"&body shape = 'cube' position = 2, 2, {z} /\n" for z in range(10, 30, 2))
    assert plan_of(tmp_path, bodies).count("warning: &body position") == 5


def test_contact_without_effect_is_warned_of(tmp_path: Path) -> None:
    """Films without a sphere, contact spheres beside the exact surface."""
    box = "&shape name = 'box' kind = 'box' size = 1, 1, 1 {} /"
    tank = "&run t_end = 1 / &grid cells = 40, 40, 40 length = 4, 4, 4 / &fluid water_level = 2 /"
    for shape, contact, warning in (
        ("", "lubrication = T", "&contact lubrication = .true.: has no effect"),
        ("spheres = 'dense'", "", "&shape spheres = 'dense': of box: no sphere touches"),
        ("", "", None),
        ("spheres = 'centroid'", "", None),
    ):
        plan = mics(["--check"], tmp_path, f"{tank}{box.format(shape)} &contact {contact} /").stdout
        found = warnings_of(plan)
        assert found == [] if warning is None else [w.startswith(warning) for w in found] == [True]
    assert "lubrication" not in plan_of(tmp_path, "&contact lubrication = T /")


def test_one_phase_beside_an_open_side_flows_from_rest(tmp_path: Path) -> None:
    """Where gravity acts along it."""
    warning = "warning: &boundary x_max = 'open': gravity acts along it and the pressure on it is 0"
    full = "single_phase = .true."
    assert warning in plan_of(tmp_path, "", full, "x_max = 'open'")
    for fluid, sides in (
        (full, ""),
        (f"{full} gravity = 3*0", "x_max = 'open'"),
        (full, "x_max = 'outflow'"),
        ("water_level = 2", "x_max = 'open'"),
    ):
        assert "flows from rest" not in plan_of(tmp_path, "", fluid, sides)
