"""Writes a result folder as the program would, with prescribed motion, to test the tools on.

Nine hexapods: three fixed on the floor, six that fall one second apart to given places, in a tank
with a standing wave. `write_run` takes the resting places, so tests can build any pile.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, place, quaternion_from_axis, quaternion_product
from micstools.shapes.shape import Shape, hexapod

THREE_LEGS = np.array([0.540625, 0.455768, -0.060003, -0.704554])  # leg towards -y
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

CASE = """\
&run title = 'synthetic' t_end = {t_end} /
&grid cells = {cells[0]}, {cells[1]}, {cells[2]}  length = {tank}  origin = {origin} /
&fluid water_level = {level} /
&shape name = 'hexapod' kind = 'hexapod' size = {size} /
"""
BODY = "&body shape = 'hexapod' position = {0} fixed = .true. /\n"
DROP = "&drop shape = 'hexapod' position = {0} first_time = {1} /\n"
TANK = np.array([0.3, 0.1, 0.2])


def resting_places() -> list[tuple[Array, Array]]:
    """Position and quaternion of six blocks, loosely piled above the fixed ones."""
    places = [
        (0.108, 0.063, 0.0720, 12.0),
        (0.178, 0.037, 0.0700, 40.0),
        (0.150, 0.064, 0.1080, 65.0),
        (0.205, 0.062, 0.0890, 80.0),
        (0.075, 0.040, 0.0980, 25.0),
        (0.118, 0.036, 0.1230, 50.0),
    ]
    axis = np.array([0.3, 1.0, 0.5])
    return [
        (np.array([x, y, z]), quaternion_product(quaternion_from_axis(axis, turn), THREE_LEGS))
        for x, y, z, turn in places
    ]


@dataclass
class Motion:
    """What the synthetic run shows."""

    shape: Shape = field(default_factory=lambda: hexapod(0.02))
    places: list[tuple[Array, Array]] = field(default_factory=resting_places)
    t_end: float = 8.0
    history_step: float = 0.02
    field_step: float = 0.5
    cells: tuple[int, int, int] = (60, 20, 40)
    level: float = 0.15
    final_level: float = 0.1612
    wave: float = 0.004  # [m]
    turn_in_fall: float = 0.0  # degrees before the first touch
    more: str = ""  # groups of the case
    scale: float = 1.0  # of all lengths; times, speeds, forces and energies follow (Froude)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  # lower corner of the tank [m]


def write_run(folder: Path, motion: Motion | None = None) -> Path:
    """Write run.h5 and fields.vtkhdf into `folder` and return it."""
    motion = motion or Motion()
    folder.mkdir(parents=True, exist_ok=True)
    time = np.arange(0, motion.t_end + 1e-9, motion.history_step)
    position, quaternion, touching = _paths(motion, time)
    with h5py.File(folder / "run.h5", "w") as h5:
        h5.attrs["format"], h5.attrs["format_version"] = "mics-run", 1
        _write_provenance(h5, motion)
        for axis, n, length in zip("xyz", motion.cells, TANK, strict=True):
            h5[f"grid/{axis}"] = np.linspace(0, length, n + 1)
        group = h5.create_group(f"shapes/{motion.shape.name}")
        for name in ("points", "triangles", "tets", "sphere_centre", "sphere_radius"):
            group[name] = getattr(motion.shape, name)
        for name in ("volume", "inertia", "density"):
            group.attrs[name] = getattr(motion.shape, name)
        _write_bodies(h5.create_group("bodies"), motion, time, position, quaternion, touching)
        _write_series(h5.create_group("series"), time, len(motion.places))
    _write_fields(folder / "fields.vtkhdf", motion, time, position, quaternion)
    if motion.scale != 1.0:
        _enlarge(folder, motion.scale)
    if any(motion.origin):
        _move(folder, motion.origin)
    return folder


def reword(folder: Path, change: Callable[[str], str]) -> Run:
    """A synthetic run after a change of the text of its case."""
    with h5py.File(folder / "run.h5", "r+") as h5:
        for name, text in list(h5["provenance"].attrs.items()):
            if name in ("namelist", "parameters"):
                h5["provenance"].attrs[name] = change(text)
    return Run(folder)


def change(folder: Path, at: str, attribute: str = "", **how: Any) -> None:
    """Change an attribute, or the last number, of an object of run.h5; or put something else in
    its place, by default nothing."""
    with h5py.File(folder / "run.h5", "r+") as h5:
        if attribute:
            h5[at].attrs[attribute] = how["value"]
            return
        if at in h5 and "last" not in how:
            del h5[at]
        if "last" in how:
            h5[at][-1] = how["last"]
        elif "group" in how:
            h5.create_group(at)
        elif link := how.get("link"):
            h5[at] = h5py.SoftLink(*link) if len(link) == 1 else h5py.ExternalLink(*link)
        elif "data" in how and "shape" in how:
            h5[at] = np.broadcast_to(how["data"], how["shape"])
        elif "data" in how:
            h5[at] = how["data"]
        elif "line" in how:
            h5[at] = np.linspace(*how["line"])
        elif "virtual" in how:
            layout = h5py.VirtualLayout(shape=tuple(how["shape"]), dtype=float)
            layout[:] = h5py.VirtualSource(how["virtual"], at, shape=layout.shape)
            h5.create_virtual_dataset(at, layout)
        elif how:
            how = {word: tuple(v) if isinstance(v, list) else v for word, v in how.items()}
            h5.create_dataset(at, dtype=float, **how)


def with_bed(folder: Path, height: Callable[[Array, Array], Array]) -> Run:
    """Gives a synthetic run a bed of a height over its plan, a little larger than the tank."""
    x, y = np.meshgrid(np.linspace(-0.03, 0.33, 13), np.linspace(-0.02, 0.12, 8), indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    n = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (k.ravel() for k in (n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    with h5py.File(folder / "run.h5", "r+") as h5:
        h5["bed/points"], h5["bed/triangles"] = points, triangles.astype(np.int32)
    return reword(folder, lambda text: text + "&bed file = 'bed.txt' /\n")


_POWERS = {
    "x": 1, "y": 1, "z": 1, "points": 1, "sphere_centre": 1, "sphere_radius": 1, "time": 0.5,
    "release_time": 0.5, "dt": 0.5, "position": 1, "velocity": 0.5, "angular_velocity": -0.5,
    "mass": 3, "fluid_force": 3, "contact_force": 3, "fluid_torque": 4, "contact_torque": 4,
    "max_overlap": 1, "liquid_volume": 3, "divergence_max": -0.5, "Values": 0.5, "pressure": 1,
}  # fmt: skip
"""By which power of the scale a dataset grows."""


def _enlarge(folder: Path, scale: float) -> None:
    """All lengths times a scale, at the same gravity and densities."""

    def grow(path: str, data: h5py.Group | h5py.Dataset) -> None:
        name = path.split("/")[-1]
        power = 4 if "energy" in name and name != "energy_excess" else _POWERS.get(name, 0)
        if isinstance(data, h5py.Dataset) and power and "Offsets" not in path:
            data[...] = data[...] * scale**power
        if "volume" in data.attrs:
            data.attrs["volume"] = data.attrs["volume"] * scale**3
            data.attrs["inertia"] = data.attrs["inertia"] * scale**5

    for name in ("run.h5", "fields.vtkhdf"):
        with h5py.File(folder / name, "r+") as h5:
            h5.visititems(grow)


def _move(folder: Path, origin: tuple[float, float, float]) -> None:
    """The lower corner of the tank to `origin`."""
    with h5py.File(folder / "run.h5", "r+") as h5:
        for axis, by in zip("xyz", origin, strict=True):
            h5[f"grid/{axis}"][...] += by
        h5["bodies/position"][...] += origin
    with h5py.File(folder / "fields.vtkhdf", "r+") as h5:
        h5["VTKHDF"].attrs["Origin"] = np.array(origin)


def _paths(motion: Motion, time: Array) -> tuple[Array, Array, Array]:
    n = 3 + len(motion.places)
    position, quaternion = np.zeros((len(time), n, 3)), np.zeros((len(time), n, 4))
    touching = np.zeros((len(time), n), dtype=np.int32)
    for k, x in enumerate((0.09, 0.15, 0.21)):
        position[:, k], quaternion[:, k] = (x, 0.05, 0.0288675), THREE_LEGS
        touching[:, k] = 1
    start = np.array([0.15, 0.05, 0.16])
    for k, (end, q_end) in enumerate(motion.places):
        s = np.clip((time - k) / 0.8, 0, 1)[:, None]
        position[:, 3 + k] = start + (end - start) * s * s * (3 - 2 * s)
        touching[:, 3 + k] = np.where(s[:, 0] >= 0.5, 2, 0)
        tilt = quaternion_from_axis(np.array([0.0, 1, 0]), motion.turn_in_fall)
        falling = UPRIGHT + (tilt - UPRIGHT) * np.clip(2 * s, 0, 1)
        late = np.clip(2 * s - 1, 0, 1)
        mixed = (1 - late) * falling + late * q_end * np.sign(q_end[0])
        quaternion[:, 3 + k] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return position, quaternion, touching


def _write_provenance(h5: h5py.File, motion: Motion) -> None:
    scale = motion.scale

    def point(*values: float) -> str:
        at = zip(motion.origin, values, strict=True)
        return ", ".join(f"{low + scale * v:.14g}" for low, v in at)

    case = CASE.format(cells=motion.cells, level=motion.origin[2] + scale * motion.level,
                       tank=", ".join(f"{scale * v:.10g}" for v in TANK), size=0.02 * scale,
                       origin=point(0, 0, 0), t_end=motion.t_end * scale**0.5)  # fmt: skip
    case += "".join(BODY.format(point(x, 0.05, 0.0288675)) for x in (0.09, 0.15, 0.21))
    start = point(0.15, 0.05, 0.16)
    case += "".join(DROP.format(start, k * scale**0.5) for k in range(len(motion.places)))
    case += motion.more
    about = h5.create_group("provenance").attrs
    about.update(namelist=case, parameters=case, version="0.1.0", threads=1, ranks=1, exit_status=0)


def _write_bodies(
    group: h5py.Group,
    motion: Motion,
    time: Array,
    position: Array,
    quaternion: Array,
    touching: Array,
) -> None:
    n = position.shape[1]
    mass = motion.shape.volume * motion.shape.density
    group["shape"] = np.array([motion.shape.name.encode().ljust(64)] * n)
    group["mass"] = np.full(n, mass)
    group["fixed"] = np.array([1, 1, 1] + [0] * (n - 3), dtype=np.int32)
    group["release_time"] = np.array([0.0, 0, 0] + [float(k) for k in range(n - 3)])
    velocity = np.gradient(position, time, axis=0)
    velocity[np.abs(velocity) < 1e-12] = 0.0
    force = mass * np.gradient(velocity, time, axis=0)
    force[..., 2] += mass * 9.81 * (np.linalg.norm(velocity, axis=2) > 0)
    group["impact_speed"] = np.linalg.norm(velocity, axis=2).max(axis=0)
    group["rest_since"] = [_still_since(time, position[:, k]) for k in range(n)]
    for name, values in {
        "time": time, "position": position, "quaternion": quaternion, "velocity": velocity,
        "fluid_force": 0.4 * force, "contact_force": 0.6 * force, "contacts": touching,
        "on_floor": np.zeros_like(touching),
        **dict.fromkeys(("angular_velocity", "fluid_torque", "contact_torque"), 0 * position),
    }.items():  # fmt: skip
        group[name] = values


def _still_since(time: Array, place: Array) -> float:
    """From when on a block stays where it ends; 0: it moves to the end."""
    far = np.flatnonzero(np.linalg.norm(place - place[-1], axis=1) > 1e-3 * np.ptp(place) + 1e-9)
    first = far[-1] + 1 if far.size else 0
    return max(float(time[first]), 1e-3) if first < len(time) - 1 else 0.0


def _write_series(group: h5py.Group, time: Array, drops: int) -> None:
    rng = np.random.default_rng(1)
    falling = sum(np.exp(-(((time - k - 0.4) / 0.15) ** 2)) for k in range(drops))
    noise = rng.random(len(time))
    for name, values in {
        "time": time, "dt": 0.003 - 0.002 * falling, "cfl": 0.4 + 0.1 * noise,
        "divergence_max": 1e-7 * (0.2 + noise), "pressure_passes": np.full(len(time), 2),
        "solver_iterations": (14 + 5 * noise).astype(int),
        "liquid_volume": np.full(len(time), 4.35e-3), "liquid_volume_drift": 1e-14 * (noise - 0.5),
        "volume_excess_max": 1e-8 * noise, "kinetic_energy_fluid": 0.02 * falling,
        "kinetic_energy_bodies": 0.04 * falling, "potential_energy_fluid": 3.2 + 0.03 * time,
        "potential_energy_bodies": 1.2 - 0.08 * time, "contact_energy": 1e-4 * falling,
        "energy_excess": -0.1 * time, "max_overlap": 2e-5 * noise,
        "contact_courant_max": 0.05 * noise, "substeps": np.full(len(time), 20),
        "transport_parts": np.ones(len(time)), "wall_time": 0.1 * np.arange(len(time)),
        **dict.fromkeys(("sleeping", "curvature_fallback", "inertia_clips"), np.zeros(len(time))),
    }.items():  # fmt: skip
        group[name] = values


def _write_fields(
    path: Path, motion: Motion, time: Array, position: Array, quaternion: Array
) -> None:
    frames = np.arange(0, motion.t_end + 1e-9, motion.field_step)
    nx, ny, nz = motion.cells
    h = np.array([0.3 / nx, 0.1 / ny, 0.2 / nz])
    with h5py.File(path, "w") as h5:
        root = h5.create_group("VTKHDF")
        root.attrs.update({"Version": [2, 0], "Type": np.bytes_("ImageData")})
        root.attrs.update({"WholeExtent": [0, nx, 0, ny, 0, nz], "Origin": [0.0, 0, 0]})
        root.attrs.update({"Spacing": h, "Direction": np.eye(3).ravel()})
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = len(frames)
        steps["Values"] = frames
        for name in ("liquid", "solid", "pressure", "velocity"):
            steps[f"CellDataOffsets/{name}"] = np.arange(len(frames))
        found = [
            _fluid(motion, t, *(a[np.abs(time - t).argmin()] for a in (position, quaternion)))
            for t in frames
        ]
        for name in found[0]:
            values = np.stack([f[name] for f in found]).astype(np.float32)
            root.create_dataset(f"CellData/{name}", data=values, compression="gzip")


def _fluid(motion: Motion, t: float, position: Array, quaternion: Array) -> dict[str, Array]:
    """Fields of a standing wave at time `t`, solid shares by the cubes of the hexapods."""
    centre = [
        (np.arange(n) + 0.5) * length / n for n, length in zip(motion.cells, TANK, strict=True)
    ]
    z, y, x = np.meshgrid(centre[2], centre[1], centre[0], indexing="ij")
    step = centre[2][1] - centre[2][0]
    rise = (motion.final_level - motion.level) * min(1.0, t / 6)
    height = motion.level + rise
    shape = np.cos(2 * np.pi * x / 0.3) * np.cos(2 * np.pi * y / 0.1)
    decay = motion.wave * np.exp(-max(0.0, t - 6))
    liquid = np.clip((height + decay * shape * np.cos(14 * t) - z) / step + 0.5, 0, 1)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    solid = np.zeros(len(points))
    for k in range(len(position)):
        if k >= 3 and t < k - 3:
            continue
        body = np.abs(place(np.eye(3), np.zeros(3), quaternion[k]) @ (points - position[k]).T)
        legs = np.sort(body, axis=0)
        solid[(legs[1] < 0.01) & (legs[2] < 0.03)] = 1.0
    speed = 0.15 * np.sin(14 * t) * np.exp((z - height) / 0.05)
    velocity = np.stack(
        [speed * np.sin(2 * np.pi * x / 0.3), 0 * x, speed * np.cos(2 * np.pi * x / 0.3)], axis=-1
    )
    return {
        "liquid": liquid,
        "solid": solid.reshape(z.shape),
        "pressure": 9800 * np.clip(height - z, 0, None),
        "velocity": velocity,
    }
