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
    add("--light", action="store_true",
        help="one by one on a slope along x, in a given water (physics = 'light')")  # fmt: skip
    add(
        "--every",
        type=float,
        default=3.0,
        help="from one block to the next, with --light [s] (%(default)s)",
    )


def _harbour(given: argparse.Namespace) -> int:
    try:
        x, y, z = (float(part) for part in given.size.split(","))
    except ValueError:
        raise BadRun(f"--size {given.size}: must be X,Y,Z") from None
    wanted = harbour.Harbour(
        (x, y, z), given.spacing, given.water, given.blocks, given.kind, given.height,
        given.every if given.light else 0.0,
    )  # fmt: skip
    if given.light and not given.every > 0:
        raise BadRun(f"--every {given.every:g}: must be positive")
    bed = given.out.with_suffix(".bed.txt")
    files = {
        given.out: harbour.one_by_one(wanted, bed.name) if given.light else harbour.case(wanted)
    }
    if given.light:
        files[bed] = harbour.slope(wanted)
    for path in files:
        if path.exists():
            raise BadRun(f"{path} is there already")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    for path, text in files.items():
        path.write_text(text)
    print(f"{given.out}: see its memory and time with `./mics --check {given.out}`")
    return 0


HARBOUR = Command(
    "harbour",
    "Write the case of a breakwater of many blocks in a basin, to plan with `./mics --check`.",
    (
        "harbour",
        "harbour --light --blocks 200 --every 5",
        "harbour --spacing 0.5 --blocks 500 --kind dolos --height 3 --out coarse.nml",
    ),
    _arguments,
    _harbour,
)
