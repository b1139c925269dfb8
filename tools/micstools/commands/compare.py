"""Two runs beside each other."""

import argparse

from micstools import command
from micstools.piles import maps, options, pile_ensemble, pile_numbers
from micstools.reading import comparison, units
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import Units, figure


def _numbers(run: Run) -> dict[str, float | str]:
    told = options.told(run.folder)
    return pile_ensemble.flat(pile_numbers.numbers(run, maps.usual_step(run), told=told))


def work(given: argparse.Namespace) -> int:
    one, two = command.open_run(given.one), command.open_run(given.two)
    for run in (one, two):
        if not run.bodies.n:
            raise BadRun(f"{run.folder} holds no blocks: there is nothing to compare")
    print(f"one: {one.folder}\ntwo: {two.folder}")
    if comparison.same_bits(one, two):
        print("blocks move alike in both, bit by bit")
    _lines("variable", comparison.parameters(one, two))
    a, b, chosen = _numbers(one), _numbers(two), units.of_run(one)
    _lines("number of the pile", [_row(chosen, name, a[name], b[name]) for name in a])
    apart = f"apart [{chosen.length.name}]"
    print(f"{'block':>8}{'parted [s]':>14}{apart:>14}{'turned [deg]':>14}   at the end")
    for k in comparison.blocks(one, two):
        parted = "never" if k.parted != k.parted else figure(k.parted, 4)
        distance = chosen.length.figure(k.distance, 4)
        print(f"{k.block:8}{parted:>14}{distance:>14}{figure(k.angle):>14}")
    return 0


def _lines(head: str, rows: list[tuple[str, str, str]]) -> None:
    print(f"\n  {head:34}{'one':28}two")
    for name, first, second in rows or [("no difference", "", "")]:
        print(f"  {name:34}{first:28}{second}".rstrip())
    print()


def _row(chosen: Units, name: str, one: float | str, two: float | str) -> tuple[str, str, str]:
    """A number of both piles with its unit."""
    unit = pile_numbers.unit(chosen, name)
    a, b = ("-" if v == "" else unit.plain(float(v), 6) for v in (one, two))
    return name, a, b
