"""What must not matter to a result: threads, ranks, stops, how often one looks."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from run_cases import ROOT, Machine
from same_bits import differences
from worlds.world import Broken, Group, World

SAME = ("run.h5", "blocks.vtkhdf", "fields.vtkhdf")


def machine(world: World, folder: Path) -> None:
    """Two threads, two processes."""
    one = world.run(folder / "one")
    machines = [Machine(threads=2)]
    if (ROOT / "mics_mpi").exists():
        machines.append(Machine(ROOT / "mics_mpi", ranks=2, threads=1))
    for on in machines:
        other = world.run(folder / f"{on.program.name}-{on.threads}", machine=on)
        same(one.folder, other.folder, f"{on.ranks} processes of {on.threads} threads")


def restart(world: World, folder: Path) -> None:
    """A run that goes on from its first restart file, written somewhere."""
    run = world.value("run", "t_end")
    world = world.changed("run", restart_interval=0.4 * run)
    one = world.run(folder / "one")
    first = one.folder / one.restart_files[0]
    other = world.run(folder / "other", "--restart", str(first))
    same(one.folder, other.folder, f"restart from {first.name}")


def looks(world: World, folder: Path) -> None:
    """Rows and frames that are written more or less often."""
    t_end = world.value("run", "t_end")
    world = world.changed("run", history_interval=0.0, field_interval=0.0)
    one = world.run(folder / "one")
    frames = world.changed("run", field_interval=0.3 * t_end).run(folder / "frames")
    same(one.folder, frames.folder, "&run field_interval", ("run.h5",))
    rows = world.changed("run", history_interval=0.3 * t_end).run(folder / "rows")
    at = np.isin(one.series.time, rows.series.time)
    for name in ("position", "quaternion", "velocity", "angular_velocity"):
        x, y = getattr(one.bodies, name)[at], getattr(rows.bodies, name)
        sign = np.copysign(1.0, (x * y).sum(axis=-1, keepdims=True))  # follows the row before
        if not np.array_equal(x, y * (sign if name == "quaternion" else 1.0), equal_nan=True):
            raise Broken(f"&run history_interval changes {name}")
    if one.series.time[-1] != rows.series.time[-1]:
        raise Broken("&run history_interval changes the last row")


def order(world: World, folder: Path) -> None:
    """Groups in another order, bodies of a kind in theirs."""
    one = world.run(folder / "one")
    sorted_groups = sorted(world.groups, key=lambda g: g[0])
    other = replace(world, groups=sorted_groups).run(folder / "other")
    same(one.folder, other.folder, "order of the groups")


def drops(world: World, folder: Path) -> None:
    """A &drop of three, or three of one."""
    thrice, each = [], []
    for name, group in world.groups:
        thrice.append((name, {**group, "count": 3} if name == "drop" else group))
        start, interval = group.get("first_time", 0.0), group.get("interval", 1.0)
        later = [{**group, "first_time": start + k * interval} for k in (1, 2)]
        each += [(name, one) for one in [group, *(later if name == "drop" else [])]]
    one = replace(world, groups=[(n, _exact(g)) for n, g in thrice]).run(folder / "one")
    other = replace(world, groups=[(n, _exact(g)) for n, g in each]).run(folder / "other")
    same(one.folder, other.folder, "&drop count = 3 or three groups")


def _exact(group: Group) -> Group:
    return {name: value for name, value in group.items() if name not in ("spread", "seed")} | (
        {"seed": group["seed"]} if group.get("kind") == "rock" else {}
    )


def tool(world: World, folder: Path) -> None:
    """Run through `mics-tools run`."""
    one = world.run(folder / "one")
    words = ["-m", "micstools.cli", "run", str(world.write(folder)), "--output", str(folder / "b")]
    subprocess.run([sys.executable, *words], capture_output=True, check=False)
    same(one.folder, folder / "b", "mics-tools run")


def same(a: Path, b: Path, what: str, files: tuple[str, ...] = SAME) -> None:
    """Raise what differs."""
    found = [line for line in differences(a, b) if line.startswith(files)]
    found = [line for line in found if "@" not in line]
    if found:
        raise Broken(f"{what}: {len(found)} differ, first {found[0]}")
