"""Coefficients of `physics = 'light'` fitted to a few resolved falls of a shape.

Each fall is one block in a tank of its own, let go with its lowest point at the surface, until it
touches the floor; twelve cells along the block. The light falls that are fitted to it are runs of
the same case with `physics = 'light'`, so that nothing is modelled here.
"""

import math
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import f90nml
import h5py
import numpy as np

from micstools.reading import namelist
from micstools.reading.reader import BadRun, Run
from micstools.shapes.geometry import Array

CELLS = 12  # along the block
WIDE = 3.0  # tank over the length of the block
DEEP = (2.5, 6.5)  # depths of the water, likewise: falls in turn
ABOVE = 1.2  # of the tank over the water, likewise
SPEEDS = 0.5  # way from which on speeds are compared, in lengths
FILM = 0.25  # of the way over the floor that is left out: water between flat faces brakes
PLACES = 25  # depths that are compared
TRIED = np.geomspace(0.25, 2.0, 7)  # drag coefficients
UPRIGHT = 2  # falls; the others are turned at random
ROWS = 60  # of a fall that are kept
LIQUID = ("liquid_density", "liquid_viscosity", "gas_density", "gas_viscosity", "gravity")
DONE = "done"


@dataclass(frozen=True)
class Fall:
    """The way of a block down to the floor."""

    time: Array  # (T) [s]
    depth: Array  # (T) way from where it is let go [m]
    speed: Array  # (T) downwards [m/s]

    def at(self, way: float) -> tuple[float, float]:
        """When it has come so far [s], and how fast it is then [m/s]."""
        return float(np.interp(way, self.depth, self.time)), float(
            np.interp(way, self.depth, self.speed)
        )


@dataclass(frozen=True)
class Errors:
    """Light over resolved, less one."""

    speed: float  # root of the mean square over depths
    time: float  # to a quarter length above the floor
    impact: float  # speed there


@dataclass(frozen=True)
class Fit:
    """What was found for one shape."""

    shape: str
    drag_coefficient: float
    scatter: float  # standard deviation of that of single falls
    falls: list[dict[str, Any]]  # attitude, depth, own coefficient, errors, resolved trajectory
    rms_speed: float  # of all falls with the one coefficient
    mean_time: float  # error of the time to the floor
    mean_impact: float  # of the speed there
    note: str = "light: not resolved; fitted to resolved falls of one block in still water"


def read_fall(folder: Path) -> Fall:
    """The fall of a run until its block touches anything."""
    b = Run(folder).bodies
    touched = np.flatnonzero(b.contacts[:, 0] > 0)
    if not touched.size:
        raise BadRun(f"{folder}: the block did not reach the floor; it may float")
    rows = slice(0, int(touched[0]))
    return Fall(b.time[rows], b.position[0, 0, 2] - b.position[rows, 0, 2], -b.velocity[rows, 0, 2])


def errors(light: Fall, resolved: Fall, length: float) -> Errors:
    """One fall against another over the depths that both have."""
    last = min(resolved.depth[-1], light.depth[-1]) - FILM * length
    depths = np.linspace(SPEEDS * length, last, PLACES)
    ratio = np.interp(depths, light.depth, light.speed) / np.interp(
        depths, resolved.depth, resolved.speed
    )
    (t, v), (time, speed) = light.at(last), resolved.at(last)
    return Errors(float(np.sqrt(np.mean((ratio - 1) ** 2))), t / time - 1, v / speed - 1)


def smallest(squares: Array) -> float:
    """The coefficient at which squares of errors for `TRIED` are least: a parabola through the
    lowest and its neighbours, on a logarithmic scale."""
    k = int(np.clip(np.argmin(squares), 1, len(TRIED) - 2))
    a, b, _ = np.polyfit(np.log(TRIED[k - 1 : k + 2]), squares[k - 1 : k + 2], 2)
    return float(np.clip(np.exp(-b / (2 * a)), TRIED[0], TRIED[-1]))


class Calibration:
    """Falls of one shape of a case: runs in folders of their own, and the fit to them."""

    def __init__(self, mics: Path, text: str, shape: str, folder: Path, threads: int = 1) -> None:
        """Find the size of the shape of a case; nothing has fallen yet."""
        self.mics, self.folder, self.threads, self.shape = mics, folder, threads, shape
        try:
            self.case = namelist.read(text)
        except ValueError as error:
            raise BadRun(f"the case cannot be read: {error}") from error
        folder.mkdir(parents=True, exist_ok=True)
        self.length = 1.0
        self.length = self._extent()

    def fit(self, count: int, tell: Callable[[str], None] = print) -> Fit:
        """Let blocks fall, and fit one coefficient to all and one to each."""
        resolved = []
        for n in range(count):
            fall = self.fall(n)
            time, speed = fall.at(fall.depth[-1] - FILM * self.length)
            tell(f"fall {n + 1} of {count}: near the floor after {time:.3f} s, at {speed:.3f} m/s")
            resolved.append(fall)

        squares = np.array([
            [errors(self.fall(n, drag), fall, self.length).speed ** 2 for drag in TRIED]
            for n, fall in enumerate(resolved)
        ])  # fmt: skip
        drag = smallest(squares.mean(axis=0))
        falls = []
        for n, fall in enumerate(resolved):
            found = errors(self.fall(n, drag), fall, self.length)
            rows = np.linspace(0, fall.time.size - 1, min(ROWS, fall.time.size)).astype(int)
            falls.append({
                "attitude": "upright" if n < UPRIGHT else f"random, seed {n + 1}",
                "depth": DEEP[n % 2] * self.length,
                "drag_coefficient": smallest(squares[n]),
                "errors": asdict(found),
                "time": np.round(fall.time[rows], 6).tolist(),
                "way": np.round(fall.depth[rows], 7).tolist(),
                "speed": np.round(fall.speed[rows], 6).tolist(),
            })  # fmt: skip
        each = [Errors(**fall["errors"]) for fall in falls]
        scatter = float(
            np.std([fall["drag_coefficient"] for fall in falls], ddof=min(1, count - 1))
        )
        return Fit(
            self.shape, drag, scatter, falls,
            float(np.sqrt(np.mean([e.speed**2 for e in each]))),
            float(np.mean([e.time for e in each])), float(np.mean([e.impact for e in each])),
        )  # fmt: skip

    def fall(self, number: int, light: float | None = None) -> Fall:
        """A fall, resolved or with a drag coefficient; a resolved one that is there is read."""
        place = self.folder / (f"fall-{number + 1}" if light is None else "light")
        case = str(self.fall_case(number, light)) + "\n"
        file, result = place / "fall.nml", place / "fall"
        if light is None and file.exists() and file.read_text() == case and (place / DONE).exists():
            return read_fall(result)
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        file.write_text(case)
        self._mics("--quiet", "--threads", str(self.threads), str(file), "--output", str(result))
        (place / DONE).touch()
        return read_fall(result)

    def fall_case(self, number: int, light: float | None = None) -> f90nml.Namelist:
        """The case of a fall: shape and liquid of the case, a tank of its own."""
        water = DEEP[number % 2] * self.length
        cell = self.length / CELLS
        cells = [round(WIDE * CELLS)] * 2 + [round((water + ABOVE * self.length) / cell)]
        fluid = {k: v for k, v in dict(self.case.get("fluid", {})).items() if k in LIQUID}
        down = -float(np.ravel(fluid.get("gravity", [0.0, 0.0, -9.81]))[2])
        if not down > 0:
            raise BadRun("&fluid gravity: must point down for a block to fall")
        time = math.sqrt(self.length / down)  # [s]
        shape = dict(self._shape())
        run: dict[str, Any] = {
            "t_end": 40.0 * time,
            "dt": 0.02 * time,
            "stop_when_settled": True,
            "rest_speed": 0.1 * self.length / time,
            "rest_time": 2.0 * time,  # a block let go is faster by then
            "field_interval": 0.0,
            "restart_interval": 0.0,
        }
        if light is None:
            shape.pop("drag_coefficient", None)
        else:
            run |= {"physics": "light", "dt": 0.005 * time}
            shape["drag_coefficient"] = light
        return f90nml.Namelist({
            "run": run,
            "grid": {"cells": cells, "length": [n * cell for n in cells]},
            "fluid": fluid | {"water_level": water},
            "shape": shape,
            "drop": {
                "shape": self.shape,
                "position": [WIDE * self.length / 2] * 2 + [water + self.length / 2],
                "orientation": "given" if number < UPRIGHT else "random",
                "seed": number + 1,
            },
        })  # fmt: skip

    def _shape(self) -> dict[str, Any]:
        shapes = self.case.get("shape", [])
        shapes = shapes if isinstance(shapes, list) else [shapes]
        for group in shapes:
            if str(group.get("name", "")).strip() == self.shape:
                found = dict(group)
                if "file" in found:
                    found["file"] = str(Path(str(found["file"]).strip()).resolve())
                return found
        names = ", ".join(str(group.get("name", "")) for group in shapes) or "none"
        raise BadRun(f"--shape {self.shape}: the case has no such &shape; it has: {names}")

    def _extent(self) -> float:
        """Longest extent of the shape [m], from the set-up that the program writes."""
        place, plan = self.folder / "size.nml", self.folder / "size.h5"
        text = f90nml.Namelist({
            "run": {"t_end": 1.0, "physics": "dry"},
            "grid": {"cells": [1, 1, 1], "length": [1.0, 1.0, 1.0]},
            "boundary": {f"{a}_{e}": "slip" for a in "xyz" for e in ("min", "max")},
            "shape": self._shape(),
        })  # fmt: skip
        place.write_text(str(text) + "\n")
        plan.unlink(missing_ok=True)
        self._mics("--check", "--plan", str(plan), str(place))
        with h5py.File(plan) as h5:
            points = [shape["points"][()] for shape in h5["/shapes"].values()]  # of a family all
        place.unlink()
        plan.unlink()
        return max(float(np.ptp(one, axis=0).max()) for one in points)

    def _mics(self, *words: str) -> None:
        done = subprocess.run([self.mics, *words], capture_output=True, text=True)
        if done.returncode:
            raise BadRun(done.stderr.strip() or f"{self.mics} ended with code {done.returncode}")
