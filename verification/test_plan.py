"""What `--check` foresees: levels, volumes, and warnings set apart at the end."""

import re
import resource
from pathlib import Path

import pytest

from micstools.cases.program import case_text
from micstools.reading.reader import Run
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
{blocks}
"""


def plan_of(tmp_path: Path, blocks: str, fluid: str = "water_level = 2", sides: str = "") -> str:
    """The plan of a basin of 4 m, blanks in a row made one."""
    done = mics(["--check"], tmp_path, BASIN.format(blocks=blocks, fluid=fluid, sides=sides))
    assert (done.returncode, done.stderr) == (0, "")
    return "\n".join(" ".join(line.split()) for line in done.stdout.splitlines())


CUBE = "&drop shape = 'cube'  position = "


def test_contact_is_solved_as_the_model_asks(tmp_path: Path) -> None:
    """By impulses between surfaces, by springs between contact spheres; nothing else is."""
    case = BASIN.format(blocks=f"{CUBE}2, 2, 3 /", fluid="water_level = 2", sides="")
    for model, step in ("", "contact"), ("model = 'spheres'", "body"):
        assert f"{step} step" in mics(["--check"], tmp_path, f"{case}&contact {model} /\n").stdout
    idle = mics(["--check"], tmp_path, case + "&contact substep_ratio = 0.1 /\n").stdout
    assert "&contact substep_ratio: has no meaning with solver = 'impulses', passed over" in idle


@pytest.mark.cost(10)
@pytest.mark.parametrize(("case", "t_end"), [("crane", 99), ("mound", 3), ("blocks", 10)])
def test_the_time_of_a_light_run(case: str, t_end: float, tmp_path: Path) -> None:
    """It takes between the told time over 2.5 and 2.5 times that, on one core."""
    text = case_text(ROOT / "input" / f"{case}.nml", ["run.physics=light", f"run.t_end={t_end}"])
    (tmp_path / "input").symlink_to(ROOT / "input")
    plan = mics(["--check"], tmp_path, text).stdout
    told, unit = re.findall(r"time of the run +about ([\d.]+) (s|minutes)", plan)[0]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    mics(["--quiet", "--threads", "1"], tmp_path, text)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    ratio = took / (float(told) * (60 if unit == "minutes" else 1))
    assert 1 / 2.5 < ratio < 2.5, f"told {told} {unit}, took {took:.2f} s of CPU"


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


def test_what_is_idle_is_not_taken(tmp_path: Path) -> None:
    """A level without a surface, and how long to wait for a rest that ends nothing."""
    text = """&run t_end = 0.001  dt = 0.001  rest_time = 9  field_interval = 0 /
&grid cells = 4, 4, 4  length = 1, 1, 1 /
&fluid single_phase = .true.  water_level = 0.5 /
"""
    assert mics(["--quiet"], tmp_path, text).returncode == 0
    run = Run(tmp_path / "mics-out")
    assert (run.value("run", "rest_time"), run.value("fluid", "water_level")) == (0.5, None)


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
