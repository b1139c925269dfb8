"""The result files of a run as plain arrays; hides HDF5, VTKHDF stepping and growing files.

    run = Run("mics-out")
    run.bodies.position      # (T, N, 3) [m]
    run.fields_at(2.0).liquid  # (nz, ny, nx)
    run.blocks               # pandas: a row for each block at each time
    run.fields               # xarray: the water over time, z, y, x, read when asked for
    run.places               # pandas: where each block lies at the end

Everything is read when it is first asked for. The files may still be growing: rows that are not
complete yet are left out, and `refresh` forgets what was read.
"""

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from micstools import files
from micstools.reading import namelist
from micstools.reading.profiles import along_line
from micstools.reading.result_file import BadRun as BadRun
from micstools.reading.result_file import finite, indices, numbers, require_shape, rising, take
from micstools.reading.schema import require_types, variables
from micstools.shapes.geometry import Array, IntArray, place, tet_volumes
from micstools.shapes.shape import Shape

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

T = TypeVar("T")

NOT_RESOLVED = "light: not resolved"
_SIDES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


@dataclass(frozen=True)
class Grid:
    """Face coordinates of the cells [m]."""

    x: Array  # (nx + 1)
    y: Array  # (ny + 1)
    z: Array  # (nz + 1)

    @property
    def faces(self) -> tuple[Array, Array, Array]:
        """Face coordinates in the three directions [m]."""
        return self.x, self.y, self.z

    @property
    def centres(self) -> tuple[Array, Array, Array]:
        """Coordinates of the cell centres in the three directions [m]."""
        x, y, z = ((f[1:] + f[:-1]) / 2 for f in self.faces)
        return x, y, z

    @property
    def spacing(self) -> Array:
        """Edges of a cell (3) [m]."""
        return np.array([(f[-1] - f[0]) / (len(f) - 1) for f in self.faces])

    @property
    def low(self) -> Array:
        """Lower corner of the tank (3) [m]."""
        return np.array([f[0] for f in self.faces])

    @property
    def high(self) -> Array:
        """Upper corner of the tank (3) [m]."""
        return np.array([f[-1] for f in self.faces])


@dataclass(frozen=True)
class Bodies:
    """Poses, velocities and forces of the N bodies in T rows; space frame."""

    shape: list[str]  # names of the shapes (N)
    name: list[str]  # of the bodies in the plan (N), empty without one
    mass: Array  # (N) [kg]
    fixed: NDArray[np.bool_]  # (N)
    release_time: Array  # (N) true time of release, infinite for blocks not released yet [s]
    entry_time: Array  # (N) likewise of coming into the tank, earlier if a crane lowers it [s]
    raised: Array  # (N) height above the place, where that was taken [m]
    planned: Array  # (N, 2) x and y without the random shift, nan in results of older programs [m]
    status: IntArray  # (N) 0 to come, 1 being lowered, 2 released, 3 left out, 4 out of the tank
    exit_time: Array  # (N) when it was taken out behind an open side, infinite: never [s]
    impact_speed: Array  # (N) of its approach to what it touched first, nan: nothing yet [m/s]
    rest_since: Array  # (N) since when it is slower than `rest_speed`, nan: it is not [s]
    time: Array  # (T) [s]
    position: Array  # (T, N, 3) [m]
    quaternion: Array  # (T, N, 4) w, x, y, z
    velocity: Array  # (T, N, 3) [m/s]
    angular_velocity: Array  # (T, N, 3) [rad/s]
    fluid_force: Array  # (T, N, 3) with buoyancy, without weight [N]
    fluid_torque: Array  # (T, N, 3) about the centroid [N m]
    contact_force: Array  # (T, N, 3) [N]
    contact_torque: Array  # (T, N, 3) [N m]
    contact_force_max: Array  # (T, N) largest mean of a step since the row before [N]
    contact_force_peak: Array  # (T, N) the same within a step, an impact over contact_time [N]
    contacts: IntArray  # (T, N) different counterparts touched
    on_floor: IntArray  # (T, N)

    @property
    def n(self) -> int:
        """Number of bodies."""
        return len(self.shape)

    @property
    def dropped(self) -> IntArray:
        """Numbers of the bodies that are not fixed, in the order of their release."""
        free = np.flatnonzero(~self.fixed)
        return free[np.argsort(self.release_time[free], kind="stable")]

    def row(self, t: float) -> int:
        """Row whose time is nearest to `t` [s]."""
        return int(np.abs(self.time - t).argmin())

    def released(self, row: int) -> NDArray[np.bool_]:
        """Which bodies have been released until a row, also those out of the tank since (N)."""
        return np.asarray(self.release_time <= self.time[row] + 1e-12)

    def to_come(self, row: int) -> NDArray[np.bool_]:
        """Which bodies are not released yet at a row, without those that were left out (N)."""
        return np.asarray(~self.released(row) & (self.status != 3))

    def present(self, row: int) -> NDArray[np.bool_]:
        """Which bodies are released and in the tank at a row (N)."""
        return np.asarray(self.released(row) & (self.exit_time > self.time[row]))

    def there(self, row: int) -> NDArray[np.bool_]:
        """Which bodies are in the tank at a row, released or held by a crane (N)."""
        now = self.time[row]
        return np.asarray((self.entry_time <= now + 1e-12) & (self.exit_time > now))


@dataclass(frozen=True)
class Series:
    """One number per row (T); names and units as in the result file."""

    time: Array
    dt: Array
    cfl: Array
    divergence_max: Array
    pressure_passes: Array
    solver_iterations: Array
    liquid_volume: Array
    liquid_volume_drift: Array
    volume_excess_max: Array
    kinetic_energy_fluid: Array
    kinetic_energy_bodies: Array
    potential_energy_fluid: Array
    potential_energy_bodies: Array
    contact_energy: Array
    energy_excess: Array
    max_overlap: Array
    contact_courant_max: Array
    substeps: Array
    sleeping: Array
    curvature_fallback: Array
    transport_parts: Array
    inertia_clips: Array
    wall_time: Array


@dataclass(frozen=True)
class Fields:
    """The fluid at one time; arrays run z, y, x."""

    time: float  # [s]
    liquid: Array  # (nz, ny, nx) share of liquid in the fluid of the cell
    solid: Array  # (nz, ny, nx) share of solid in the cell
    pressure: Array  # (nz, ny, nx) [Pa]
    velocity: Array  # (nz, ny, nx, 3) [m/s]


class Run:
    """The output folder of a run."""

    def __init__(self, folder: str | Path, most: int | None = None) -> None:
        """Point at a folder; nothing is read yet. `most`: rows of the bodies that are read, evenly,
        and the last one."""
        self.folder, self.most = Path(folder), most
        if not (self.folder / "run.h5").is_file():
            raise FileNotFoundError(f"{self.folder} holds no run.h5: is it the output of a run?")

    def __str__(self) -> str:
        """What there is, a line each; numbers of blocks count from 1."""
        b, times = self.bodies, self.field_times
        title = self.value("run", "title")
        cells = " x ".join(str(len(f) - 1) for f in self.grid.faces)
        size = " x ".join(f"{edge:g}" for edge in self.grid.high - self.grid.low)
        fixed = ", ".join(str(k + 1) for k in np.flatnonzero(b.fixed)) or "none"
        span = f"{b.time[0]:g} to {b.time[-1]:g} s" if b.time.size else "none yet"
        frames = f"{times.size}, {times[0]:g} to {times[-1]:g} s" if times.size else "none"
        names = ", ".join(f.name for f in fields(Fields) if f.name != "time")
        lines = [
            f"{self.folder}: {title or 'no title'}" + (f" ({self.note})" if self.note else ""),
            f"grid    {cells} cells, {size} m",
            f"blocks  {b.n}, fixed: {fixed}; shapes: {', '.join(self.shapes) or 'none'}",
            f"rows    {b.time.size}, {span}",
            f"fields  {frames}" + (f" ({names})" if times.size else ""),
        ]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        """The summary, and the places at the end, for a notebook."""
        said = f"<pre>{html.escape(str(self))}</pre>"
        if not (self.bodies.n and self.bodies.time.size):
            return said
        shown = self.places.drop(columns=["plan_x", "plan_y", "plan_z", "touching"])
        return said + str(shown.to_html(index=False, max_rows=12, na_rep="", border=0))

    def refresh(self) -> None:
        """Forget what was read, so that rows written since then are seen."""
        kept = self.folder, self.most
        self.__dict__.clear()
        self.folder, self.most = kept

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """How the run was made: the case, the version, the machine settings."""
        return self._read("run.h5", _read_provenance)

    @cached_property
    def parameters(self) -> dict[str, list[dict[str, Any]]]:
        """All parameters of the case after defaults: for each group its occurrences in order."""
        text = self.provenance.get("parameters") or self.provenance.get("namelist")
        found: dict[str, list[dict[str, Any]]] = {}
        try:
            for name, group in namelist.read(str(text)).items():
                require_types(str(name).lower(), dict(group))
                found.setdefault(str(name).lower(), []).append(dict(group))
        except ValueError as error:
            raise BadRun(f"{self.folder / 'run.h5'}: its parameters: {error}") from error
        return found

    def value(self, group: str, name: str) -> Any:
        """A parameter of the case as the run took it. What the results of an older program lack has
        today's default; None where there is none."""
        found = self.parameters.get(group, [{}])[0].get(name)
        found = variables(group)[name].get("default") if found is None else found
        return found.strip() if isinstance(found, str) else found

    @property
    def physics(self) -> str:
        """What was computed: 'coupled', 'fluid', 'dry' or 'light'."""
        return str(self.value("run", "physics"))

    @property
    def note(self) -> str:
        """What must be said of every result of the run; mostly nothing."""
        return NOT_RESOLVED if self.physics == "light" else ""

    @cached_property
    def gravity(self) -> Array:
        """Acceleration of gravity (3) [m/s2]."""
        return np.array(self.value("fluid", "gravity"), float)

    @cached_property
    def sides(self) -> dict[str, str]:
        """Kind of boundary on each of the six sides."""
        return {side: self.value("boundary", side) for side in _SIDES}

    @property
    def current(self) -> Array:
        """Velocity (3) [m/s] of the water that comes in through a side, else of that at first."""
        inflows = [side for side, kind in self.sides.items() if kind == "inflow"]
        if inflows and self.physics == "coupled":
            return np.array(self.value("boundary", f"{inflows[0]}_velocity"), float)
        return np.array(self.value("fluid", "velocity"), float) * (self.physics != "dry")

    @cached_property
    def periodic(self) -> tuple[bool, ...]:
        """Which of the three directions are periodic."""
        return tuple(self.sides[f"{axis}_min"] == "periodic" for axis in "xyz")

    @cached_property
    def period(self) -> Array:
        """Length of the tank in each periodic direction (3) [m], zero in the others."""
        return np.where(self.periodic, self.grid.high - self.grid.low, 0.0)

    def into_tank(self, place: Array) -> Array:
        """Places (..., 3) [m], which results hold unwrapped, moved by whole periods into the
        tank."""
        found = np.array(place, float)
        for d in np.flatnonzero(self.period):
            low = self.grid.low[d]
            found[..., d] = low + (found[..., d] - low) % self.period[d]
        return found

    @cached_property
    def grid(self) -> Grid:
        """The cells."""
        return self._read("run.h5", _read_grid)

    @cached_property
    def shapes(self) -> dict[str, Shape]:
        """Every shape of the case by name."""
        return self._read("run.h5", _read_shapes)

    @cached_property
    def bed(self) -> tuple[Array, IntArray]:
        """Corners (n, 3) [m] and triangles (m, 3) of the bed; none of them without a bed."""
        return self._read("run.h5", _read_bed)

    @cached_property
    def bodies(self) -> Bodies:
        """The bodies at every complete row."""
        placed = len(self.parameters.get("body", []))
        return self._read("run.h5", lambda h5: _read_bodies(h5, placed, self.most))

    @cached_property
    def series(self) -> Series:
        """The numbers of every complete row."""
        return self._read("run.h5", _read_series)

    @cached_property
    def timers(self) -> dict[str, tuple[float, int]]:
        """Seconds and calls of each phase; empty while the run goes on."""
        return self._read("run.h5", _read_timers)

    @cached_property
    def field_times(self) -> Array:
        """Times [s] at which the fluid was written; empty for a run without fluid."""
        if not (self.folder / "fields.vtkhdf").is_file():
            return np.empty(0)
        cells = tuple(len(face) - 1 for face in reversed(self.grid.faces))
        return self._read("fields.vtkhdf", lambda h5: _frame_times(h5, cells))

    def fields_at(self, t: float) -> Fields:
        """The fluid at the written time nearest to `t` [s]."""
        if self.field_times.size == 0:
            raise ValueError(f"{self.folder} holds no fields of the fluid")
        frame = int(np.abs(self.field_times - t).argmin())
        return self._read("fields.vtkhdf", lambda h5: _read_fields(h5, frame))

    def frame(self, name: str, frame: int) -> Array:
        """A field at one of the written times, by their number from 0."""
        return self._read("fields.vtkhdf", lambda h5: _at_frame(h5, name, frame))

    def profile(
        self, p: Sequence[float], q: Sequence[float], name: str, t: float, n: int = 101
    ) -> tuple[Array, Array]:
        """Distance from `p` (n) [m] and a field (n, ...) at `n` places from `p` to `q` (3) [m], at
        the written time nearest to `t` [s]; linear between the cell centres."""
        known = [f.name for f in fields(Fields) if f.name != "time"]
        if name not in known:
            raise ValueError(f"{name}: no such field, there are {', '.join(known)}")
        ends = np.array([p, q], dtype=float)
        if (ends < self.grid.low).any() or (ends > self.grid.high).any():
            low, high = self.grid.low.tolist(), self.grid.high.tolist()
            raise ValueError(f"the line leaves the tank, which reaches from {low} to {high} m")
        share = np.linspace(0.0, 1.0, n)
        points = ends[0] + share[:, None] * (ends[1] - ends[0])
        values = along_line(self.grid.faces, getattr(self.fields_at(t), name), points)
        return share * float(np.linalg.norm(ends[1] - ends[0])), values

    def vtk(self, t: float) -> Any:
        """The scene at time `t` [s] as a pyvista.MultiBlock, to plot, clip and save: a surface
        `block 1`, `block 2`, ... for each block in the tank, the `bed` and the surface of the
        `water` where there are any. All are those of the written time of the fields nearest to
        `t`, of the nearest row in a run without; `field_data["time"]` tells which."""
        from micstools.reading import vtk_data

        return vtk_data.at(self, t)

    @property
    def blocks(self) -> "pd.DataFrame":
        """A row for each block (from 1) at each time: place, attitude, velocities, forces [N] and
        torques [N m], contacts; units in `attrs["units"]`."""
        from micstools.reading import tables

        return tables.blocks(self)

    @property
    def fields(self) -> "xr.Dataset":
        """The water with named axes time, z, y, x and units; a time is read when asked for."""
        from micstools.reading import tables

        return tables.fields(self)

    @property
    def places(self) -> "pd.DataFrame":
        """Where each block lies at the end, a row each; the columns are explained in
        `attrs["meaning"]`."""
        from micstools.reading import places

        return places.frame(self)

    def to_csv(self, path: str | Path) -> Path:
        """Write `blocks` as a table."""
        table = self.blocks
        texts = {column: table[column].map(files.as_text) for column in ("shape", "name")}
        table.assign(**texts).to_csv(path, index=False, lineterminator="\n")
        return Path(path)

    def series_to_csv(self, path: str | Path) -> Path:
        """Write the numbers of every row as a table with the names of the result file."""
        import pandas as pd

        pd.DataFrame(vars(self.series)).to_csv(path, index=False, lineterminator="\n")
        return Path(path)

    @property
    def restart_files(self) -> list[str]:
        """Names of the restart files, the oldest first."""
        found = [p for p in self.folder.glob("restart-[ab].h5") if p.is_file()]
        return [p.name for p in sorted(found, key=lambda p: p.stat().st_mtime_ns)]

    def restart(self, name: str | None = None) -> dict[str, Any]:
        """Every dataset of a restart file, by default the newest, by its path; doubles stay so."""
        if name is None and not self.restart_files:
            raise FileNotFoundError(f"{self.folder} holds no restart file")
        return self._read(name or self.restart_files[-1], _everything)

    def points(self, body: int, row: int) -> Array:
        """Corners of a body in space (n, 3) [m]."""
        b = self.bodies
        shape = self.shapes[b.shape[body]]
        return place(shape.points, b.position[row, body], b.quaternion[row, body])

    def _read(self, name: str, extract: Callable[[h5py.File], T]) -> T:
        return take(self.folder / name, extract)


def _plain(value: Any) -> Any:
    """A scalar or a text instead of what h5py hands out for an attribute."""
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray) and value.size == 1:
        return _plain(value.reshape(-1)[0])
    return value.item() if isinstance(value, np.generic) else value


def _read_provenance(h5: h5py.File) -> dict[str, Any]:
    found = {name: _plain(value) for name, value in list(h5["provenance"].attrs.items())}
    return found | {
        "namelist": str(found["namelist"]),
        "exit_status": int(found.get("exit_status", -1)),
    }


def _read_grid(h5: h5py.File) -> Grid:
    faces = [rising(numbers(h5["grid"], d, None), f"grid/{d}", strictly=True) for d in "xyz"]
    if min(map(len, faces)) < 2:
        raise ValueError("grid has no cell")
    steps = [np.diff(face) for face in faces]
    if max(step.max() / step.min() for step in steps) > 1.01:
        raise ValueError("cells of grid differ")
    edges = [step.mean() for step in steps]
    if max(edges) > _FAR * min(edges) or max(edges) < 1 / _HUGE:
        raise ValueError(f"cells of grid of {' x '.join(f'{edge:g}' for edge in edges)} m")
    return Grid(*faces)


_HUGE = 1e12  # m, and kg/m3: nothing is as large
_FAR = 1e5  # tanks: nothing is as far away, or as small beside one


def _require_size(values: Any, name: str, h5: h5py.File, far: float = 10.0) -> None:
    """Refuse lengths from something in the tank beyond `far` times its diagonal, where tools would
    look at each cell on the way; missing ones pass."""
    grid = _read_grid(h5)
    if (np.abs(values) > far * np.linalg.norm(grid.high - grid.low)).any():
        raise ValueError(f"{name} lies far outside of the tank")


def _text(value: Any) -> str:
    return (value.decode() if isinstance(value, bytes) else str(value)).strip("\0 ")


def _read_shapes(h5: h5py.File) -> dict[str, Shape]:
    # As a list: while its items are visited, h5py lets no other thread read, nor as long as anybody
    # keeps the exception that ended the visit.
    groups = list(h5.get("shapes", {}).items())
    shapes = {name: _read_shape(name, group) for name, group in groups}
    for name, shape in shapes.items():
        tank, reach = _read_grid(h5), np.abs(shape.points).max(initial=0.0)
        _require_size(shape.points, f"shape {name}", h5)
        _require_size(np.abs(shape.sphere_centre).T + shape.sphere_radius, f"shape {name}", h5)
        if shape.points.size and reach * _FAR < (tank.high - tank.low).max():
            raise ValueError(f"shape {name} of {reach:g} m is nothing in the tank")
    return shapes


def _read_shape(name: str, group: h5py.Group) -> Shape:
    points = finite(numbers(group, "points", None, 3), f"shape {name}")
    centres = finite(numbers(group, "sphere_centre", None, 3), f"shape {name}")
    shape = Shape(
        name=name,
        points=points,
        triangles=indices(numbers(group, "triangles", None, 3), "triangles", len(points)),
        tets=indices(numbers(group, "tets", None, 4), "tets", len(points)),
        sphere_centre=centres,
        sphere_radius=finite(numbers(group, "sphere_radius", len(centres)), f"shape {name}"),
        volume=float(_plain(group.attrs["volume"])),
        inertia=finite(np.asarray(group.attrs["inertia"]).reshape(3, 3), f"shape {name}"),
        density=float(_plain(group.attrs["density"])),
    )
    if not (0 < shape.volume < _HUGE and 0 < shape.density < _HUGE):
        raise ValueError(f"shape {name} has no mass")
    if not (tet_volumes(points[shape.tets]) > 0).all():
        raise ValueError(f"a tetrahedron of shape {name} has no volume")
    a, b, c = np.swapaxes(points[shape.triangles], 0, 1)
    if not np.cross(b - a, c - a).any(axis=1).all():
        raise ValueError(f"a triangle of shape {name} has no area")
    return shape


def _read_bed(h5: h5py.File) -> tuple[Array, IntArray]:
    if "bed" not in h5:
        return np.empty((0, 3)), np.empty((0, 3), dtype=int)
    points = finite(numbers(h5["bed"], "points", None, 3), "bed")
    _require_size(points - _read_grid(h5).low, "bed", h5, _FAR)
    return points, indices(numbers(h5["bed"], "triangles", None, 3), "bed", len(points))


def _read_bodies(h5: h5py.File, placed: int, most: int | None) -> Bodies:
    """The bodies at `most` of the rows; the first `placed` of them are those of `&body`, the others
    drops."""
    group = h5["bodies"]
    per_body = ("shape", "name", "mass", "fixed", "planned", *_HANDLED, *_KEPT)
    rows = [f.name for f in fields(Bodies) if f.name not in (*per_body, *_LARGEST)]
    mass = finite(numbers(group, "mass", None), "mass")
    n = len(mass)
    if not (mass > 0).all():
        raise ValueError("mass of a body is not positive")
    for name in rows:
        parts = {"quaternion": (n, 4), "time": (), "contacts": (n,), "on_floor": (n,)}
        require_shape(group, name, None, *parts.get(name, (n, 3)))
    complete = min(len(group[name]) for name in rows)
    step = -(-complete // most) if most else 1
    values = {name: _thinned(group[name], complete, step) for name in rows}
    rising(values["time"], "time")
    _require_size(values["position"] - _read_grid(h5).low, "position", h5, _FAR)
    shape = [_text(name) for name in group["shape"][:]]
    names = [_text(name) for name in group.get("name", [""] * n)]
    if len(shape) != n or len(names) != n or not set(shape) <= set(h5.get("shapes", {})):
        raise ValueError("bodies and shapes do not belong together")
    for name in _LARGEST:  # older programs wrote the means at the rows alone
        values[name] = np.linalg.norm(values["contact_force"], axis=2)
        if name in group:
            require_shape(group, name, None, n)
            values[name] = _thinned(group[name], complete, step)
    return Bodies(
        shape=shape,
        name=names,
        mass=mass,
        fixed=numbers(group, "fixed", n).astype(bool),
        planned=numbers(group, "planned", n, 2) if "planned" in group else np.full((n, 2), np.nan),
        impact_speed=_kept(group, "impact_speed", n),
        rest_since=_kept(group, "rest_since", n),
        **_handled(group, values, placed),
        **values,
    )


_LARGEST = ("contact_force_max", "contact_force_peak")
_KEPT = ("impact_speed", "rest_since")
"""Numbers of each body that the program keeps; 0: there is none yet."""


def _kept(group: h5py.Group, name: str, n: int) -> Array:
    """One of them; nan where it is 0, and in results of older programs."""
    found = numbers(group, name, n) if name in group else np.zeros(n)
    return np.where(found <= 0, np.nan, found)


_HANDLED = ("release_time", "entry_time", "exit_time", "raised", "status")
"""What became of each body."""


def _handled(group: h5py.Group, rows: dict[str, Array], placed: int) -> dict[str, Any]:
    """The values of `_HANDLED`; results of older programs have no more than release times."""
    n = len(group["mass"])
    due = numbers(group, "release_time", n)
    if "status" not in group:
        release = _true_release(due, rows, placed)
        status = np.where(np.isfinite(release), 2, 0)
        never = np.full(due.shape, np.inf)
        return dict(zip(_HANDLED, (release, release, never, 0 * due, status), strict=True))
    status = numbers(group, "status", n).astype(int)
    to_come = (status == 0) & (due > rows["time"][-1] if len(rows["time"]) else True)
    let_go = np.isin(status, (2, 4))
    release = np.where(let_go | to_come, due, np.inf)
    entry = np.where((status == 1) | let_go, numbers(group, "entry_time", n), release)
    left = numbers(group, "exit_time", n) if "exit_time" in group else np.full(n, np.inf)
    left = np.where(status == 4, left, np.inf)
    raised = numbers(group, "raised", n)
    return dict(zip(_HANDLED, (release, entry, left, raised, status), strict=True))


def _thinned(rows: h5py.Dataset, complete: int, step: int) -> Any:
    """Every `step`-th of the complete rows, and the last of them."""
    found = rows[:complete:step]
    if step > 1 and (complete - 1) % step:
        found = np.concatenate([found, rows[complete - 1 : complete]])
    return found


def _true_release(due: Array, rows: dict[str, Array], placed: int) -> Array:
    """Release times (N) [s]; infinite for a block that is due but not let go yet, which shows in
    that it has neither moved nor felt a force since. Those `placed` at the start do not wait."""
    if not len(rows["time"]):
        return due
    signs = [rows[name] for name in ("velocity", "fluid_force", "contact_force")]
    alive = np.any([(np.nan_to_num(sign) != 0).any(axis=(0, 2)) for sign in signs], axis=0)
    may_wait = (due > 0) | (np.arange(len(due)) >= placed)
    return np.where(may_wait & (due <= rows["time"][-1]) & ~alive, np.inf, due)


def _read_series(h5: h5py.File) -> Series:
    group = h5["series"]
    names = {f.name for f in fields(Series)}
    found = {name: numbers(group, name, None) for name in names & set(group)}
    complete = min(map(len, found.values()))
    rising(found["time"][:complete], "series/time")
    missing = {name: np.full(complete, np.nan) for name in names - set(group)}  # of older versions
    return Series(**missing, **{name: values[:complete] for name, values in found.items()})


def _read_timers(h5: h5py.File) -> dict[str, tuple[float, int]]:
    group = h5.get("timers")
    if group is None or "name" not in group:
        return {}
    rows = zip(group["name"][:], group["seconds"][:], group["calls"][:], strict=True)
    return {_text(name): (float(seconds), int(calls)) for name, seconds, calls in rows}


def _frame_times(h5: h5py.File, cells: tuple[int, ...]) -> Array:
    if h5["VTKHDF/CellData/liquid"].shape[1:] != cells:
        raise ValueError("its cells are not those of run.h5")
    steps = h5["VTKHDF/Steps"]
    times = numbers(steps, "Values", None)[: max(0, int(_plain(steps.attrs["NSteps"])))]
    return np.asarray(rising(times, "times of the fields"))


def _at_frame(h5: h5py.File, name: str, frame: int) -> Array:
    offsets = h5["VTKHDF/Steps"].get(f"CellDataOffsets/{name}")
    return np.asarray(
        h5["VTKHDF/CellData"][name][frame if offsets is None else int(offsets[frame])]
    )


def _read_fields(h5: h5py.File, frame: int) -> Fields:
    return Fields(
        time=float(h5["VTKHDF/Steps/Values"][frame]),
        **{
            name: _at_frame(h5, name, frame) for name in ("liquid", "solid", "pressure", "velocity")
        },
    )


def _everything(h5: h5py.File) -> dict[str, Any]:
    found: dict[str, Any] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    h5.visititems(visit)
    return found
