"""Random worlds obey the laws: a few of each, and every one that ever failed."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from worlds import balance, similarity, symmetry
from worlds.__main__ import LAWS, judge
from worlds.world import Group, World

FAILED = tomllib.loads((Path(__file__).parent / "worlds" / "failed.toml").read_text())
SEEDS = {
    "still": 30, "lying": 8, "balance": 12, "restart": 4, "machine": 2, "froude": 10, "looks": 2,
    "order": 2, "tool": 1, "drops": 2, "units": 2, "moved": 2, "bodies": 3, "momentum": 3,
    "mirror": 2, "turn": 3, "axes": 3, "busy_balance": 4, "busy_froude": 2, "busy_looks": 1,
    "busy_machine": 1, "busy_moved": 2, "busy_order": 1, "busy_restart": 2,
}  # fmt: skip
WORLDS = [(law, seed) for law, n in SEEDS.items() for seed in range(1, n + 1)]
WORLDS += [(row["law"], row["seed"]) for row in FAILED.get("failed", [])]
KNOWN = {
    (row["law"], row["seed"]): row["known"] for row in FAILED.get("failed", []) if "known" in row
}


@pytest.mark.parametrize(("law", "seed"), sorted(set(WORLDS)))
def test_the_law_holds_in_the_world(law: str, seed: int, request: pytest.FixtureRequest) -> None:
    """Replay with `make worlds LAW=... SEED=... N=1`, which also finds the simplest such world."""
    if (law, seed) in KNOWN:
        request.applymarker(pytest.mark.xfail(reason=KNOWN[law, seed], strict=True))
    assert judge(law, seed) == ""


@pytest.mark.parametrize(("name", "group", "new"), [
    ("falling", "run", {}), ("falling", "numerics", {"momentum": "c_ismac"}),
    ("falling", "numerics", {"coupling": "mics"}), ("falling", "run", {"physics": "light"}),
    ("dam_break", "run", {}), ("calm", "run", {}),
])  # fmt: skip
def test_bits_stay_in_other_units(name: str, group: str, new: Group, tmp_path: Path) -> None:
    """The worlds that showed what broke this law at first."""
    world = World.known(name).changed(group, **new)
    similarity.froude(world, tmp_path)
    if "coupling" in new:  # a held body has a density, in the mixture
        similarity.units(world, tmp_path)


def test_a_spinning_block_has_its_mirror_image(tmp_path: Path) -> None:
    """To the tolerance of viscosity, 1e-9 of the largest velocity; with the motion of the block in
    one of the cells beside a face for both, forces differed by 2 %."""
    world = World.known("spinning")
    symmetry.same(world, tmp_path / "x", symmetry.MIRROR_X, limit=1e-7)
    symmetry.same(world, tmp_path / "y", symmetry.MIRROR_Y, limit=1e-7)


def test_honey_comes_to_rest(tmp_path: Path) -> None:
    """In steps as long as the stress of its surface allows."""
    world = World.known("honey")
    energy = balance.motion(world, world.run(tmp_path))
    assert energy[-1] < energy[1]


def test_a_landing_gives_no_energy(tmp_path: Path) -> None:
    """That of a sphere in oil took energy from nowhere; its added mass begins with .0041 J."""
    series = World.known("landing").run(tmp_path).series
    late = series.time > 0.085
    energy = series.kinetic_energy_fluid
    assert energy[late].max() < energy[~late].max() and energy[1] < 0.006


@pytest.mark.parametrize("quaternion", [[1.0, 0.0, 0.0, 0.0], [1.0, 0.1, 0.05, 0.0]])
def test_what_lies_presses(quaternion: list[float], tmp_path: Path) -> None:
    """With its weight under water, from .5 s after it has stopped. Films of 1e-6 m below it carried
    96 % of that."""
    run = World.known("lying_cube").changed("body", quaternion=quaternion).run(tmp_path)
    time, bodies = run.bodies.time, run.bodies
    moving = np.abs(bodies.velocity[:, 0, 2]) > 1e-2
    late = time > time[moving][-1] + 0.5
    press = bodies.contact_force[late, 0, 2] / ((2300 - 1000) * 9.80665)
    assert late.sum() > 10 and np.abs(press - 1).max() < 0.05
    assert bodies.impact_speed[0] > 0.8 * np.abs(bodies.velocity[:, 0, 2]).max()


def test_every_law_is_tested() -> None:
    """Each has worlds in the list."""
    assert set(SEEDS) == set(LAWS)
