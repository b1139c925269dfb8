"""Numbers that cannot be true end a run with code 3, a reason, and results that can be read."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from shared_runs import told

TANK = "&grid cells = 12, 12, 12  length = 1, 1, 1 /\n"
LIGHT = """&run t_end = 0.03  dt = 0.01 /
&fluid water_level = 0.5 /
&shape name = 'a'  kind = 'cube'  size = 0.3  density = {density} /
&body shape = 'a'  position = 0.5, 0.5, {height} /
"""
DAM = """&run t_end = {t_end}  dt = {dt}  cfl_max = {cfl_max} /
&fluid gas_density = 1.2 /
&water min = 0, 0, 0  max = 0.3, 1, 0.6 /
"""


def mics(work: Path, groups: str, tank: str = TANK) -> tuple[int, str]:
    """Exit code and messages of a run."""
    return told(work, tank + groups)


def complete(work: Path, code: int) -> bool:
    """Do the results say how the run ended, and is there a state to go on from?"""
    with h5py.File(work / "mics-out" / "run.h5") as h5:
        told = int(np.ravel(h5["provenance"].attrs["exit_status"])[0])
        return told == code and (work / "mics-out" / "restart-a.h5").exists()


@pytest.mark.parametrize(
    ("density", "height"), [(1.0, 0.3), (1.0, 0.8), (100.0, 0.3), (2300.0, 0.3)]
)
def test_light_bodies_go_on(density: float, height: float, tmp_path: Path) -> None:
    """A cube of 1 kg/m3 under water was thrown half a metre by the buoyancy of its first step."""
    code, said = mics(tmp_path, LIGHT.format(density=density, height=height))
    assert code == 0, said
    cut = "the inertia of the fluid that moves with light blocks was cut at its limit"
    assert said.count(cut) == said.count("\n") == (density < 1000.0), said


def test_a_block_that_jumps_ends_the_run(tmp_path: Path) -> None:
    """With the coupling of the paper the force on a block far lighter than air acts for a step."""
    numerics = "&numerics coupling = 'mics'  max_pressure_passes = 50 /\n"
    code, said = mics(tmp_path, numerics + LIGHT.format(density=0.01, height=0.3))
    assert code == 3, said
    assert "body 1 jumped" in said and "is too small for &run dt" in said
    assert complete(tmp_path, 3)


@pytest.mark.parametrize(("dt", "t_end"), [(50.0, 50.0), (50.0, 500.0), (1.0, 3.0)])
def test_fixed_step_too_long(dt: float, t_end: float, tmp_path: Path) -> None:
    """A dam break in steps of seconds: the flow would be hundreds of metres a second fast."""
    code, said = mics(tmp_path, DAM.format(dt=dt, t_end=t_end, cfl_max=0.0))
    assert code == 3, said
    assert "Courant number" in said and "&run dt is too long for this flow" in said
    assert complete(tmp_path, 3)
    stream = "&run dt=9 cfl_max=99 t_end=9 /\n&fluid single_phase=T velocity=9,0,0 /\n&boundary "
    assert mics(tmp_path, stream + "x_min='periodic' x_max='periodic' /\n")[0] == 3


@pytest.mark.parametrize(("dt", "cfl_max"), [(0.02, 0.0), (1.0, 0.5)])
def test_steps_that_follow_the_flow(dt: float, cfl_max: float, tmp_path: Path) -> None:
    """A fixed step that is short enough, and one that may shrink, end as they should."""
    assert mics(tmp_path, DAM.format(dt=dt, t_end=1.0, cfl_max=cfl_max)) == (0, "")


@pytest.mark.parametrize(("height", "up", "code"), [(9.0, -1.0, 0), (9.0, 1.0, 3), (1.9, 1.0, 0)])
def test_high_above_an_open_top(height: float, up: float, code: int, tmp_path: Path) -> None:
    """A body may be let go at any height; one that rises further than the tank is high has left."""
    body = LIGHT.format(density=2300, height=f"{height}  velocity = 0, 0, {up}")
    found, said = mics(tmp_path, body)
    assert found == code, said
    assert (code == 3) == ("body 1 left the tank" in said)


def test_wind_over_a_periodic_tank(tmp_path: Path) -> None:
    """Round a tank without ends gas moves by many cells a step."""
    case = """&run t_end = 0.1  dt = 0.01  cfl_max = 1.0 /
    &boundary x_min = 'periodic'  x_max = 'periodic'  y_min = 'slip'  y_max = 'slip'
      z_min = 'no_slip'  z_max = 'no_slip'  z_max_velocity = 45.0, 0, 0 /
    &fluid water_level = 0.02  gas_viscosity = 0.2  liquid_viscosity = 1.0 /
    """
    tank = "&grid cells = 24, 1, 12  length = 0.24, 0.01, 0.12 /\n"
    assert mics(tmp_path, case, tank) == (0, "")
