"""The same world in other units: with factors of powers of two every bit stays."""

from pathlib import Path

import h5py
import numpy as np

from worlds.world import Broken, World, exponents

FROUDE = (4.0, 2.0, 64.0)
"""Length, time, mass: other sizes under the same gravity, of the same densities."""
CLOCK = ("series/wall_time", "timers/seconds")

SAME_FLUIDS = {"liquid_density": 1000.0, "liquid_viscosity": 1e-3, "gas_density": 1.25,
               "gas_viscosity": 1.8e-5, "gravity": [0.0, 0.0, -9.8125]}  # fmt: skip
PAIRS = {
    "falling": {},
    "c_ismac": {"momentum": "c_ismac"},
    "mics": {"coupling": "mics"},
    "light": {},
    "held": {},
}
"""Worlds that showed all that broke the law at first, and their &numerics."""


def pair(name: str) -> World:
    """Hexapods that fall on a held one in shallow water; a dam break on the held one."""
    falls = [
        ([0.155, 0.085, 0.13], [3.0, 1.0, 2.0], 70.0),
        ([0.08, 0.075, 0.2], [1.0, 1.0, 2.0], 20.0),
    ]
    held = ([0.15, 0.08, 0.04], [1.0, 2.0, 3.0], 40.0)
    dam = {"min": [0.0, 0.0, 0.0], "max": [0.1, 0.16, 0.17]}
    run = {"physics": "light" if name == "light" else "coupled", "t_end": 0.4, "dt": 0.02}
    return World(
        [
            ("run", {**run, "cfl_max": 1.0, "field_interval": 0.0, "restart_interval": 0.0}),
            ("grid", {"cells": [30, 16, 26], "length": [0.3, 0.16, 0.26]}),
            ("fluid", SAME_FLUIDS | ({} if name == "held" else {"water_level": 0.15})),
            *([("water", dam)] if name == "held" else []),
            ("numerics", {"divergence_tolerance": 1e-6, **PAIRS[name]}),
            ("contact", {"contact_time": 2e-3}),
            ("shape", {"name": "b", "kind": "hexapod", "size": 0.02, "density": 2300.0}),
            *(("body", {"shape": "b", "fixed": place is held, "position": place[0],
                        "axis": place[1], "angle_deg": place[2]})
              for place in [held, *([] if name == "held" else falls)]),
        ]
    )  # fmt: skip


def calm() -> World:
    """Water alone, level inside a cell: what moves is round-off."""
    ends = {f"{d}_{s}": "periodic" for d in "xy" for s in ("min", "max")} | {"z_max": "slip"}
    thin = {"gas_density": 0.6, "gas_viscosity": 1e-3, "water_level": 2.21875875}
    thick = {"liquid_density": 3000.0, "liquid_viscosity": 7.2e-4, "gravity": [0.0, 0.0, -9.8125]}
    jacobi = {"advection": "upwind", "preconditioner": "jacobi", "divergence_tolerance": 1e-6}
    run = {"physics": "fluid", "t_end": 0.2, "dt": 0.0675, "restart_interval": 0.0}
    grid = {"cells": [15, 12, 10], "length": [4.31109, 4.93493, 5.00002]}
    return World([("run", run), ("grid", grid), ("boundary", ends), ("fluid", thin | thick),
                  ("numerics", jacobi)])  # fmt: skip


def froude(world: World, folder: Path) -> None:
    """Lengths times 4, times and speeds times 2, viscosities times 8, tension times 16."""
    same_in_other_units(world, folder, FROUDE)


def units(world: World, folder: Path) -> None:
    """Mass times 64, time times 2 or length times 4, each alone; a held body in the mixture of
    `coupling = 'mics'` has a density in kg/m3, so that is left out."""
    world = world.changed("numerics", coupling="monolithic")
    same_in_other_units(world, folder / "mass", (1.0, 1.0, 64.0))
    same_in_other_units(world, folder / "time", (1.0, 2.0, 1.0))
    same_in_other_units(world, folder / "length", (4.0, 1.0, 1.0))


def same_in_other_units(world: World, folder: Path, factors: tuple[float, float, float]) -> None:
    """Every number of both result files, in its units, has the same bits."""
    one = world.run(folder / "one").folder / "run.h5"
    other = world.scaled(*factors).run(folder / "other").folder / "run.h5"
    with h5py.File(one, locking=False) as a, h5py.File(other, locking=False) as b:
        compare(a, b, factors)


def compare(a: h5py.File, b: h5py.File, factors: tuple[float, float, float]) -> None:
    """Raise what differs: the earliest row, and the names of what differs in it."""
    found: dict[str, int] = {}
    worst = 0.0

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        nonlocal worst
        unit = item.attrs.get("units")
        if unit is None or item.dtype.kind not in "fiu" or name in CLOCK:
            return
        unit = unit.decode() if isinstance(unit, bytes) else str(unit)
        x = np.atleast_1d(item[()])
        y = np.atleast_1d(b[name][()])
        never = (y < 0) & (unit == "s")
        y = np.where(never, y, y / float(np.prod(np.array(factors) ** exponents(unit))))
        n = min(len(x), len(y))
        with np.errstate(invalid="ignore"):
            other = ~((x[:n] == y[:n]) | ((x[:n] != x[:n]) & (y[:n] != y[:n])))
        if len(x) != len(y):
            found[f"{name} (length)"] = n
        if other.any():
            found[name] = int(np.argwhere(other)[0][0])
            worst = max(worst, float(np.nanmax(abs(x[:n] - y[:n])) / np.nanmax(abs(x))))

    a.visititems(visit)
    if found:
        row = min(found.values())
        names = ", ".join(name for name, first in found.items() if first == row)
        raise Broken(f"other bits in units {factors} from row {row}: {names}; at most {worst:.1e}")
