"""The case in words: like drops once, times, places and attitudes as a person would say them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.pages import run_words
from micstools.reading.reader import Run
from micstools.reading.units import LABORATORY, SITE
from micstools.shapes import shape as shapes
from synthetic import Motion


def run_of(*drops: dict[str, Any], kind: str = "tetrapod") -> Any:
    """A run that has these &drop groups of one shape, named as its kind."""
    shape = {"name": "tetrapod", "kind": kind}
    return SimpleNamespace(parameters={"drop": list(drops), "shape": [shape]})


def drop(*position: float, **more: Any) -> dict[str, Any]:
    return {"shape": "tetrapod", "position": list(position)} | more


def said(*drops: dict[str, Any], units: Any = SITE, **more: Any) -> list[str]:
    found = run_words.drops(run_of(*drops, **more), units)
    return [text.replace("\u00a0", " ") for text in found]


def test_one_drop_of_many() -> None:
    one = drop(
        14, 3, 11.2, count=12, interval=8.0, spread=[4, 1.4, 0], orientation="random", seed=5
    )
    assert said(one) == [
        "12 tetrapods, one every 8 s, dropped at x = 14 ± 4, y = 3 ± 1.4, z = 11.2 m, "
        "random attitude (seed 5)"
    ]


def test_like_drops_are_listed_once() -> None:
    """Twelve &drop groups of one block each, along a line, one every 8 s."""
    groups = [drop(10 + k, 3, 11.2, first_time=8.0 * k, seed=k + 1) for k in range(12)]
    assert said(*groups) == [
        "12 tetrapods, one every 8 s, dropped from x = 10 to 21, y = 3, z = 11.2 m"
    ]
    turned = [group | {"tilt_deg": 5.0} for group in groups]
    assert said(*turned)[0].endswith("z = 11.2 m, random tilt up to 5° (seeds 1 to 12)")
    assert len(said(*groups, turned[0])) == 2


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"count": 3, "interval": 0.0}, "3 tetrapods, at once, dropped at"),
        ({"count": 3, "interval": 0.0, "first_time": 2.0}, "3 tetrapods, at once at t = 2 s,"),
        ({"count": 3, "first_time": 2.0}, "3 tetrapods, one every 1 s from t = 2 s on,"),
        ({}, "1 tetrapod, dropped at"),
    ],
)
def test_times_of_a_drop(more: dict[str, Any], words: str) -> None:
    assert said(drop(1, 1, 1, **more))[0].startswith(words)


def test_times_of_several_drops() -> None:
    two = [drop(x, 0, 1, count=5, interval=4.0) for x in (1, 2)]
    assert said(*two)[0].startswith("10 tetrapods, 2 at once every 4 s, dropped from x = 1 to 2,")
    uneven = [drop(1, 0, 1, first_time=t) for t in (0, 1, 5)]
    assert said(*uneven)[0].startswith("3 tetrapods, from t = 0 to 5 s, dropped at x = 1,")


def test_names_and_small_blocks() -> None:
    assert said(drop(0.15, 0.05, 0.16), kind="file", units=LABORATORY) == [
        "1 block 'tetrapod', dropped at x = 150, y = 50, z = 160 mm"
    ]
    assert said(drop(0, 0, 0, count=2), kind="dolos")[0].startswith("2 dolosse 'tetrapod',")


def test_drops_of_a_file_and_along_a_line() -> None:
    listed = {"shape": "", "file": "places.csv"}
    assert said(listed) == ["blocks are dropped at the places of places.csv"]
    line = drop(1, 2, 3, to=[5, 2, 3], count=5)
    assert said(line)[0].endswith("dropped from x = 1 to 5, y = 2, z = 3 m")


def test_the_whole_case(make_run) -> None:
    run: Run = make_run(Motion(t_end=2.0, field_step=2.0, cells=(12, 4, 8)))
    found = [text.replace("\u00a0", " ") for text in run_words.case(run, LABORATORY)]
    assert found[0] == (
        "Three fixed blocks. 6 hexapods, one every 1 s, dropped at x = 150, y = 50, z = 160 mm."
    )
    assert "measures 60 x 60 x 60 mm, has a volume of 56 cm³ and a mass of 0.129 kg" in found[1]
    assert found[2].startswith(
        "The tank measures 300 x 100 x 200 mm, its water stands 150 mm above"
    )


def test_blocks_that_waited_are_mentioned(make_run) -> None:
    run: Run = make_run(Motion(t_end=8.0, field_step=8.0, cells=(12, 4, 8)))
    late = np.array(run.bodies.release_time)
    late[-1] = 6.5
    object.__setattr__(run.bodies, "release_time", late)
    words = run_words.blocks(run, LABORATORY)
    assert words.endswith("Blocks waited for room: the last was let go at t = 6.5 s.")


def test_stones_of_a_family_are_one_sentence() -> None:
    """Not one for each of them; a block of its own keeps its sentence."""
    stones = {f"rock-{k}": shapes.cube(0.8 + 0.2 * k, density=2500.0) for k in (1, 2)}
    door = {"door": shapes.cube(3.0)}
    groups = [{"name": "rock", "kind": "rock"}, {"name": "door", "kind": "cube"}]
    run: Any = SimpleNamespace(
        bodies=SimpleNamespace(shape=["door", "rock-1", "rock-2", "rock-1"]),
        shapes=stones | door,
        parameters={"shape": groups},
    )
    found = [text.replace("\u00a0", " ") for text in run_words.shapes(run, SITE)]
    assert found[0] == (
        "2 stones of 'rock' have masses of 2.5 to 4.32 t and are 1 to 1.2 m long (2500 kg/m³)."
    )
    assert len(found) == 2 and found[1].startswith("A block 'door' (cube) measures 3 x 3 x 3 m")
