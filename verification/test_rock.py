"""Stones: a heap comes to rest without water, one falls in water, a drop draws each."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from shared_runs import results

STONES = "&shape name = 'rock'  kind = 'rock'  density = 2650  mass_50 = 0.1 /\n"
HEAP = f"""&run t_end = 6  dt = 0.01  physics = 'dry'  stop_when_settled = T  field_interval = 0 /
&grid cells = 6, 6, 20  length = 0.24, 0.24, 0.8 /
{STONES}&drop shape = 'rock'  position = 0.12, 0.12, 0.5  count = 20  interval = 0.11
  spread = 0.05, 0.05, 0  orientation = 'random'  seed = {{seed}} /
"""
FALL = f"""&run t_end = 0.12  dt = 0.01  field_interval = 0.12 /
&grid cells = 12, 12, 24  length = 0.12, 0.12, 0.24 /
&fluid water_level = 0.15 /
{STONES}&body shape = 'rock-07'  position = 0.06, 0.06, 0.19  axis = 1, 2, 3  angle_deg = 40 /
"""


def test_a_heap_settles(tmp_path: Path) -> None:
    """Twenty stones lie still, all in the tank, none deep in another; another seed draws others."""
    with results(tmp_path, HEAP.format(seed=1)) as h5:
        assert h5["bodies/time"][-1] < 6.0
        assert np.abs(h5["bodies/velocity"][-1]).max() < 1e-3
        place = h5["bodies/position"][-1]
        assert (np.abs(place[:, :2] - 0.12) < 0.12).all()
        assert place[:, 2].max() > 0.04, "some lie on others"
        size = min(float(shape.attrs["volume"]) for shape in h5["shapes"].values()) ** (1 / 3)
        assert h5["series/max_overlap"][-1] < 0.01 * size
        drawn = h5["bodies/shape"].asstr()[:]
        mass = [h5[f"shapes/{name}"].attrs["volume"] * 2650 for name in drawn]
        assert h5["bodies/mass"][:] == pytest.approx(np.array(mass).ravel(), rel=1e-15)
        assert len(set(drawn)) > 8 and set(drawn) <= {f"rock-{k:02d}" for k in range(1, 21)}


def test_one_falls_in_water(tmp_path: Path) -> None:
    """The grid holds the volume of the stone, the books of liquid and momentum are closed."""
    with results(tmp_path, FALL) as h5:
        b, dt = h5["bodies"], np.diff(h5["bodies/time"][:])
        force = b["fluid_force"][1:, 0] + b["contact_force"][1:, 0]
        gained = np.diff(b["velocity"][:, 0], axis=0) * b["mass"][0]
        weight = b["mass"][0] * np.array([0, 0, -9.81])
        assert gained == pytest.approx(dt[:, None] * (force + weight), abs=1e-14)
        assert np.abs(h5["series/liquid_volume_drift"][:]).max() < 1e-12
        assert b["position"][-1, 0, 2] < 0.15
    with h5py.File(tmp_path / "mics-out" / "fields.vtkhdf") as h5, \
            h5py.File(tmp_path / "mics-out" / "run.h5") as rows:  # fmt: skip
        solid = h5["VTKHDF/CellData/solid"][-1].sum() * 1e-6
        volume = float(np.ravel(rows["shapes/rock-07"].attrs["volume"])[0])
        assert solid == pytest.approx(volume, rel=1e-6)
