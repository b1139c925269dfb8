"""Each check of a run: its limit grows with the blocks, and what is to be looked at has place, time
and advice."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from micstools.reading import health, kicks, units
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


def test_rows_of_several_steps_do_not_tell_the_energy_of_contact(make_run) -> None:
    check = checks_of(make_run(APART))["largest energy that contact made in a step"]
    assert check.good is None and check.found.startswith("not known: needs a row every step")


def test_what_makes_blocks_stiffer_depends_on_the_contact(make_run) -> None:
    run = make_run(replace(APART, more="&contact model = 'spheres' /\n"))
    assert "model = 'surface'" in health._stiffer(run)
    run = make_run(replace(APART, more="&contact law = 'constants' k_n = 2e4 /\n"))
    assert "k_n, now 20000" in health._stiffer(run)


def test_blocks_that_wait_are_named(make_run) -> None:
    run = make_run(replace(APART, places=APART.places * 3, t_end=1.9))
    check = checks_of(run)["blocks at rest at the end"]
    assert "block 6 not let go by t = 1.9 s" in check.found and "t_end" in check.todo
