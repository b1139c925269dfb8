"""Watch a run or an ensemble on a page of this machine."""

import argparse
from pathlib import Path

from micstools import command, extras
from micstools.commands.base import Command
from micstools.reading.reader import BadRun


def add_serving(parser: argparse.ArgumentParser) -> None:
    """The arguments of every command that serves a page."""
    port = "of this machine at which the page is, default: any that is free"
    parser.add_argument("--port", type=int, help=port)
    words = "print the address, open no browser"
    parser.add_argument("--no-browser", dest="browser", action="store_false", help=words)


def check_port(port: int | None) -> None:
    """Raise BadRun where `--port` is no port."""
    if port is not None and not 1 <= port <= 65535:
        raise BadRun(f"--port {port}: must be from 1 to 65535")


def _arguments(parser: argparse.ArgumentParser) -> None:
    words = "its case file, or its folder of results; or the folder of an ensemble"
    parser.add_argument("run", type=Path, help=words)
    add_serving(parser)


def _watch(given: argparse.Namespace) -> int:
    check_port(given.port)
    folder = command.output_of(given.run)
    extras.need("serve")
    from micstools.serve import server, watch

    server.serve(watch.site_of(folder), given.port, given.browser)
    return 0


WATCH = Command(
    "watch",
    "Watch a run or an ensemble while it goes on, on a page that this machine alone can open:\n"
    "motion so far, table of the step, history, time left, and buttons that stop it.",
    ("watch input/blocks_coarse.nml", "watch mics-out", "watch mics-ensemble-blocks_coarse"),
    _arguments,
    _watch,
)
