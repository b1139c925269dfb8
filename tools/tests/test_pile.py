"""The findings on piles whose truth is known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from micstools.piles import pile
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import LABORATORY
from synthetic import UPRIGHT, Motion


def places(*first: tuple[float, float, float]) -> list:
    return [(np.array(xyz), UPRIGHT) for xyz in first]


def test_turning_counts_only_what_happens_before_the_first_touch(make_run) -> None:
    run = make_run(Motion(turn_in_fall=3.0, t_end=7.0, field_step=7.0))
    turns = pile.turning_before_touch(run)
    assert list(turns) == [3, 4, 5, 6, 7, 8]
    assert max(turns.values()) == pytest.approx(3.0, abs=0.3)
    assert pile.turning(run).seen
    assert not pile.turning(make_run(Motion(turn_in_fall=8.0, t_end=7.0, field_step=7.0))).seen


def test_first_block_on_a_fixed_block_and_a_wall(make_run) -> None:
    top = 0.0288675 * 2  # highest corners of a fixed block
    on_fixed = (0.09, 0.0698, top + 0.0302)
    run = make_run(Motion(places=places(on_fixed, (0.25, 0.05, 0.12)), t_end=3.0, field_step=3.0))
    before, end = pile.first_block(run)
    assert before.seen and end.seen
    assert "fixed blocks [1], walls ['y_max']" in before.figures
    free = make_run(Motion(places=places((0.09, 0.05, 0.12)), t_end=2.0, field_step=2.0))
    assert [f.seen for f in pile.first_block(free)] == [False]


@pytest.mark.parametrize(
    ("heights", "kind"), [((0.12, 0.12), "A"), ((0.0301, 0.12), "B"), ((0.03, 0.0303), "other")]
)
def test_patterns(make_run, heights: tuple[float, float], kind: str) -> None:
    ends = places((0.031, 0.05, heights[0]), (0.269, 0.05, heights[1]))
    run = make_run(Motion(places=ends, t_end=3.0, field_step=3.0))
    assert pile.classify(run)[0] == kind
    assert pile.pattern(run).seen == (kind == "A")


def test_a_pile_with_blocks_still_to_come_is_no_pattern(make_run) -> None:
    run = make_run(Motion(t_end=2.5, field_step=2.5))
    assert pile.classify(run)[0] == "other"
    assert not pile.at_rest(run).seen


def test_a_block_that_waits_for_room_is_not_there(make_run) -> None:
    motion = Motion(places=places((0.06, 0.05, 0.12), (0.15, 0.05, 0.16)), t_end=3.0)
    run = make_run(motion)  # the second one stays at its starting pose without any force
    assert run.bodies.release_time[-1] == np.inf
    assert run.bodies.present(-1).tolist() == [True] * 4 + [False]
    assert pile.classify(run) == ("other", [])
    assert "1 of 2 released" in pile.pattern(run).figures
    assert list(pile.turning_before_touch(run)) == [3]


def test_front_and_back_walls(make_run) -> None:
    ends = places((0.06, 0.0303, 0.12), (0.2, 0.0697, 0.12))
    run = make_run(Motion(places=ends, t_end=3.0, field_step=3.0))
    found = pile.walls(run)
    assert found.seen
    assert found.figures == "y_min: blocks [4], y_max: blocks [5]"
    only_front = make_run(Motion(places=ends[:1], t_end=2.0, field_step=2.0))
    assert not pile.walls(only_front).seen


def test_moving_blocks_are_not_at_rest(make_run) -> None:
    still = make_run(Motion(places=places((0.06, 0.05, 0.12)), t_end=2.0, field_step=2.0))
    assert pile.at_rest(still).seen
    moving = make_run(Motion(places=places((0.06, 0.05, 0.12)), t_end=0.4, field_step=0.4))
    assert not pile.at_rest(moving).seen


def test_depth_names_the_pair(make_run) -> None:
    ends = places((0.06, 0.05, 0.12), (0.1195, 0.05, 0.12))
    found = pile.depth(make_run(Motion(places=ends, t_end=3.0, field_step=3.0)))
    assert found.seen
    assert found.figures.startswith("largest 0.5\u00a0mm (blocks 4 and 5)")


def test_level_follows_the_submerged_volume(make_run) -> None:
    per_block = 7 * 0.02**3 / 0.03
    ends = places((0.06, 0.05, 0.1), (0.2, 0.05, 0.1))
    rise = 2 * per_block
    motion = Motion(places=ends, t_end=7.0, field_step=7.0, final_level=0.15 + rise, wave=0.0)
    run = make_run(motion)
    found = pile.water_level(run)
    assert found.demanded == pytest.approx(0.15 + rise, rel=1e-12)
    assert found.found == pytest.approx(0.15 + rise, abs=1e-8)
    assert pile.level(pile.water_level(run), LABORATORY.length).seen


def test_level_with_a_block_through_the_surface(make_run) -> None:
    run = make_run(Motion(places=places((0.06, 0.05, 0.15)), t_end=2.0, field_step=2.0))
    level = pile.demanded_level(run, -1)
    below = pile.submerged_volume(run, -1, level)
    assert level * 0.03 - below == pytest.approx(0.15 * 0.03 - 3 * 56e-6, rel=1e-12)
    found = pile.level(pile.water_level(run), LABORATORY.length)
    assert not found.seen and "demanded 151\u00a0mm" in found.figures


def test_telling_times_are_written_times(loose_pile) -> None:
    times = pile.telling_times(loose_pile)
    assert set(times) <= set(loose_pile.field_times)
    assert times[-1] == 8.0
    assert {0.0, 0.5, 1.5, 2.5, 3.5, 4.5} <= set(times)
    many = SimpleNamespace(release_time=0.2 * np.arange(41), dropped=np.arange(40), time=[0.0, 8.0])
    run: Any = SimpleNamespace(bodies=many, field_times=np.linspace(0, 8, 81))
    assert 10 < len(pile.telling_times(run)) <= pile.PICTURES


def test_the_paper_is_spoken_of_in_its_own_tank_only(make_run, loose_pile) -> None:
    assert pile.is_papers_tank(loose_pile)
    assert len(pile.findings(loose_pile)) == 9
    general = [f.statement for f in pile.findings(loose_pile, paper=False)]
    assert [text.split(" (")[0] for text in general] == [
        "all blocks at rest in the end",
        "true overlap of the pile below 0.6\u00a0mm",
        "untouched blocks under water accelerate less than 1 g",
        "final level within 1 % of the rise the blocks demand",
    ]
    dry = make_run(Motion(t_end=2.0))
    (dry.folder / "fields.vtkhdf").unlink()
    dry.parameters["run"][0]["physics"] = "dry"
    assert not pile.is_papers_tank(dry)
    assert len(pile.findings(dry)) == 2
    assert len(pile.findings(dry, paper=True)) == 7


def test_a_level_is_demanded_of_a_closed_box_of_still_water_only(loose_pile) -> None:
    assert pile.has_level(loose_pile)
    for name, value in {
        "sides": loose_pile.sides | {"x_max": "outflow"},
        "bed": (np.zeros((3, 3)), np.array([[0, 1, 2]])),
        "parameters": loose_pile.parameters | {"water": [{}]},
    }.items():
        run = Run(loose_pile.folder)
        run.__dict__[name] = value
        assert not pile.has_level(run), name


def test_a_run_without_blocks_has_no_pile(make_run) -> None:
    run = make_run(Motion(t_end=0.1))
    run.__dict__["bodies"] = replace(run.bodies, shape=[])
    with pytest.raises(BadRun, match="holds no blocks"):
        pile.findings(run)


def test_report_says_yes_and_no(loose_pile) -> None:
    text = pile.report(pile.findings(loose_pile))
    assert "yes  attitude changes less than 5 degrees" in text
    assert "no   blocks of the final pile touch" in text


def test_no_level_without_a_rise(make_run) -> None:
    """Before the first splash there is no rise to compare with."""
    high = [(np.array([0.15, 0.05, 0.16 + 0.03]), UPRIGHT)]
    run = make_run(Motion(places=high, t_end=0.5, field_step=0.5, level=0.08))
    assert pile.water_level(run).demanded == pytest.approx(0.08)
    assert not any("level" in found.statement for found in pile.findings(run))


def test_two_free_blocks_from_the_start_in_the_papers_words(make_run) -> None:
    run = make_run(Motion(t_end=3.0, field_step=3.0, cells=(12, 4, 8)))
    with h5py.File(run.folder / "run.h5", "r+") as h5:
        h5["bodies/release_time"][3:5] = 0.0
    run.refresh()
    assert any("first block" in found.statement for found in pile.findings(run, paper=True))
