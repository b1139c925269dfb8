"""The same world in other units: with factors of powers of two every bit stays."""

from pathlib import Path

import h5py
import numpy as np

from worlds.world import Broken, World, exponents

FROUDE = (4.0, 2.0, 64.0)
"""Length, time, mass: other sizes under the same gravity, of the same densities."""
CLOCK = ("series/wall_time", "timers/seconds")


def froude(world: World, folder: Path) -> None:
    """Lengths times 4, times and speeds times 2, viscosities times 8, tension times 16."""
    same_in_other_units(world, folder, FROUDE)


def units(world: World, folder: Path) -> None:
    """Mass times 64, time times 2 or length times 4, each alone."""
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
