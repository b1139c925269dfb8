"""What must not matter to a result: threads, ranks, stops, how often one looks."""

from pathlib import Path

from run_cases import ROOT, Machine
from same_bits import differences
from worlds.world import Broken, World

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


def same(a: Path, b: Path, what: str) -> None:
    """Raise what differs."""
    found = [line for line in differences(a, b) if line.startswith(SAME)]
    found = [line for line in found if "@" not in line]
    if found:
        raise Broken(f"{what}: {len(found)} differ, first {found[0]}")
