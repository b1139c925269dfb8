"""Edit a case on a page of this machine, run it and watch the run."""

import argparse
from pathlib import Path

from micstools import extras
from micstools.cases import program
from micstools.commands.base import Command
from micstools.commands.watch import add_serving, check_port

_NEW = Path("case.nml")


def _arguments(parser: argparse.ArgumentParser) -> None:
    words = "case file, a new one if it is not there; default: case.nml"
    parser.add_argument("case", type=Path, nargs="?", default=_NEW, help=words)
    parser.add_argument("--program", type=Path, help=program.PROGRAM_HELP)
    add_serving(parser)


def _studio(given: argparse.Namespace) -> int:
    check_port(given.port)
    path = program.find(given.program, given.case)
    extras.need("serve")
    from micstools.serve import server, studio

    server.serve(studio.site_of(given.case, path), given.port, given.browser)
    return 0


STUDIO = Command(
    "studio",
    "Edit a case on a page that this machine alone can open: a form for every group, checked\n"
    "by the program as one types, with the set-up beside it; run it, watch it, open its report.",
    ("studio input/blocks_coarse.nml", "studio reef.nml --port 8100 --no-browser"),
    _arguments,
    _studio,
)
