"""A run as tables and fields with named axes, for pandas and xarray."""

from typing import Any

import dask.array
import numpy as np
import pandas as pd
import xarray as xr

from micstools.reading.reader import Run

_AXES = ("x", "y", "z")
_VECTORS = {
    "v": ("velocity", "m/s"),
    "w": ("angular_velocity", "rad/s"),
    "fluid_f": ("fluid_force", "N"),
    "fluid_t": ("fluid_torque", "N m"),
    "contact_f": ("contact_force", "N"),
    "contact_t": ("contact_torque", "N m"),
}
"""Columns of a table, what they hold, and its unit."""
_FIELDS = {
    "liquid": ("share of liquid in the fluid of the cell", "1"),
    "solid": ("share of solid in the cell", "1"),
    "pressure": ("pressure", "Pa"),
    "velocity": ("velocity", "m/s"),
}


def blocks(run: Run) -> pd.DataFrame:
    """A row for each block (from 1) at each time: place, attitude, velocities, forces, contacts;
    `attrs["units"]` has the unit of each column."""
    b = run.bodies
    times, n = len(b.time), b.n
    present = np.array([b.present(row) for row in range(times)]).reshape(times, n)
    found: dict[str, Any] = {
        "time": np.repeat(b.time, n),
        "block": np.tile(np.arange(1, n + 1), times),
        "shape": np.tile(np.array(b.shape, dtype=object), times),
        "released": present.astype(int).ravel(),
    }
    units = {"time": "s"}
    for k, axis in enumerate(_AXES):
        found[axis], units[axis] = b.position[..., k].ravel(), "m"
    for k, part in enumerate("wxyz"):
        found[f"q{part}"] = b.quaternion[..., k].ravel()
    for prefix, (name, unit) in _VECTORS.items():
        for k, axis in enumerate(_AXES):
            found[prefix + axis] = getattr(b, name)[..., k].ravel()
            units[prefix + axis] = unit
    for name in ("contacts", "on_floor"):
        found[name] = getattr(b, name).ravel()
    found["name"] = np.tile(np.array(b.name, dtype=object), times)
    table = pd.DataFrame(found)
    table.attrs["units"] = units
    return table


class _Frames:
    """A field at all written times as an array, each of which is read when it is asked for."""

    def __init__(self, run: Run, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self.run, self.name, self.shape, self.dtype = run, name, shape, dtype
        self.ndim = len(shape)

    def __getitem__(self, index: tuple[Any, ...]) -> np.ndarray:
        frames, *rest = index
        chosen = np.arange(self.shape[0])[frames]
        found = np.stack([self.run.frame(self.name, int(k)) for k in np.atleast_1d(chosen)])
        return np.asarray(found[(slice(None) if chosen.ndim else 0, *rest)])


def fields(run: Run) -> xr.Dataset:
    """The water over time, z, y, x (middles of the cells, m), velocity also over x, y, z; a time is
    read when it is asked for. Without fields a dataset without variables."""
    x, y, z = run.grid.centres
    cells = {"z": z, "y": y, "x": x}
    found = xr.Dataset(coords={"time": run.field_times, **cells}, attrs={"folder": str(run.folder)})
    for name, unit in [("time", "s"), *((axis, "m") for axis in cells)]:
        found[name].attrs["units"] = unit
    if not run.field_times.size:
        return found
    for name, (meaning, unit) in _FIELDS.items():
        first = run.frame(name, 0)
        axes = ["time", "z", "y", "x", *(["component"] if first.ndim == 4 else [])]
        shape = (len(run.field_times), *first.shape)
        frames = _Frames(run, name, shape, first.dtype)
        lazy = dask.array.from_array(frames, chunks=(1, *first.shape), name=False, asarray=False)
        found[name] = (axes, lazy, {"long_name": meaning, "units": unit})
    return found.assign_coords(component=list(_AXES))
