"""The case of a breakwater of many blocks."""

import argparse
from pathlib import Path

from micstools.cases import harbour
from micstools.commands.base import Command
from micstools.reading.reader import BadRun

PLAIN = harbour.Harbour()


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--out", type=Path, default=Path("harbour.nml"), help="case file to write (%(default)s)")
    add("--size", default="200,100,20", metavar="X,Y,Z", help="of the basin [m] (%(default)s)")
    add("--spacing", type=float, default=PLAIN.spacing, help="of the cells [m] (%(default)s)")
    add("--water", type=float, default=PLAIN.water, help="level [m] (%(default)s)")
    add("--blocks", type=int, default=PLAIN.blocks, help="their number (%(default)s)")
    add("--kind", default=PLAIN.kind, help="of the blocks, see &shape kind (%(default)s)")
    add("--height", type=float, default=PLAIN.height, help="of a block [m] (%(default)s)")


def _harbour(given: argparse.Namespace) -> int:
    try:
        x, y, z = (float(part) for part in given.size.split(","))
    except ValueError:
        raise BadRun(f"--size {given.size}: must be X,Y,Z") from None
    wanted = harbour.Harbour(
        (x, y, z), given.spacing, given.water, given.blocks, given.kind, given.height
    )
    text = harbour.case(wanted)
    if given.out.exists():
        raise BadRun(f"{given.out} is there already")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(text)
    print(f"{given.out}: see its memory and time with `./mics --check {given.out}`")
    return 0


HARBOUR = Command(
    "harbour",
    "Write the case of a breakwater of many blocks in a basin, to plan with `./mics --check`.",
    (
        "harbour",
        "harbour --spacing 0.5 --blocks 500 --kind dolos --height 3 --out coarse.nml",
    ),
    _arguments,
    _harbour,
)
