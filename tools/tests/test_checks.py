"""The tables of checks, and the balances recomputed from a restart state."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from measures import balance, buoyancy, expect
from measures.checks import Checks
from micstools.reading.overlap import Placed
from micstools.reading.reader import Grid, Run
from micstools.shapes.shape import box


def test_checks_hold_fail_and_are_never_empty() -> None:
    good = Checks("good")
    good.close("mass", 1.001, 1.0, 2e-3)
    good.below("drift", -1e-12, 1e-9)
    good.true("there", True)
    assert good.failed == 0
    for bad in (
        lambda c: c.close("mass", 1.003, 1.0, 2e-3),
        lambda c: c.below("drift", -1e-8, 1e-9),
        lambda c: c.below("drift", float("nan"), 1e-9),
        lambda c: c.true("there", False),
    ):
        checks = Checks("bad")
        bad(checks)
        assert checks.failed == 1
    assert Checks("empty").failed == 1


def expected(tmp_path: Path, row: str, name: str = "a_1") -> Checks:
    """What a table with one row finds of a run of two bodies, of which one moves."""
    bodies = SimpleNamespace(speed=np.array([0.0, 2.0]))
    run: Any = SimpleNamespace(folder=Path(name), bodies=bodies, series=None, restart=None,
                               value=lambda group, name: 0.5)  # fmt: skip
    head = "varies = [\"contact\"]\nlet.most = \"b.speed.max() * value('run', 'dt')\"\n[[expect]]\n"
    (tmp_path / "expect.toml").write_text(f"{head}quantity = '{{name}}: most {{most:g}}'\n{row}\n")
    case, checks = expect.module(tmp_path / "expect.toml"), Checks("table")
    assert case.VARIES == ("contact",)
    case.check([run], checks)
    return checks


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ('number = "most"\nbelow = 1.1', 'number = "most"\nbelow = 0.9'),
        ('number = "most"\nwithin = ["most", 2]', 'number = "most"\nwithin = [0, 0.9]'),
        ('number = "most"\nclose = 1.1\nband = 0.1', 'number = "most"\nclose = 1.1\nband = 0.05'),
        ('number = "most"\nclose = "most"\nband = 0', 'number = "np.nan"\nclose = 1\nband = 9'),
        ('true = "most == 1"\nfigures = "{most:.1f}"', 'true = "most > 1"'),
    ],
)
def test_a_table_of_a_case_holds_and_fails(tmp_path: Path, good: str, bad: str) -> None:
    (found,) = expected(tmp_path, good).results
    assert found.quantity == "a_1: most 1" and found.holds and found.ours in ("1", "1.0")
    assert expected(tmp_path, bad).failed == 1
    assert expected(tmp_path, bad + "\ncounts = false").results[0].mark == "(misses)"
    assert expected(tmp_path, bad + "\nruns = 'b*'").results == []


def test_rows_for_information_and_bounds() -> None:
    checks = Checks("mixed")
    checks.close("only told", 2.0, 1.0, 0.1, counts=False)
    assert checks.failed == 1  # nothing that counts
    checks.within("between", 1.5, 1.0, 2.0)
    assert checks.failed == 0
    checks.within("past", 2.5, 1.0, 2.0)
    assert checks.failed == 1
    checks.know({"pas": "why"})
    assert checks.failed == 0 and [r.mark for r in checks.results] == ["(misses)", "ok", "misses"]
    assert [r.error for r in checks.results] == ["+100 %", "0", "+0.5"]


def test_observed_order() -> None:
    checks = Checks("study")
    second = {n: 3.0 * (1 + 0.5 / n**2) for n in (24.0, 6.0, 12.0)}
    checks.study("with a reference", second, 3.0)
    checks.study("without", second)
    known, unknown = checks.studies
    assert known.cells == (6.0, 12.0, 24.0)
    assert known.orders == pytest.approx((2.0, 2.0))
    assert known.errors[0] == pytest.approx(0.5 / 36)
    assert unknown.orders == pytest.approx((2.0,))
    assert unknown.errors[-1] == 0.0


class FakeRun(Run):
    """Grid and sides only, and what follows from them."""

    grid = Grid(np.linspace(0, 0.4, 5), np.linspace(0, 0.3, 4), np.linspace(0, 0.1, 3))
    sides = {f"{a}_{e}": "no_slip" for a in "xyz" for e in ("min", "max")}

    def __init__(self) -> None:
        """No folder."""


def linear_flow(run: FakeRun, gradient: tuple[float, float, float]) -> dict[str, np.ndarray]:
    """Face velocity u = a x, v = b y, w = c z with all faces open."""
    nx, ny, nz = 4, 3, 2
    uf = np.zeros((3, nz + 1, ny + 1, nx + 1))
    for d, (f, rate) in enumerate(zip(run.grid.faces, gradient, strict=True)):
        shape = [1, 1, 1]
        shape[2 - d] = len(f)
        uf[d] += rate * f.reshape(shape)
    return {"flow/uf": uf, "flow/aperture": np.ones_like(uf), "flow/solid_flux": np.zeros_like(uf)}


def test_divergence_of_a_linear_flow() -> None:
    run = FakeRun()
    state = linear_flow(run, (1.0, 2.0, -2.5))
    found = balance.divergence(run, state)
    assert found.shape == (2, 3, 4)
    assert found == pytest.approx(np.full((2, 3, 4), 0.5), rel=1e-12)
    state["flow/aperture"][1] = 0.0
    state["flow/solid_flux"][1] = 2.0 * run.grid.y[:, None] * 0.1 * 0.05
    assert balance.divergence(run, state) == pytest.approx(np.full((2, 3, 4), 0.5), rel=1e-12)
    state["flow/aperture"][:] = 0.0
    assert np.abs(balance.divergence(run, state)).max() == 0.0


def test_divergence_closes_periodic_directions() -> None:
    run = FakeRun()
    run.sides = run.sides | {"x_min": "periodic", "x_max": "periodic"}
    state = linear_flow(run, (0.0, 0.0, 0.0))
    state["flow/uf"][0, :, :, 0] = 3.0
    state["flow/uf"][0, :, :, -1] = 99.0  # not a face of its own
    found = balance.divergence(run, state)[0, 0]
    assert found == pytest.approx([-30.0, 0.0, 0.0, 30.0], rel=1e-12)


def test_liquid_of_one_basin() -> None:
    run = FakeRun()
    state = {"flow/liquid": np.arange(24.0).reshape(2, 3, 4)}
    assert balance.liquid_between(run, state, 0, 0.0, 0.1) == 0 + 4 + 8 + 12 + 16 + 20
    assert balance.liquid_between(run, state, 2, 0.05, 0.1) == sum(range(12, 24))


def test_displaced_mass_and_moment_of_a_floating_box() -> None:
    body = Placed(box((0.1, 0.1, 0.1)), np.array([1.0, 2.0, 0.04]), np.array([1.0, 0, 0, 0]))
    mass, moment = buoyancy.displaced(body, 0.02, 1000.0, 1.0)
    assert mass == pytest.approx(1000 * 0.1**2 * 0.03 + 0.1**2 * 0.07, rel=1e-12)
    assert moment == pytest.approx([0, 0, 999 * 0.1**2 * 0.03 * -0.035], abs=1e-15)
