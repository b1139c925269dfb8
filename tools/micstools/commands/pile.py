"""What can be said of the pile of a run."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from micstools import command, pile, pile_numbers
from micstools.commands.base import Command
from micstools.reader import BadRun


def arguments(parser: argparse.ArgumentParser) -> None:
    """Which run, and whether the paper's words are put to it."""
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--paper", action="store_true", help="what the paper says, in any tank")


def findings(given: argparse.Namespace) -> int:
    """Print the findings."""
    run = command.open_run(given.run)
    print(pile.report(pile.findings(run, paper=given.paper or None)))
    return 0


def _arguments(parser: argparse.ArgumentParser) -> None:
    arguments(parser)
    parser.add_argument("--step", type=float, default=0.001, help="of the plan area [m], 0.001")


def _pile(given: argparse.Namespace) -> int:
    """Print the findings and the numbers, which go into `pile.json`."""
    if not given.step > 0:
        raise BadRun(f"--step {given.step}: must be positive")
    findings(given)
    run = command.open_run(given.run)
    found = asdict(pile_numbers.numbers(run, given.step))
    known = {k: None if v != v else v for k, v in found.items()}  # JSON has no nan
    path = run.folder / "pile.json"
    path.write_text(json.dumps(known, indent=2) + "\n")
    for name, value in known.items():
        values = value if isinstance(value, tuple) else (value,)
        words = ["-" if v is None else f"{v:.5g}" for v in values]
        print(f"     {name:14}{', '.join(words)}")
    print(path)
    return 0


PILE = Command(
    "pile",
    "Say what can be said of the pile of a run, with its numbers in SI units (pile.json);\n"
    "the exit code is 0 whatever is seen.",
    ("pile mics-coarse", "pile mics-coarse --paper"),
    _arguments,
    _pile,
)
