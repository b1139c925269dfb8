"""Acceleration of untouched blocks under water, found in the rows of a run."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.pages import run_page
from micstools.pictures import plots
from micstools.piles import pile
from micstools.reading import kicks
from micstools.reading.reader import Run
from synthetic import Motion

G, LENGTH, LEVEL = 10.0, 0.1, 1.0
SPAN = 0.22 * 0.1  # of a window [s]


def falling(step: float = 1e-3, kick: float = 0.0, **other: Any) -> Any:
    """Two blocks that sink with .2 g under water from t = 0 on for a second; the second one gets
    `kick` [m/s] sideways in the row at 0.5 s. The rows are `step` [s] apart."""
    time = np.arange(0, 1 + step / 2, step)
    velocity = np.zeros((time.size, 2, 3))
    velocity[..., 2] = -0.2 * G * time[:, None]
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
        gravity=np.array([0.0, 0.0, -G]),
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
    found = kicks.largest(falling(kick=1.5 * G * SPAN))
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


@pytest.mark.parametrize("what", ["touched", "above", "held", "not released", "no level", "dry"])
def test_blocks_that_do_not_count(what: str) -> None:
    """The kicked block touches another one, or is not under water, free or in water at all."""
    run = falling(kick=1.5 * G * SPAN)
    kicked = run.bodies.time >= 0.5 - 1e-9
    if what == "touched":
        run.bodies.contacts[kicked, 1] = 1
    elif what == "above":
        run.bodies.position[:, 1, 2] = LEVEL - 0.34 * LENGTH
    elif what == "held":
        run.bodies.dropped = np.array([0])
    elif what == "not released":
        run.bodies.release_time[1] = 0.5
    elif what == "no level":
        run = falling(kick=5.0, values={("fluid", "water_level"): None})
    else:
        run = falling(kick=5.0, values={("run", "physics"): "dry"})
    found = kicks.largest(run)
    if what in {"no level", "dry"}:
        assert found is None
        assert np.isnan(kicks.acceleration(run)).all()
    else:
        assert found and found.acceleration == pytest.approx(0.2)


def test_a_landing_is_no_kick() -> None:
    """Water that a block presses away slows it in the last window before it touches."""
    run = falling(kick=1.5 * G * SPAN)
    run.bodies.contacts[run.bodies.time > 0.5 + 0.9 * SPAN, 1] = 1
    assert kicks.largest(run).acceleration == pytest.approx(0.2)  # type: ignore[union-attr]
    assert np.nanmax(kicks.acceleration(run, clear=0.0)) > 1.5
    run.bodies.contacts[:, 1] = run.bodies.time > 0.5 + 1.1 * SPAN
    assert kicks.largest(run).good is False  # type: ignore[union-attr]


def test_rows_too_far_apart_do_not_tell() -> None:
    """Rows of every step always do; others must see every impact."""
    sparse = falling(step=5e-3, dt=1e-3, kick=1.5 * G * SPAN)
    found = kicks.largest(sparse)
    assert found and found.good is None
    assert str(found) == "not known (needs rows every 0.002 s)"
    assert np.isnan(kicks.acceleration(sparse)).all()
    slow = falling(step=5e-3, dt=1e-3, values={("contact", "contact_time"): 1.0})
    assert kicks.largest(slow).good  # type: ignore[union-attr]
    far = falling(step=0.02, dt=1e-3, values={("contact", "contact_time"): 1.0})
    assert str(kicks.largest(far)) == "not known (needs rows every 0.011 s)"
    assert kicks.largest(falling(step=0.02, dt=0.02)).good  # type: ignore[union-attr]


def test_findings_tell_it(make_run) -> None:
    """In rows of every step a drop that a smooth motion carries is not kicked, and a jump is."""
    run = make_run(Motion(t_end=0.9, field_step=0.9, history_step=0.005, level=0.19))
    run.__dict__["series"] = SimpleNamespace(dt=np.full(run.bodies.time.size, 0.005))
    assert _untouched(run).seen
    assert "block 4 at t = " in _untouched(run).figures
    here = (run.bodies.contacts[:, 3] == 0) & (run.bodies.time > 0.2)
    run.bodies.velocity[here, 3, 1] += 0.3
    assert _untouched(run).seen is False
    run.__dict__["series"] = SimpleNamespace(dt=np.full(run.bodies.time.size, 1e-3))
    assert _untouched(run).seen is None
    assert pile.report([_untouched(run)]).startswith("?    untouched blocks")


def test_pages_and_history_tell_it(make_run) -> None:
    run = make_run(Motion(t_end=0.9, field_step=0.9, history_step=0.005, level=0.19))
    title = "acceleration of untouched blocks under water [g], limit dashed"
    name = "largest acceleration of an untouched block"
    row = run_page.page(run).split(name)[1].split("</tr>")[0]
    assert "not known (needs rows every 0.002 s)" in row and ">–<" in row
    assert title not in [axis.get_title(loc="left") for axis in plots.history(run).axes]
    run.__dict__["series"] = replace(run.series, dt=np.full(run.bodies.time.size, 0.005))
    row = run_page.page(run).split(name)[1].split("</tr>")[0].replace("\u00a0", " ")
    assert "g, block 4 at t = " in row and "below 1 g over 0.017 s" in row and "good" in row
    assert title in [axis.get_title(loc="left") for axis in plots.history(run).axes]


def _untouched(run: Run) -> pile.Finding:
    found = kicks.largest(run)
    assert found
    return pile.untouched(found)
