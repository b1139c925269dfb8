"""What can be said of the pile of a run."""

import argparse
from pathlib import Path

from micstools import command, pile
from micstools.commands.base import Command


def arguments(parser: argparse.ArgumentParser) -> None:
    """Which run, and whether the paper's words are put to it."""
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--paper", action="store_true", help="what the paper says, in any tank")


def findings(given: argparse.Namespace) -> int:
    """Print the findings."""
    run = command.open_run(given.run)
    print(pile.report(pile.findings(run, paper=given.paper or None)))
    return 0


PILE = Command(
    "pile",
    "Say what can be said of the pile of a run; the exit code is 0 whatever is seen.",
    ("pile mics-coarse", "pile mics-coarse --paper"),
    arguments,
    findings,
)
