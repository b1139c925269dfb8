"""Two runs beside each other."""

import argparse
from pathlib import Path

from micstools import command, comparison, pile_ensemble, pile_numbers
from micstools.commands.base import Command
from micstools.reader import BadRun, Run


def _arguments(parser: argparse.ArgumentParser) -> None:
    for name in ("one", "two"):
        parser.add_argument(name, type=Path, help=command.RUN_HELP)


def _numbers(run: Run) -> dict[str, float | str]:
    step = float((run.grid.high - run.grid.low)[:2].max()) / 300
    return pile_ensemble.flat(pile_numbers.numbers(run, step))


def _compare(given: argparse.Namespace) -> int:
    one, two = command.open_run(given.one), command.open_run(given.two)
    for run in (one, two):
        if not run.bodies.n:
            raise BadRun(f"{run.folder} holds no blocks: there is nothing to compare")
    print(f"one: {one.folder}\ntwo: {two.folder}")
    if comparison.same_bits(one, two):
        print("blocks move alike in both, bit by bit")
    _lines("variable", comparison.parameters(one, two))
    a, b = _numbers(one), _numbers(two)
    _lines("number of the pile", [(name, _figure(a[name]), _figure(b[name])) for name in a])
    print(f"{'block':>8}{'parted [s]':>14}{'apart [mm]':>14}{'turned [deg]':>14}   at the end")
    for k in comparison.blocks(one, two):
        parted = "never" if k.parted != k.parted else f"{k.parted:.4g}"
        print(f"{k.block:8}{parted:>14}{1e3 * k.distance:14.4g}{k.angle:14.3g}")
    return 0


def _lines(head: str, rows: list[tuple[str, str, str]]) -> None:
    print(f"\n  {head:34}{'one':28}two")
    for name, first, second in rows or [("no difference", "", "")]:
        print(f"  {name:34}{first:28}{second}".rstrip())
    print()


def _figure(value: float | str) -> str:
    return "-" if value == "" else f"{value:.6g}"


COMPARE = Command(
    "compare",
    "Put two runs beside each other: in what their cases differ, the numbers of both piles, when\n"
    "each block parts from its twin (by a hundredth of its size) and how far apart they end.",
    ("compare mics-coarse mics-7",),
    _arguments,
    _compare,
)
