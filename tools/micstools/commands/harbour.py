"""The case of a breakwater of many blocks."""

import argparse

from micstools.cases import harbour
from micstools.reading.reader import BadRun

PLAIN = harbour.Harbour()


def work(given: argparse.Namespace) -> int:
    x, y, z = given.size
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
