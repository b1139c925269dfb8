"""Judge random worlds: each seed draws a world, and each law must hold in it.

usage: PYTHONPATH=verification:tools python -m worlds [--law NAME] [--seed 1] [--n 500] [--jobs 2]

A world that breaks a law is told by its law and seed; with --shrink, in the simplest form found
that still breaks it. The same seed draws the same world until drawing, hypothesis or what the
program accepts changes.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from hypothesis.internal.conjecture.providers import HypothesisProvider
from hypothesis.strategies import SearchStrategy

from worlds import balance, draw, indifference, similarity, symmetry
from worlds.world import Broken, World

Law = tuple[SearchStrategy[World], Callable[[World, Path], None]]
LAWS: dict[str, Law] = {
    "still": (draw.still(), balance.stays_still),
    "lying": (draw.lying(), balance.lies_still),
    "balance": (draw.world(), balance.balance),
    "froude": (draw.world(), similarity.froude),
    "units": (draw.world(), similarity.units),
    "mirror": (draw.world(("coupled", "fluid", "dry"), plain=True), symmetry.mirror),
    "turn": (draw.world(("coupled", "fluid", "dry"), plain="single"), symmetry.turn),
    "axes": (draw.world(("coupled", "fluid", "dry"), plain="single"), symmetry.axes),
    "moved": (draw.world(), symmetry.moved),
    "bodies": (draw.world(plain=True), symmetry.bodies),
    "momentum": (
        draw.world(("coupled",), True, ("sphere", "cube", "hexapod"), draw.ALONG_X),
        balance.momentum,
    ),
    "looks": (draw.world(), indifference.looks),
    "order": (draw.world(), indifference.order),
    "drops": (draw.world(("coupled", "dry", "light"), shapes=draw.MADE), indifference.drops),
    "tool": (draw.world(), indifference.tool),
    "machine": (draw.world(), indifference.machine),
    "restart": (draw.world(), indifference.restart),
}
BUSY = ("balance", "froude", "looks", "machine", "moved", "order", "restart")
LAWS |= {f"busy_{name}": (draw.busy(), LAWS[name][1]) for name in BUSY}

# Else numbers that stand in source files near by are drawn now and then, and editing moves seeds.
HypothesisProvider._maybe_draw_constant = lambda *_, **__: None


def judge(name: str, seed: int, shrink: bool = False) -> str:
    """What breaks the law in the world of a seed; empty if it holds."""
    worlds, law = LAWS[name]
    calls, last = 0, ""

    @seeded(seed)
    @settings(
        max_examples=2,
        phases=[Phase.generate] + [Phase.shrink] * shrink,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        verbosity=Verbosity.quiet,
    )
    @given(worlds)
    def holds(world: World) -> None:
        nonlocal calls, last
        calls += 1
        if calls == 1:  # hypothesis begins with the simplest world, whatever the seed
            return
        with tempfile.TemporaryDirectory(prefix="world-") as folder:
            try:
                law(world, Path(folder))
            except Broken as broken:
                last = f"{name}, seed {seed}: {broken}\n{world.text}"
                raise

    try:
        holds()
    except Broken:
        return last
    return ""


def main() -> int:
    """Command line; 1 if a law is broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--law", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--n", type=int, default=500)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--shrink", action="store_true")
    chosen = parser.parse_args()
    began, broken = time.monotonic(), 0
    seeds = range(chosen.seed, chosen.seed + chosen.n)
    names = [chosen.law[seed % len(chosen.law)] for seed in seeds]
    with ProcessPoolExecutor(chosen.jobs) as pool:
        for found in pool.map(judge, names, seeds, [chosen.shrink] * chosen.n):
            if found:
                broken += 1
                print(found, flush=True)
    print(f"{chosen.n} worlds, {broken} break a law, {time.monotonic() - began:.0f} s")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
