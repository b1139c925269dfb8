"""What rows of a run tell of its health: each check with its limit, rest, energy that contact
makes, acceleration of untouched blocks."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.pages import run_page
from micstools.pictures import plots
from micstools.piles import pile
from micstools.reading import health, kicks, rest, scales, units
from micstools.reading.energy import largest_made, made_by_contact
from micstools.reading.health import Check
from micstools.reading.reader import Run
from synthetic import UPRIGHT, Motion

APART = Motion(places=[(np.array([0.03, 0.05, 0.12]), UPRIGHT)], t_end=2.0,
               field_step=2.0, cells=(12, 4, 8))  # fmt: skip
SITE = replace(APART, scale=100 / 3)  # blocks of 2 m


def checks_of(run: Run) -> dict[str, Check]:
    return {check.name: check for check in health.checks(run, units.of_run(run))}


def changed(run: Run, **columns: Any) -> Run:
    """The run with other columns of /series."""
    known = {k: np.broadcast_to(v, run.series.time.shape) for k, v in columns.items()}
    run.__dict__["series"] = replace(run.series, **known)
    return run


def test_limits_grow_with_the_blocks(make_run: Callable[[Motion], Run], tmp_path) -> None:
    """A pile 33 times as large is as good or bad, its figures are in m, kJ and s."""
    small = checks_of(make_run(APART))
    large = checks_of(make_run(SITE))
    assert list(small) == list(large)
    for name, check in small.items():
        assert check.good is large[name].good, name
        if check.good is not None and check.share > 1e-9 and "divergence" not in name:
            assert large[name].share == pytest.approx(check.share, rel=1e-3), name
    assert "0.6 mm" in small["overlap of the true shapes at the end"].wanted.replace("\u00a0", " ")
    wanted = large["overlap of the true shapes at the end"].wanted.replace("\u00a0", " ")
    assert wanted == "below 1 %, 0.02 m"


def test_every_look_has_place_time_and_advice(make_run: Callable[[Motion], Run]) -> None:
    """Everything is wrong at once: each check names a time or the end, a block or a shape, and what
    to do; all but the end of the run, which has no block."""
    # Two blocks that overlap by 5 mm, still on their way.
    ends = [(np.array([x, 0.05, 0.12]), UPRIGHT) for x in (0.06, 0.115)]
    run = make_run(replace(APART, places=ends, t_end=1.7, level=0.19))
    run.provenance["exit_status"] = 3
    step = run.bodies.time[1]
    late = run.bodies.time > 1.0
    wrong = {"liquid_volume_drift": 1e-3, "volume_excess_max": 1e-3, "energy_excess": 0.5,
             "divergence_max": 1.0}  # fmt: skip
    columns = {name: value * late for name, value in wrong.items()}
    run = changed(run, dt=step, max_overlap=5e-3 * (run.bodies.time > 1.65), **columns)
    run.bodies.contact_force[60] = 1e3  # on blocks on their way up
    run.bodies.position[60] = run.bodies.position[59] + [0.0, 0.0, 0.01]
    run.bodies.velocity[59:61] = [1.0, 1.0, 1.0]
    falling = run.bodies.time > 0.2
    run.bodies.velocity[falling & (run.bodies.contacts[:, 3] == 0), 3, 1] += 0.5
    found = checks_of(run)
    assert len(found) == 11
    for check in found.values():
        assert check.good is False, check
        assert "t = " in check.found or "last" in check.found or "end" in check.name or (
            "along a block" in check.found
        ), check  # fmt: skip
        assert "block" in check.found or check.name == "end of the run", check
        assert len(check.todo) > 10, check
    assert "blocks 4 and 5" in found["overlap of the true shapes at the end"].found
    assert "blocks 4 and 5" in found["largest overlap at any time"].found
    assert "contact_time" in found["largest overlap at any time"].todo
    assert "max_pressure_passes" in found["largest divergence"].todo
    assert "--restart" in found["end of the run"].todo
    assert "block 5 still moving" in found["blocks at rest at the end"].found
    assert "cells of 6 mm" in found["cells along the smallest block"].todo.replace("\u00a0", " ")
    assert kicks.largest(run).good is False  # type: ignore[union-attr]


def test_what_is_not_known(make_run) -> None:
    """By rows of several steps, and by what older programs did not write."""
    run = make_run(APART)
    check = checks_of(run)["largest energy that contact made in a step"]
    assert check.good is None and check.found.startswith("not known: needs a row every step")
    found = checks_of(changed(run, volume_excess_max=np.nan, energy_excess=np.nan))
    assert not any("excess of fluid" in name for name in found)
    assert any("not known" in c.found for name, c in found.items() if "put in" in name)


def test_what_makes_blocks_stiffer_depends_on_the_contact(make_run) -> None:
    run = make_run(replace(APART, more="&contact model = 'spheres' /\n"))
    assert "model = 'surface'" in health._stiffer(run)


def test_blocks_that_wait_are_named(make_run) -> None:
    run = make_run(replace(APART, places=APART.places * 3, t_end=1.9))
    check = checks_of(run)["blocks at rest at the end"]
    assert "block 6 not let go by t = 1.9 s" in check.found and "t_end" in check.todo


def run_of(since: float, end: float, z: np.ndarray, turn: float = 0.0) -> Any:
    """One block in rows to a time `end` [s] whose height is `z` (T) [m]; it ends after a turn."""
    attitude = np.tile([1.0, 0, 0, 0], (len(z), 1, 1))
    attitude[:-1, 0] = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    bodies = SimpleNamespace(
        time=np.linspace(0, end, len(z)),
        position=np.stack([0 * z, 0 * z, z], axis=1)[:, None],
        quaternion=attitude,
        shape=["block"],
        rest_since=np.array([since]),
    )
    shapes = {"block": SimpleNamespace(radius=0.6)}
    return SimpleNamespace(bodies=bodies, shapes=shapes, value=lambda group, name: 0.5)


@pytest.mark.parametrize(
    ("since", "rests"), [(0.0, True), (1.5, True), (1.6, False), (np.nan, False)]
)
def test_it_rests_after_the_time_of_the_case(since: float, rests: bool) -> None:
    """Of 2 s, with any rows: the program counts, not the tools."""
    for rows in (2, 21):
        found = rest.of_block(run_of(since, 2.0, np.zeros(rows)), 0)
        assert (found.time == since) is rests and found.span == 0.5


def test_how_far_it_moved_at_last() -> None:
    """From the last row that is rest_time before the end; a turn counts at the corners."""
    z = np.linspace(2.0, 0.0, 21)
    assert rest.of_block(run_of(np.nan, 2.0, z), 0).moved == pytest.approx(0.5)
    turned = rest.of_block(run_of(0.0, 2.0, np.zeros(21), turn=0.1), 0)
    assert turned.moved == pytest.approx(0.06)


def test_limits_of_rest_grow_with_the_blocks() -> None:
    """Of touching, and of forces that count."""
    for length in (0.06, 2.0):
        bodies = SimpleNamespace(n=1, shape=["block"], mass=np.array([2.0]))
        shapes = {"block": SimpleNamespace(length=length)}
        run: Any = SimpleNamespace(bodies=bodies, shapes=shapes, gravity=np.array([0, 0, -9.81]))
        assert scales.reach(run) == pytest.approx(length / 120)
        assert scales.weight(run) == pytest.approx(2 * 9.81)


MASS, SPIN, G, STEP = 2.0, 0.3, 9.81, 0.1
LIMIT = np.ones(8)  # [J]
KICKED = 4  # the row of the step in which contact acts


def thrown(push: float = 0.0, twist: float = 0.0, **values: Any) -> Any:
    """Two blocks, the second one let go with 3 m/s in the second row and carried by a steady force
    of the water; in one step contact lifts and turns it by a mean force and torque."""
    time = np.arange(8) * STEP
    force, torque, speed, turning = (np.zeros((8, 2, 3)) for _ in range(4))
    force[KICKED, 1, 2], torque[KICKED, 1, 2] = push, twist
    speed[1:, 1, 2] = 3.0 + (25.0 / MASS - G) * time[1:]
    speed[KICKED:, 1, 2] += push * STEP / MASS
    turning[KICKED:, 1, 2] = twist * STEP / SPIN
    way, angle = np.zeros((8, 2, 3)), np.zeros(8)
    way[1:] = np.cumsum((speed[1:] + speed[:-1]) / 2 * STEP, axis=0)
    angle[1:] = np.cumsum((turning[1:, 1, 2] + turning[:-1, 1, 2]) / 2 * STEP)
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (8, 2, 1))
    attitude[:, 1, 0], attitude[:, 1, 3] = np.cos(angle / 2), np.sin(angle / 2)
    bodies = SimpleNamespace(
        time=time,
        position=way,
        quaternion=attitude,
        velocity=speed,
        angular_velocity=turning,
        contact_force=force,
        contact_torque=torque,
    )
    return SimpleNamespace(
        bodies=bodies,
        series=SimpleNamespace(time=time, contact_energy=np.zeros(8), dt=np.full(8, STEP)),
        sides={"x_min": "no_slip", "z_max": "open"},
        value=lambda group, name: values.get(name, 0.0),
    )


def test_a_block_that_is_let_go_with_a_speed_gets_nothing_from_contact() -> None:
    """Whatever the step: weight, water and the speed of the drop are no contact."""
    assert made_by_contact(thrown()) == pytest.approx(np.zeros(8), abs=1e-12)
    assert largest_made(thrown(), LIMIT).energy == 0.0


def test_a_throw_is_found_in_its_row() -> None:
    run = thrown(push=5.0, twist=0.6)
    before, after = run.bodies.velocity[KICKED - 1 : KICKED + 1, 1, 2]
    gain = 5.0 * STEP * (before + after) / 2 + 0.5 * SPIN * (0.6 * STEP / SPIN) ** 2
    made = made_by_contact(run)
    assert made[KICKED] == pytest.approx(gain)
    assert np.delete(made, KICKED) == pytest.approx(np.zeros(7), abs=1e-12)
    found = largest_made(run, LIMIT)
    assert (found.energy, found.block) == (pytest.approx(gain), 2)
    assert found.time == pytest.approx(KICKED * STEP)


def test_a_block_that_lands_is_not_thrown() -> None:
    """Contact stops it, and the water that has carried it along lifts it in the end of the step:
    the mean velocity points up, though it came down on the way."""
    run = thrown(push=5.0)
    run.bodies.position[KICKED:, 1, 2] -= 2.0 * STEP * run.bodies.velocity[KICKED, 1, 2]
    assert (made_by_contact(run) <= 0.0).all()


def test_energy_in_springs_is_no_gain() -> None:
    run = thrown(push=5.0)
    run.series.contact_energy[:KICKED] = 10.0  # pressed together before, and let go
    assert (made_by_contact(run) <= 0.0).all()


def test_the_step_that_is_most_over_its_limit_counts() -> None:
    """Energy that appears in springs is of no block."""
    run = thrown(push=5.0)
    run.series.contact_energy[6:] = 0.5
    limit = np.where(np.arange(8) == KICKED, 1e6, 1.0)
    found = largest_made(run, limit)
    assert (found.energy, found.limit, found.block) == (pytest.approx(0.5), 1.0, 0)
    assert found.time == pytest.approx(6 * STEP)


def test_rows_of_several_steps_are_not_known() -> None:
    run = thrown(push=5.0)
    run.series.dt[:] = STEP / 2
    made = made_by_contact(run)
    assert np.isnan(made[1:]).all()
    found = largest_made(run, LIMIT)
    assert np.isnan(found.energy) and "history_interval = 0" in found.reason


def test_a_moving_wall_gives_energy() -> None:
    found = largest_made(thrown(push=5.0, x_min_velocity=[0.0, 1.0, 0.0]), LIMIT)
    assert np.isnan(found.energy) and "wall moves" in found.reason
    assert largest_made(thrown(z_max_velocity=[1.0, 0.0, 0.0]), LIMIT).energy == 0.0  # no wall


PULL, LENGTH, LEVEL = 10.0, 0.1, 1.0
SPAN = 0.22 * 0.1  # of a window [s]


def falling(step: float = 1e-3, kick: float = 0.0, **other: Any) -> Any:
    """Two blocks that sink with .2 g under water from t = 0 on for a second; the second one gets
    `kick` [m/s] sideways in the row at 0.5 s. The rows are `step` [s] apart."""
    time = np.arange(0, 1 + step / 2, step)
    velocity = np.zeros((time.size, 2, 3))
    velocity[..., 2] = -0.2 * PULL * time[:, None]
    velocity[time >= 0.5 - 1e-9, 1, 0] = kick
    position = np.zeros((time.size, 2, 3))
    position[..., 2] = LEVEL - 0.2
    values: dict[tuple[str, str], Any] = {
        ("run", "physics"): "coupled",
        ("fluid", "water_level"): LEVEL,
        ("contact", "contact_time"): 2e-3,
    } | other.pop("values", {})
    dt = other.pop("dt", step)
    bodies: dict[str, Any] = {
        "n": 2,
        "shape": ["block", "block"],
        "dropped": np.array([0, 1]),
        "release_time": np.zeros(2),
        "time": time,
        "position": position,
        "velocity": velocity,
        "contacts": np.zeros((time.size, 2), int),
    }
    return SimpleNamespace(
        value=lambda *name: values.get(name),
        physics=values.get(("run", "physics"), "coupled"),
        gravity=np.array([0.0, 0.0, -PULL]),
        bodies=SimpleNamespace(**(bodies | other)),
        series=SimpleNamespace(dt=np.full(time.size, dt)),
        shapes={"block": SimpleNamespace(length=LENGTH)},
    )


def test_a_block_that_sinks_is_not_kicked() -> None:
    found = kicks.largest(falling())
    assert found and found.good
    assert found.acceleration == pytest.approx(0.2)
    assert found.window == pytest.approx(SPAN)


def test_a_kick_is_found_with_its_block_and_time() -> None:
    found = kicks.largest(falling(kick=1.5 * PULL * SPAN))
    assert found and found.good is False
    assert found.acceleration == pytest.approx(np.hypot(0.2, 1.5))
    assert found.block == 2
    assert found.time <= 0.5 <= found.time + found.window
    assert "block 2 at t = 0.4" in str(found)
    assert "smaller cells or step; look at the film at t = " in str(found)


def test_windows_are_whole() -> None:
    """The first one begins a window after the release, the last one ends with the run; it takes the
    velocity between rows."""
    run = falling(step=3e-3)
    run.bodies.velocity[0] = 5.0  # let go with a speed
    found = kicks.acceleration(run)
    whole = (run.bodies.time + SPAN <= run.bodies.time[-1]) & (run.bodies.time >= SPAN)
    assert (np.isfinite(found) == whole[:, None]).all()
    assert found[whole] == pytest.approx(0.2)


def test_blocks_that_do_not_count() -> None:
    """The kicked block touches another one, or is not under water, held or not let go."""
    touched, above, held, later = (falling(kick=1.5 * PULL * SPAN) for _ in range(4))
    touched.bodies.contacts[touched.bodies.time >= 0.5 - 1e-9, 1] = 1
    above.bodies.position[:, 1, 2] = LEVEL - 0.34 * LENGTH
    held.bodies.dropped = np.array([0])
    later.bodies.release_time[1] = 0.5
    for run in (touched, above, held, later):
        found = kicks.largest(run)
        assert found and found.acceleration == pytest.approx(0.2)


def test_no_water_kicks() -> None:
    for name, value in (("fluid", "water_level"), None), (("run", "physics"), "dry"):
        run = falling(kick=5.0, values={name: value})
        assert kicks.largest(run) is None
        assert np.isnan(kicks.acceleration(run)).all()


def test_a_landing_is_no_kick() -> None:
    """Water that a block presses away slows it in the last window before it touches."""
    run = falling(kick=1.5 * PULL * SPAN)
    run.bodies.contacts[run.bodies.time > 0.5 + 0.9 * SPAN, 1] = 1
    assert kicks.largest(run).acceleration == pytest.approx(0.2)  # type: ignore[union-attr]
    assert np.nanmax(kicks.acceleration(run, clear=0.0)) > 1.5
    run.bodies.contacts[:, 1] = run.bodies.time > 0.5 + 1.1 * SPAN
    assert kicks.largest(run).good is False  # type: ignore[union-attr]


def test_rows_too_far_apart_do_not_tell() -> None:
    """Rows of every step always do; others must see every impact."""
    sparse = falling(step=5e-3, dt=1e-3, kick=1.5 * PULL * SPAN)
    found = kicks.largest(sparse)
    assert found and found.good is None
    assert str(found) == "not known (needs rows every 0.002 s)"
    assert np.isnan(kicks.acceleration(sparse)).all()
    slow = falling(step=5e-3, dt=1e-3, values={("contact", "contact_time"): 1.0})
    assert kicks.largest(slow).good  # type: ignore[union-attr]
    far = falling(step=0.02, dt=1e-3, values={("contact", "contact_time"): 1.0})
    assert str(kicks.largest(far)) == "not known (needs rows every 0.011 s)"
    assert kicks.largest(falling(step=0.02, dt=0.02)).good  # type: ignore[union-attr]


SINKING = Motion(t_end=0.9, field_step=0.9, history_step=0.005, level=0.19)


def test_findings_tell_it(make_run) -> None:
    """In rows of every step a drop that a smooth motion carries is not kicked, and a jump is."""
    run = changed(make_run(SINKING), dt=0.005)
    assert _untouched(run).seen
    assert "block 4 at t = " in _untouched(run).figures
    here = (run.bodies.contacts[:, 3] == 0) & (run.bodies.time > 0.2)
    run.bodies.velocity[here, 3, 1] += 0.3
    assert _untouched(run).seen is False
    assert _untouched(changed(run, dt=1e-3)).seen is None
    assert pile.report([_untouched(run)]).startswith("?    untouched blocks")


def test_pages_and_history_tell_it(make_run) -> None:
    run = make_run(SINKING)
    title = "acceleration of untouched blocks under water [g], limit dashed"
    name = "largest acceleration of an untouched block"
    row = run_page.page(run).split(name)[1].split("</tr>")[0]
    assert "not known (needs rows every 0.002 s)" in row and ">–<" in row
    assert title not in [axis.get_title(loc="left") for axis in plots.history(run).axes]
    row = run_page.page(changed(run, dt=0.005)).split(name)[1].split("</tr>")[0]
    row = row.replace("\u00a0", " ")
    assert "g, block 4 at t = " in row and "below 1 g over 0.017 s" in row and "good" in row
    assert title in [axis.get_title(loc="left") for axis in plots.history(run).axes]


def _untouched(run: Run) -> pile.Finding:
    found = kicks.largest(run)
    assert found
    return pile.untouched(found)
